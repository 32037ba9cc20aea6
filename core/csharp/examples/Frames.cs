// Decodes a stream and prints "frame gaussians sha256" for every frame.
//
//   mcs Frames.cs ../*.cs -out:Frames.exe
//   LD_LIBRARY_PATH=../../target/release mono Frames.exe FILE [FIRST]
//
// Exit status: 0 success; 1 the stream is rejected; 2 any other error; 3 the stream exceeds the
// limits of this decoder.

using System;
using System.IO;
using Quarc;

internal static class Frames
{
    private static int Main(string[] arguments)
    {
        uint first = 0;
        if (arguments.Length < 1 || arguments.Length > 2
            || (arguments.Length == 2 && !uint.TryParse(arguments[1], out first)))
        {
            Console.Error.WriteLine("usage: Frames FILE [FIRST]");
            return 2;
        }
        try
        {
            Print(arguments[0], first);
            return 0;
        }
        catch (StreamException error) // the message begins with the reject id, if there is one
        {
            Console.Error.WriteLine("Frames: " + arguments[0] + ": " + error.Message);
            return error.RejectId != null ? 1 : 3;
        }
        catch (Exception error) when (error is IOException || error is UnauthorizedAccessException)
        {
            Console.Error.WriteLine("Frames: " + arguments[0] + ": " + error.Message);
            return 2;
        }
    }

    private static void Print(string path, uint first)
    {
        using (var reader = new FrameReader(File.OpenRead(path), first))
        {
            while (reader.Read())
            {
                StreamDecoder decoder = reader.Decoder;
                Console.WriteLine(decoder.Frame + " " + decoder.Count + " " + decoder.GetDigest());
            }
        }
    }
}
