/** The examples of SPEC.md, read from its text. */

import { readFileSync } from "node:fs";

const ROOT = new URL("../../../../", import.meta.url);
const TEXT = readFileSync(new URL("SPEC.md", ROOT), "utf8");

/** The cells of the table `<!-- spec:NAME -->`, row by row, without its head and without code marks. */
export function table(name: string): string[][] {
  return rowsOf(after(`<!-- spec:${name} -->`).split("\n").slice(1).join("\n"));
}

/** The rows of a table, without its head, up to the first other line. */
function rowsOf(text: string): string[][] {
  const lines = text.split("\n");
  const end = lines.findIndex((line) => !line.startsWith("|"));
  return lines.slice(2, end < 0 ? undefined : end).map((line) =>
    line
      .split("|")
      .slice(1, -1)
      .map((cell) => cell.trim().replaceAll("`", "")),
  );
}

/** The rows of the example of F.7. */
export function sampler(): string[][] {
  return rowsOf(after("<!-- made:sampler -->").split("\n\n")[2]);
}

/** The bytes of a stream of Annex G. */
export function streamBytes(name: string): Uint8Array {
  const dump = readFileSync(new URL(`conformance/annex-g/stream-${name}.hex`, ROOT), "utf8");
  const digits = dump.replaceAll(/^[0-9a-f]{8}:/gm, "").replaceAll(/\s/g, "");
  return Uint8Array.from(Buffer.from(digits, "hex"));
}

/** The integers of a cell. */
export function integers(cell: string): number[] {
  return (cell.match(/-?\d+/g) ?? []).map(Number);
}

/** An example of F.8. */
export interface PlanesExample {
  readonly form: string;
  readonly bits: number;
  readonly numbers: number[];
  readonly outer: number[];
  readonly words: number[];
}

/** The examples of F.8, whose text may be broken across lines. */
export function planesExamples(): PlanesExample[] {
  const section = after("<!-- made:planes -->").split("<!-- end:planes -->")[0].replaceAll("\n", " ");
  const pattern = /\*\*(\w+)\((\d)\)\*\* of ([-\d, ]+) in the outer contexts ([\d, ]+); words `([0-9a-f ]+)`/g;
  return [...section.matchAll(pattern)].map(([, form, bits, numbers, outer, words]) => ({
    form,
    bits: Number(bits),
    numbers: integers(numbers),
    outer: integers(outer),
    words: hexWords(words),
  }));
}

/** Numbers in hexadecimal, or none if the text is `none`. */
export function hexWords(cell: string): number[] {
  return cell === "none" ? [] : cell.split(/\s+/).map((word) => parseInt(word, 16));
}

function after(mark: string): string {
  const place = TEXT.indexOf(mark);
  if (place < 0) throw new Error(`SPEC.md has no ${mark}`);
  return TEXT.slice(place);
}
