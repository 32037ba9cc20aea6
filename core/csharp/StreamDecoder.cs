using System;
using System.Collections.Generic;
using System.Runtime.InteropServices;
using System.Text;

namespace Quarc
{
    /// <summary>What <see cref="StreamDecoder.Pull"/> has found.</summary>
    public enum Status
    {
        /// <summary>More bytes are needed before the next result.</summary>
        NeedsBytes = Native.Ok,

        /// <summary>The next frame is available.</summary>
        Frame = Native.Frame,

        /// <summary>In recovery: a part of the stream is missing here.</summary>
        Gap = Native.Gap,

        /// <summary>The stream has ended.</summary>
        End = Native.End,
    }

    /// <summary>A stream was rejected, or exceeds what the decoder supports.</summary>
    public sealed class StreamException : Exception
    {
        internal StreamException(string message, string rejectId) : base(message)
        {
            RejectId = rejectId;
        }

        /// <summary>
        /// The rule of SPEC 3.3 that the stream breaks; null if a stream of the unlimited level needs
        /// more than this decoder supports.
        /// </summary>
        public string RejectId { get; }
    }

    /// <summary>
    /// Decodes a stream. <see cref="FrameReader"/> is simpler if the stream is a file. A decoder may be
    /// used by one thread at a time, but disposed by any; different decoders are independent.
    /// </summary>
    public sealed class StreamDecoder : IDisposable
    {
        private const string NoFrame = "there is no frame: call Pull until it returns one";

        private readonly DecoderHandle handle;
        private readonly Splats splats = new Splats();
        private NativeState state;

        private StreamDecoder(DecoderHandle handle)
        {
            this.handle = handle;
        }

        /// <summary>The version of the C library, such as "1.1.0".</summary>
        public static string LibraryVersion => Marshal.PtrToStringAnsi(Native.quarc_version());

        /// <summary>
        /// Ordinal of the current frame, the last that <see cref="Pull"/> has returned. It is 0 if there
        /// is none: before the first frame, and after a gap or an error.
        /// </summary>
        public uint Frame => state.Frame;

        /// <summary>Number of Gaussians of the current frame; 0 if there is none.</summary>
        public int Count => checked((int)state.Count);

        /// <summary>Decodes the frames of a stream as its bytes arrive (<see cref="Push"/>).</summary>
        public static StreamDecoder Open()
        {
            return new StreamDecoder(Native.quarc_open());
        }

        /// <summary>
        /// Decodes the frames from an ordinal on, and skips what it need not decode (SPEC 11.2). The whole
        /// stream is buffered, and no frame is returned before <see cref="Finish"/>.
        /// </summary>
        public static StreamDecoder OpenAt(uint start)
        {
            return new StreamDecoder(Native.quarc_open_seek(start));
        }

        /// <summary>
        /// Decodes the frames from an ordinal on, and reads only the byte ranges that it needs:
        /// <see cref="TryGetMissing"/> names them, <see cref="Put"/> passes them. Many ranges are small: a
        /// request to a server should ask for more (such as 64 KiB), and pass all of it.
        /// </summary>
        public static StreamDecoder OpenParts(uint start)
        {
            return new StreamDecoder(Native.quarc_open_parts(start));
        }

        /// <summary>
        /// Decodes the intact frames of a damaged stream, and reports its gaps (SPEC 11.4). The whole
        /// stream is buffered, and no frame is returned before <see cref="Finish"/>.
        /// </summary>
        public static StreamDecoder OpenRecovery()
        {
            return new StreamDecoder(Native.quarc_open_recover());
        }

        /// <summary>Passes the next bytes of the stream, in pieces of any size; they are copied.</summary>
        public void Push(byte[] bytes, int offset, int count)
        {
            if (!IsEmpty(bytes, offset, count))
                Require(
                    Native.quarc_push(handle, ref bytes[offset], (UIntPtr)count),
                    "Push is for streams that are not finished, and not for OpenParts: call Put");
        }

        /// <summary>Declares the end of the stream; then call <see cref="Pull"/> until it ends.</summary>
        public void Finish()
        {
            Require(Native.quarc_finish(handle), "Finish is not for OpenParts: call SetLength");
        }

        /// <summary>Decodes the next frame.</summary>
        /// <exception cref="StreamException">
        /// The stream is rejected. All frames before the fault were returned.
        /// </exception>
        public Status Pull()
        {
            NativeState next;
            int status = Native.quarc_pull(handle, out next);
            if (status == Native.Frame)
                state = next;
            else if (status == Native.Gap || status < 0)
                state = default(NativeState);
            else
                state.Ids = IntPtr.Zero; // no longer valid
            return (Status)Require(status);
        }

        /// <summary>Returns the parameters of the stream, at the latest at the first frame.</summary>
        public Head GetHead()
        {
            NativeHead head;
            Require(Native.quarc_head(handle, out head), "Pull has not read the parameters yet");
            return new Head(head);
        }

        /// <summary>
        /// Converts the current frame to floats. The result is the same object for every frame, and only
        /// arrays that have changed are written.
        /// </summary>
        public Splats Dequantize()
        {
            NativeSplats native;
            using (handle.Keep())
            {
                Require(Native.quarc_dequantize(handle, out native), NoFrame);
                splats.Update(native);
            }
            return splats;
        }

        /// <summary>
        /// Returns the ids of the current frame's Gaussians, ascending. A Gaussian keeps its id up to the
        /// next canonical frame. Call this directly after <see cref="Pull"/> has returned the frame.
        /// </summary>
        public uint[] GetIds()
        {
            var ids = new uint[Count];
            var bits = new int[ids.Length];
            using (handle.Keep())
            {
                if (state.Ids == IntPtr.Zero)
                    throw new InvalidOperationException("the last Pull did not return a frame");
                Marshal.Copy(state.Ids, bits, 0, bits.Length);
            }
            Buffer.BlockCopy(bits, 0, ids, 0, sizeof(uint) * ids.Length);
            return ids;
        }

        /// <summary>Returns the SHA-256 of the current frame's state (SPEC 9.1) in hexadecimal.</summary>
        public string GetDigest()
        {
            var digits = new byte[Native.DigestSize];
            Require(Native.quarc_digest(handle, digits), NoFrame);
            return Encoding.ASCII.GetString(digits, 0, digits.Length - 1);
        }

        /// <summary>Returns what is missing, after <see cref="Status.Gap"/>.</summary>
        public Gap GetGap()
        {
            NativeGap gap;
            using (handle.Keep())
            {
                Require(Native.quarc_gap(handle, out gap), "the last Pull did not return a gap");
                return new Gap(gap);
            }
        }

        /// <summary>Returns the cameras that the stream contains up to the current frame.</summary>
        public List<CaptureCamera> GetCameras()
        {
            var cameras = new List<CaptureCamera>();
            NativeCamera camera;
            using (handle.Keep())
            {
                while (Native.quarc_camera(handle, (UIntPtr)cameras.Count, out camera) == Native.Ok)
                    cameras.Add(new CaptureCamera(camera));
            }
            return cameras;
        }

        /// <summary>Returns the metadata that the stream contains up to the current frame.</summary>
        public Dictionary<string, string> GetMetadata()
        {
            var metadata = new Dictionary<string, string>();
            NativeEntry entry;
            using (handle.Keep())
            {
                while (Native.quarc_metadata(handle, (UIntPtr)metadata.Count, out entry) == Native.Ok)
                    metadata.Add(entry.Key.ToString(), entry.Value.ToString());
            }
            return metadata;
        }

        /// <summary>Passes bytes from an offset of the stream to a decoder of byte ranges.</summary>
        public void Put(ulong position, byte[] bytes, int offset, int count)
        {
            if (!IsEmpty(bytes, offset, count))
                Require(
                    Native.quarc_put(handle, position, ref bytes[offset], (UIntPtr)count),
                    "Put is for OpenParts, and for bytes below 2^64");
        }

        /// <summary>
        /// Tells a decoder of byte ranges the length of the whole stream in bytes. Do not call this for a
        /// stream that is still being written.
        /// </summary>
        public void SetLength(ulong length)
        {
            Require(Native.quarc_limit(handle, length), "SetLength is for OpenParts: call Finish");
        }

        /// <summary>
        /// Gets the bytes that the last <see cref="Pull"/> or <see cref="TryGetIndex"/> lacked, from
        /// <paramref name="begin"/> to <paramref name="end"/> - 1. Returns false if none are missing.
        /// </summary>
        public bool TryGetMissing(out ulong begin, out ulong end)
        {
            var range = new ulong[2];
            bool isMissing = Native.quarc_missing(handle, range) == Native.Ok;
            begin = range[0];
            end = range[1];
            return isMissing;
        }

        /// <summary>
        /// Reads the index of a complete stream, in a decoder of byte ranges: the number of frames, and the
        /// ordinals of the canonical ones. Returns false if bytes are missing (<see
        /// cref="TryGetMissing"/>), or if the stream has no intact index and none are missing.
        /// </summary>
        public bool TryGetIndex(out uint frameCount, out uint[] canonicalFrames)
        {
            var numbers = new uint[2];
            canonicalFrames = new uint[0];
            int status = Require(
                Native.quarc_index(handle, numbers, canonicalFrames, UIntPtr.Zero));
            frameCount = numbers[0];
            if (status != Native.Frame)
                return false;
            canonicalFrames = new uint[numbers[1]];
            Require(Native.quarc_index(handle, numbers, canonicalFrames, (UIntPtr)numbers[1]));
            return true;
        }

        /// <summary>Frees the decoder.</summary>
        public void Dispose()
        {
            handle.Dispose();
        }

        /// <summary>Returns whether a range is empty; throws if it is not in the array.</summary>
        private static bool IsEmpty(byte[] bytes, int offset, int count)
        {
            if (bytes == null)
                throw new ArgumentNullException(nameof(bytes));
            if (offset < 0)
                throw new ArgumentOutOfRangeException(nameof(offset));
            if (count < 0)
                throw new ArgumentOutOfRangeException(nameof(count));
            if (count > bytes.Length - offset)
                throw new ArgumentException("the range ends after the array");
            return count == 0;
        }

        /// <summary>Returns a status that is no error; the message says when the call is allowed.</summary>
        private int Require(int status, string misuse = null)
        {
            if (status >= 0)
                return status;
            if (status == Native.Misuse)
                throw new InvalidOperationException(misuse);
            string message, rejectId;
            using (handle.Keep())
            {
                message = Marshal.PtrToStringAnsi(Native.quarc_message(handle));
                rejectId = Marshal.PtrToStringAnsi(Native.quarc_reject_id(handle));
            }
            if (status == Native.Rejected || status == Native.Limit)
                throw new StreamException(message, rejectId);
            throw new InvalidOperationException("the decoder has failed: " + message);
        }
    }
}
