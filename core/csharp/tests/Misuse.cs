// Checks what the interface does if it is used in unusual ways. Arguments: an ordinary stream, and one
// of many Gaussians.

using System;
using System.IO;
using System.Threading;
using Quarc;

internal static class Misuse
{
    private static void Main(string[] arguments)
    {
        byte[] bytes = File.ReadAllBytes(arguments[0]);
        CheckArguments(bytes);
        CheckCalls(bytes);
        CheckCurrentFrame(bytes);
        CheckPosition(bytes);
        for (int repetition = 0; repetition < 30; repetition++)
            DisposeWhileReading(arguments[1]);
    }

    private static void CheckArguments(byte[] bytes)
    {
        Expect<ArgumentNullException>(() => new FrameReader(null));
        using (StreamDecoder decoder = StreamDecoder.Open())
        {
            Expect<ArgumentNullException>(() => decoder.Push(null, 0, 0));
            Expect<ArgumentOutOfRangeException>(() => decoder.Push(bytes, 0, -1));
            Expect<ArgumentOutOfRangeException>(() => decoder.Put(0, bytes, -1, 1));
            Expect<ArgumentException>(() => decoder.Push(bytes, bytes.Length - 1, 2));
            Expect<ArgumentException>(() => decoder.Put(0, bytes, int.MaxValue, int.MaxValue));
            decoder.Push(bytes, bytes.Length, 0);
        }
    }

    private static void CheckCalls(byte[] bytes)
    {
        StreamDecoder decoder = StreamDecoder.Open();
        Expect<InvalidOperationException>(() => decoder.GetHead(), "parameters");
        Expect<InvalidOperationException>(() => decoder.Dequantize(), "no frame");
        Expect<InvalidOperationException>(() => decoder.GetDigest(), "no frame");
        Expect<InvalidOperationException>(() => decoder.GetGap(), "gap");
        Expect<InvalidOperationException>(() => decoder.Put(0, bytes, 0, 1), "OpenParts");
        Expect<InvalidOperationException>(() => decoder.SetLength(1), "Finish");
        decoder.Finish();
        Expect<InvalidOperationException>(() => decoder.Push(bytes, 0, 1), "finished");
        decoder.Dispose();
        decoder.Dispose();
        Expect<ObjectDisposedException>(() => decoder.Pull());
        Expect<ObjectDisposedException>(() => decoder.GetIds());
        using (StreamDecoder parts = StreamDecoder.OpenParts(0))
        {
            Expect<InvalidOperationException>(() => parts.Push(bytes, 0, 1), "Put");
            Expect<InvalidOperationException>(() => parts.Finish(), "SetLength");
        }
    }

    private static void CheckCurrentFrame(byte[] bytes)
    {
        using (StreamDecoder decoder = StreamDecoder.Open())
        {
            Expect<InvalidOperationException>(() => decoder.GetIds());
            decoder.Push(bytes, 0, bytes.Length);
            uint frameCount = 0;
            for (; decoder.Pull() == Status.Frame; frameCount++)
                Check(decoder.GetIds().Length == decoder.Count);
            Check(decoder.Frame == frameCount - 1 && decoder.Count == decoder.Dequantize().Count);
            Expect<InvalidOperationException>(() => decoder.GetIds());
            decoder.Push(bytes, 0, 1);
            Expect<StreamException>(() => decoder.Pull());
            Check(decoder.Frame == 0 && decoder.Count == 0);
            Expect<InvalidOperationException>(() => decoder.GetIds());
        }
    }

    /// <summary>A stream in another file begins at the position of the file.</summary>
    private static void CheckPosition(byte[] bytes)
    {
        var file = new byte[100 + bytes.Length];
        bytes.CopyTo(file, 100);
        foreach (uint start in new uint[] { 0, 5 })
        {
            using (var reader = new FrameReader(new MemoryStream(file) { Position = 100 }, start))
            {
                reader.Read();
                Check(reader.Decoder.Frame == start);
            }
        }
        using (var reader = new FrameReader(new MemoryStream(bytes) { Position = bytes.Length + 1 }, 5))
            Expect<StreamException>(() => reader.Read(), "truncated");
    }

    /// <summary>The memory of a large frame, once freed, can no longer be read.</summary>
    private static void DisposeWhileReading(string path)
    {
        var reader = new FrameReader(File.OpenRead(path));
        reader.Read();
        var hasBegun = new ManualResetEvent(false);
        var thread = new Thread(() => Expect<ObjectDisposedException>(() =>
        {
            for (;; hasBegun.Set())
                reader.Decoder.GetIds();
        }));
        thread.Start();
        hasBegun.WaitOne();
        reader.Dispose();
        thread.Join();
    }

    private static void Check(bool isTrue)
    {
        if (!isTrue)
            throw new Exception("a check failed");
    }

    private static void Expect<T>(Action action, string message = "") where T : Exception
    {
        try
        {
            action();
        }
        catch (T error) when (error.Message.Contains(message))
        {
            return;
        }
        throw new Exception("no " + typeof(T).Name + " " + message);
    }
}
