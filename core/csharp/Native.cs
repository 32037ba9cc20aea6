// The functions and structures of core/capi/include/quarc.h, which describes them.

using System;
using System.Runtime.InteropServices;
using System.Text;

namespace Quarc
{
    /// <summary>A decoder of the C library, closed once when it is disposed or collected.</summary>
    internal sealed class DecoderHandle : SafeHandle
    {
        private DecoderHandle() : base(IntPtr.Zero, true)
        {
        }

        public override bool IsInvalid => handle == IntPtr.Zero;

        /// <summary>Keeps the memory of the decoder until the result is disposed.</summary>
        public Hold Keep()
        {
            return new Hold(this);
        }

        protected override bool ReleaseHandle()
        {
            Native.quarc_close(ref handle);
            return true;
        }
    }

    /// <summary>Postpones the closing of a decoder, whose pointers are being read.</summary>
    internal struct Hold : IDisposable
    {
        private readonly DecoderHandle held;

        internal Hold(DecoderHandle handle)
        {
            bool isHeld = false;
            handle.DangerousAddRef(ref isHeld);
            held = handle;
        }

        public void Dispose()
        {
            held.DangerousRelease();
        }
    }

    [StructLayout(LayoutKind.Sequential)]
    internal struct NativeState
    {
        public uint Frame;
        public uint Phase;
        public UIntPtr Count;
        public IntPtr Ids;
        public IntPtr Positions;
        public UIntPtr PositionsStride;
        public IntPtr Rotations;
        public UIntPtr RotationsStride;
        public IntPtr Codes;
        public UIntPtr CodesStride;
        public UIntPtr CodeRows;
    }

    [StructLayout(LayoutKind.Sequential)]
    internal struct NativeHead
    {
        public uint Timescale;
        public uint FrameTicks;
        public uint Level;
        public uint LatticeExponent;
        public float LogScaleStep;
        public float OpacityStep;
        public float ShDcStep;
        public float ShRestStep;
        public uint ShDegree;
        public uint RightHanded;
        public uint UpAxis;
        public float MetersPerUnit;
        public uint Updates;
    }

    [StructLayout(LayoutKind.Sequential)]
    internal struct NativeSplats
    {
        public UIntPtr Count;
        public IntPtr Positions;
        public IntPtr Rotations;
        public IntPtr LogScales;
        public IntPtr Opacities;
        public IntPtr Sh;
        public UIntPtr ShCoefficients;
        public uint Changed;
    }

    [StructLayout(LayoutKind.Sequential)]
    internal struct NativeGap
    {
        public ulong Offset;
        public ulong Bytes;
        public long FramesLost;
        public IntPtr RejectId;
    }

    [StructLayout(LayoutKind.Sequential)]
    internal struct NativeText
    {
        public IntPtr Bytes;
        public UIntPtr Length;

        public override string ToString()
        {
            var bytes = new byte[(int)Length];
            if (bytes.Length > 0)
                Marshal.Copy(Bytes, bytes, 0, bytes.Length);
            return Encoding.UTF8.GetString(bytes);
        }
    }

    [StructLayout(LayoutKind.Sequential)]
    internal struct NativeCamera
    {
        public NativeText Name;
        public uint HeldOut;
        public uint Width;
        public uint Height;
        public float FocalX;
        public float FocalY;
        public float CenterX;
        public float CenterY;

        [MarshalAs(UnmanagedType.ByValArray, SizeConst = 9)]
        public float[] Rotation;

        [MarshalAs(UnmanagedType.ByValArray, SizeConst = 3)]
        public float[] Translation;

        public float NearPlane;
    }

    [StructLayout(LayoutKind.Sequential)]
    internal struct NativeEntry
    {
        public NativeText Key;
        public NativeText Value;
    }

    internal static class Native
    {
        public const int Ok = 0;
        public const int Frame = 1;
        public const int Gap = 2;
        public const int End = 3;
        public const int Rejected = -1;
        public const int Limit = -2;
        public const int Misuse = -3;
        public const int DigestSize = 65;

#if UNITY_IOS && !UNITY_EDITOR
        private const string Library = "__Internal"; // linked statically
#else
        private const string Library = "quarc_capi";
#endif

        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern IntPtr quarc_version();

        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern DecoderHandle quarc_open();

        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern DecoderHandle quarc_open_seek(uint start);

        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern DecoderHandle quarc_open_recover();

        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern DecoderHandle quarc_open_parts(uint start);

        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern void quarc_close(ref IntPtr decoder);

        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern int quarc_push(DecoderHandle decoder, ref byte bytes, UIntPtr length);

        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern int quarc_finish(DecoderHandle decoder);

        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern int quarc_pull(DecoderHandle decoder, out NativeState state);

        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern int quarc_head(DecoderHandle decoder, out NativeHead head);

        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern int quarc_digest(DecoderHandle decoder, [Out] byte[] digits);

        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern int quarc_dequantize(DecoderHandle decoder, out NativeSplats splats);

        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern int quarc_gap(DecoderHandle decoder, out NativeGap gap);

        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern IntPtr quarc_reject_id(DecoderHandle decoder);

        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern IntPtr quarc_message(DecoderHandle decoder);

        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern int quarc_put(
            DecoderHandle decoder, ulong offset, ref byte bytes, UIntPtr length);

        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern int quarc_limit(DecoderHandle decoder, ulong size);

        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern int quarc_missing(DecoderHandle decoder, [Out] ulong[] range);

        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern int quarc_index(
            DecoderHandle decoder, [Out] uint[] numbers, [Out] uint[] frames, UIntPtr room);

        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern int quarc_camera(
            DecoderHandle decoder, UIntPtr number, out NativeCamera camera);

        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern int quarc_metadata(
            DecoderHandle decoder, UIntPtr number, out NativeEntry entry);
    }
}
