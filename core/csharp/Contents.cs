using System;
using System.Runtime.InteropServices;

namespace Quarc
{
    /// <summary>Which arrays of <see cref="Splats"/> differ from the frame converted before.</summary>
    [Flags]
    public enum Changes
    {
        /// <summary>None.</summary>
        None = 0,

        /// <summary>Positions.</summary>
        Positions = 1,

        /// <summary>Rotations.</summary>
        Rotations = 2,

        /// <summary>Log-scales, opacities and SH.</summary>
        Codes = 4,
    }

    /// <summary>
    /// A frame as floats (SPEC 10.1), one row per Gaussian and without activation, as 3DGS stores them.
    /// Arrays can be longer than the rows of <see cref="Count"/> Gaussians.
    /// </summary>
    public sealed class Splats
    {
        private float[] positions = new float[0];
        private float[] rotations = new float[0];
        private float[] logScales = new float[0];
        private float[] opacities = new float[0];
        private float[] sh = new float[0];

        /// <summary>Number of Gaussians.</summary>
        public int Count { get; private set; }

        /// <summary>SH coefficients per color: 1 at SH degree 0, 4 at degree 1.</summary>
        public int ShCoefficients { get; private set; }

        /// <summary>Which arrays differ from the frame converted before.</summary>
        public Changes Changes { get; private set; }

        /// <summary>x, y and z of each Gaussian, world units.</summary>
        public float[] Positions => positions;

        /// <summary>w, x, y and z of each Gaussian's unit quaternion.</summary>
        public float[] Rotations => rotations;

        /// <summary>Natural logarithms of three standard deviations, world units.</summary>
        public float[] LogScales => logScales;

        /// <summary>Logits of the opacities.</summary>
        public float[] Opacities => opacities;

        /// <summary>Red, green and blue of each SH coefficient of each Gaussian.</summary>
        public float[] Sh => sh;

        internal void Update(NativeSplats native)
        {
            Count = checked((int)native.Count);
            ShCoefficients = (int)native.ShCoefficients;
            Changes = (Changes)native.Changed;
            bool codesHaveChanged = (Changes & Changes.Codes) != 0;
            Copy(native.Positions, ref positions, 3, (Changes & Changes.Positions) != 0);
            Copy(native.Rotations, ref rotations, 4, (Changes & Changes.Rotations) != 0);
            Copy(native.LogScales, ref logScales, 3, codesHaveChanged);
            Copy(native.Opacities, ref opacities, 1, codesHaveChanged);
            Copy(native.Sh, ref sh, 3 * ShCoefficients, codesHaveChanged);
        }

        /// <summary>Copies rows, into an array with room to grow if they do not fit.</summary>
        private void Copy(IntPtr rows, ref float[] array, int columns, bool hasChanged)
        {
            int length = checked(columns * Count);
            if (!hasChanged || length == 0)
                return;
            if (array.Length < length)
                array = new float[array.Length == 0 ? length : checked(length + length / 8)];
            Marshal.Copy(rows, array, 0, length);
        }
    }

    /// <summary>The parameters of a stream that a player needs (SPEC 5.3).</summary>
    public sealed class Head
    {
        internal Head(NativeHead head)
        {
            FramesPerSecond = (double)head.Timescale / head.FrameTicks;
            Level = (int)head.Level;
            ShDegree = (int)head.ShDegree;
            IsRightHanded = head.RightHanded != 0;
            UpAxis = head.UpAxis < Axes.Length ? Axes[head.UpAxis] : null;
            MetersPerUnit = head.MetersPerUnit;
        }

        private static readonly string[] Axes = { null, "x", "-x", "y", "-y", "z", "-z" };

        /// <summary>Frames per second.</summary>
        public double FramesPerSecond { get; }

        /// <summary>The level of the stream: 10, 20, 30, or 31 for none (SPEC 3.2).</summary>
        public int Level { get; }

        /// <summary>SH degree: 0 or 1.</summary>
        public int ShDegree { get; }

        /// <summary>Whether the world is right-handed.</summary>
        public bool IsRightHanded { get; }

        /// <summary>The axis that points up, such as "-y"; null if unknown.</summary>
        public string UpAxis { get; }

        /// <summary>Size of a world unit in meters; 0 if unknown.</summary>
        public float MetersPerUnit { get; }
    }

    /// <summary>A part of a damaged stream that was skipped (SPEC 11.4).</summary>
    public sealed class Gap
    {
        internal Gap(NativeGap gap)
        {
            Offset = gap.Offset;
            Bytes = gap.Bytes;
            FramesLost = gap.FramesLost < 0 ? (long?)null : gap.FramesLost;
            RejectId = Marshal.PtrToStringAnsi(gap.RejectId);
        }

        /// <summary>Offset of its first byte.</summary>
        public ulong Offset { get; }

        /// <summary>Its length in bytes.</summary>
        public ulong Bytes { get; }

        /// <summary>Number of frames lost; null if unknown.</summary>
        public long? FramesLost { get; }

        /// <summary>Why decoding stopped at its beginning: a reject id of SPEC 3.3.</summary>
        public string RejectId { get; }
    }

    /// <summary>A camera of the capture (SPEC 5.6).</summary>
    public sealed class CaptureCamera
    {
        internal CaptureCamera(NativeCamera camera)
        {
            Name = camera.Name.ToString();
            IsHeldOut = camera.HeldOut != 0;
            Width = camera.Width;
            Height = camera.Height;
            Focal = new[] { camera.FocalX, camera.FocalY };
            Center = new[] { camera.CenterX, camera.CenterY };
            Rotation = camera.Rotation;
            Translation = camera.Translation;
            NearPlane = camera.NearPlane;
        }

        /// <summary>Its name in the capture.</summary>
        public string Name { get; }

        /// <summary>Whether it was held out of training.</summary>
        public bool IsHeldOut { get; }

        /// <summary>Width of its pictures.</summary>
        public uint Width { get; }

        /// <summary>Height of its pictures.</summary>
        public uint Height { get; }

        /// <summary>fx and fy, pixels.</summary>
        public float[] Focal { get; }

        /// <summary>cx and cy, pixels; the center of the first pixel is (0.5, 0.5).</summary>
        public float[] Center { get; }

        /// <summary>Rotation from world to camera, row-major.</summary>
        public float[] Rotation { get; }

        /// <summary>Translation from world to camera, world units.</summary>
        public float[] Translation { get; }

        /// <summary>The smallest visible depth, world units.</summary>
        public float NearPlane { get; }
    }
}
