/** Reads tables and examples from SPEC.md. */

import { readFileSync } from "node:fs";

const ROOT = new URL("../../../../", import.meta.url);
const TEXT = readFileSync(new URL("SPEC.md", ROOT), "utf8");

/** Read the cells of the table after `<!-- spec:NAME -->`, by row, without the table head and without backquotes. */
export function readTable(name: string): string[][] {
  return parseRows(textAfter(`<!-- spec:${name} -->`).split("\n").slice(1).join("\n"));
}

/** Parse the rows of a table, without its head, up to the first line that is not a row. */
function parseRows(text: string): string[][] {
  const lines = text.split("\n");
  const end = lines.findIndex((line) => !line.startsWith("|"));
  return lines.slice(2, end < 0 ? undefined : end).map((line) =>
    line
      .split("|")
      .slice(1, -1)
      .map((cell) => cell.trim().replaceAll("`", "")),
  );
}

/** Read the rows of the example of F.7. */
export function readSamplerExample(): string[][] {
  return parseRows(textAfter("<!-- made:sampler -->").split("\n\n")[2]);
}

/** Read the bytes of a stream of Annex G. */
export function readStream(name: string): Uint8Array {
  const dump = readFileSync(new URL(`conformance/annex-g/stream-${name}.hex`, ROOT), "utf8");
  const digits = dump.replaceAll(/^[0-9a-f]{8}:/gm, "").replaceAll(/\s/g, "");
  return Uint8Array.from(Buffer.from(digits, "hex"));
}

/** Parse all integers of a cell. */
export function parseIntegers(cell: string): number[] {
  return (cell.match(/-?\d+/g) ?? []).map(Number);
}

/** An example of F.8: a coded sequence. */
export interface PlanesExample {
  readonly form: string;
  readonly bits: number;
  readonly numbers: number[];
  readonly outer: number[];
  readonly words: number[];
}

/** Read the examples of F.8, whose text may continue on the next line. */
export function readPlanesExamples(): PlanesExample[] {
  const section = textAfter("<!-- made:planes -->").split("<!-- end:planes -->")[0].replaceAll("\n", " ");
  const pattern = /\*\*(\w+)\((\d)\)\*\* of ([-\d, ]+) in the outer contexts ([\d, ]+); words `([0-9a-f ]+)`/g;
  return [...section.matchAll(pattern)].map(([, form, bits, numbers, outer, words]) => ({
    form,
    bits: Number(bits),
    numbers: parseIntegers(numbers),
    outer: parseIntegers(outer),
    words: parseHexWords(words),
  }));
}

/** Parse hexadecimal numbers; the text `none` means no numbers. */
export function parseHexWords(cell: string): number[] {
  return cell === "none" ? [] : cell.split(/\s+/).map((word) => parseInt(word, 16));
}

function textAfter(mark: string): string {
  const offset = TEXT.indexOf(mark);
  if (offset < 0) throw new Error(`SPEC.md has no ${mark}`);
  return TEXT.slice(offset);
}
