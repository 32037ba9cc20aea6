// Prints everything that the interface returns for a stream, for a comparison with the C interface.
// Floats are printed as the sum of their bits.

using System;
using System.Collections.Generic;
using System.IO;
using System.Linq;
using Quarc;

internal static class Contents
{
    private static void Main(string[] arguments)
    {
        byte[] bytes = File.ReadAllBytes(arguments[0]);
        Console.WriteLine(StreamDecoder.LibraryVersion);
        PrintFrames(bytes);
        PrintIndex(bytes);
        PrintGaps(bytes);
    }

    private static void PrintFrames(byte[] bytes)
    {
        using (var reader = new FrameReader(new MemoryStream(bytes)))
        {
            StreamDecoder decoder = reader.Decoder;
            for (bool isFirst = true; reader.Read(); isFirst = false)
            {
                if (isFirst)
                    PrintHead(decoder);
                Splats splats = decoder.Dequantize();
                long ids = decoder.GetIds().Sum(id => (long)id);
                Console.WriteLine(
                    $"{decoder.Frame} {splats.Count} {ids} {(int)splats.Changes} "
                    + $"{Sum(splats.Positions, 3 * splats.Count)} {Sum(splats.Rotations, 4 * splats.Count)} "
                    + $"{Sum(splats.LogScales, 3 * splats.Count)} {Sum(splats.Opacities, splats.Count)} "
                    + $"{Sum(splats.Sh, 3 * splats.ShCoefficients * splats.Count)}");
            }
        }
    }

    private static void PrintHead(StreamDecoder decoder)
    {
        Head head = decoder.GetHead();
        Console.WriteLine(
            $"{head.FramesPerSecond == 30} {head.Level} {head.ShDegree} {head.IsRightHanded} "
            + $"{head.UpAxis} {Sum(head.MetersPerUnit)}");
        foreach (CaptureCamera camera in decoder.GetCameras())
        {
            Console.WriteLine(
                $"{camera.Name} {camera.IsHeldOut} {camera.Width} {camera.Height} "
                + $"{Sum(camera.Focal)} {Sum(camera.Center)} {Sum(camera.Rotation)} "
                + $"{Sum(camera.Translation)} {Sum(camera.NearPlane)}");
        }
        foreach (KeyValuePair<string, string> entry in decoder.GetMetadata())
            Console.WriteLine($"{entry.Key}={entry.Value}");
    }

    private static void PrintIndex(byte[] bytes)
    {
        using (StreamDecoder decoder = StreamDecoder.OpenParts(0))
        {
            uint frameCount;
            uint[] canonicalFrames;
            decoder.SetLength((ulong)bytes.Length);
            while (!decoder.TryGetIndex(out frameCount, out canonicalFrames)
                && decoder.TryGetMissing(out ulong begin, out ulong end))
            {
                decoder.Put(begin, bytes, (int)begin, (int)(end - begin));
            }
            Console.WriteLine($"{frameCount} {string.Join(" ", canonicalFrames)}");
        }
    }

    private static void PrintGaps(byte[] bytes)
    {
        var damaged = (byte[])bytes.Clone();
        damaged[bytes.Length / 2] ^= 1;
        using (StreamDecoder decoder = StreamDecoder.OpenRecovery())
        {
            decoder.Push(damaged, 0, 100);
            decoder.Push(damaged, 100, damaged.Length - 100);
            decoder.Finish();
            Status status;
            while ((status = decoder.Pull()) != Status.End)
            {
                Gap gap = status == Status.Gap ? decoder.GetGap() : null;
                Console.WriteLine(
                    gap != null
                        ? $"{gap.Offset} {gap.Bytes} {gap.FramesLost ?? -1} {gap.RejectId}"
                        : $"{decoder.Frame} {decoder.GetDigest()}");
            }
        }
    }

    private static long Sum(params float[] numbers)
    {
        return Sum(numbers, numbers.Length);
    }

    private static long Sum(float[] numbers, int length)
    {
        return numbers.Take(length).Sum(number => (long)BitConverter.ToUInt32(BitConverter.GetBytes(number), 0));
    }
}
