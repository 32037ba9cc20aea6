/** Audio files for the tests. */

const SAMPLE_RATE = 8000;

/** Make a WAV file with a tone. */
export function makeWav(seconds: number): Uint8Array {
  const sampleCount = SAMPLE_RATE * seconds;
  const file = Buffer.alloc(44 + 2 * sampleCount);
  file.write("RIFF");
  file.writeUInt32LE(file.length - 8, 4);
  file.write("WAVEfmt ", 8);
  const header = [[16, 4], [1, 2], [1, 2], [SAMPLE_RATE, 4], [2 * SAMPLE_RATE, 4], [2, 2], [16, 2]] as const;
  let offset = 16;
  for (const [value, size] of header) offset = file.writeUIntLE(value, offset, size);
  file.write("data", 36);
  file.writeUInt32LE(2 * sampleCount, 40);
  for (let index = 0; index < sampleCount; index++) file.writeInt16LE(8000 * Math.sin(index / 3), 44 + 2 * index);
  return file;
}

/** Keeps the audio element, which is in no document, in a variable of the page. */
export const KEEP_AUDIO = `
  const { Audio } = window;
  window.Audio = function () { return (window.audioElement = new Audio()); };
`;
