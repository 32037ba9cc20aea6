using System;
using System.IO;

namespace Quarc
{
    /// <summary>
    /// Reads the frames of a stream, one after the other:
    /// <code>
    /// using (var reader = new FrameReader(File.OpenRead("steak.quarc")))
    ///     while (reader.Read())
    ///         Show(reader.Decoder.Dequantize());
    /// </code>
    /// </summary>
    public sealed class FrameReader : IDisposable
    {
        private const int BufferSize = 1 << 16;

        private readonly Stream stream;
        private readonly bool readsParts;
        private readonly long origin; // of the stream in the bytes, if it reads parts
        private readonly byte[] buffer = new byte[BufferSize];
        private bool isFinished;

        /// <summary>Reads the frames from an ordinal on.</summary>
        /// <param name="stream">
        /// The bytes from its position to its end. The reader owns it. If it can seek, only what is needed
        /// is read for a start above 0.
        /// </param>
        /// <param name="start">Ordinal of the first frame to return.</param>
        public FrameReader(Stream stream, uint start = 0)
        {
            this.stream = stream ?? throw new ArgumentNullException(nameof(stream));
            readsParts = start > 0 && stream.CanSeek;
            if (readsParts)
            {
                origin = stream.Position;
                Decoder = StreamDecoder.OpenParts(start);
                Decoder.SetLength((ulong)Math.Max(stream.Length - origin, 0));
            }
            else
            {
                Decoder = start > 0 ? StreamDecoder.OpenAt(start) : StreamDecoder.Open();
            }
        }

        /// <summary>The decoder, which holds the current frame.</summary>
        public StreamDecoder Decoder { get; }

        /// <summary>Decodes the next frame; returns false at the end of the stream.</summary>
        /// <exception cref="StreamException">
        /// The stream is rejected. All frames before the fault were returned.
        /// </exception>
        public bool Read()
        {
            Status status;
            while ((status = Decoder.Pull()) != Status.Frame)
            {
                // After the end of the stream, further bytes are rejected, so all are read.
                if (status == Status.End && (readsParts || isFinished))
                    return false;
                Feed();
            }
            return true;
        }

        /// <summary>Frees the decoder, and closes the stream.</summary>
        public void Dispose()
        {
            Decoder.Dispose();
            stream.Dispose();
        }

        private void Feed()
        {
            ulong begin = 0, end = BufferSize;
            if (readsParts && Decoder.TryGetMissing(out begin, out end))
                stream.Position = origin + (long)begin;
            int count = stream.Read(buffer, 0, (int)Math.Min(end - begin, BufferSize));
            if (count == 0 && readsParts)
                throw new EndOfStreamException("the stream has become shorter");
            if (readsParts)
            {
                Decoder.Put(begin, buffer, 0, count);
            }
            else if (count > 0)
            {
                Decoder.Push(buffer, 0, count);
            }
            else
            {
                Decoder.Finish();
                isFinished = true;
            }
        }
    }
}
