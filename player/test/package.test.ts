/** What `npm pack` makes can be installed into another project and used there, with its types. */

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { fileURLToPath } from "node:url";
import { test } from "node:test";

const PLAYER = fileURLToPath(new URL("../", import.meta.url));
const STREAM = fileURLToPath(new URL("../../conformance/streams/journey.quarc", import.meta.url));

const PROGRAM = `
import { readFileSync } from "node:fs";
import { readFrames } from "quarc-player/decode";
const bytes = new Uint8Array(readFileSync(process.argv[2])).buffer;
let frames = 0;
for await (const packet of readFrames({ bytes })) frames += packet.count > 0 ? 1 : 0;
console.log(frames);
`;
const TYPED = `
import { Player, StreamError, type PlayerFault, type Statistics } from "quarc-player";
export async function play(canvas: HTMLCanvasElement): Promise<Statistics | PlayerFault | null> {
  const player = new Player(canvas, { controls: false });
  player.addEventListener("frame", ({ detail }) => console.log(detail.frame + 1));
  try {
    const { cameras } = await player.open({ url: "stream.quarc" });
    player.camera = cameras[0]?.name ?? null;
  } catch (error) {
    if (error instanceof StreamError) return error.fault;
  }
  return player.statistics;
}
`;

test("the package is installed into another project", () => {
  const project = mkdtempSync(join(tmpdir(), "quarc-player-"));
  const run = (name: string, ...more: string[]): string =>
    execFileSync(name, more, { cwd: project, encoding: "utf8" });
  try {
    const [packed] = JSON.parse(execFileSync("npm", ["pack", "--json", "--pack-destination", project], { cwd: PLAYER, encoding: "utf8" }));
    writeFileSync(join(project, "package.json"), '{ "type": "module" }');
    run("npm", "install", "--offline", "--no-audit", "--no-fund", "--ignore-scripts", `./${packed.filename}`);
    writeFileSync(join(project, "program.mjs"), PROGRAM);
    assert.equal(run(process.execPath, "program.mjs", STREAM).trim(), "9");
    writeFileSync(join(project, "typed.ts"), TYPED);
    const options = ["--noEmit", "--strict", "--target", "es2022", "--module", "esnext", "--moduleResolution", "bundler"];
    run(process.execPath, join(PLAYER, "node_modules/typescript/bin/tsc"), ...options, "--lib", "es2022,dom,dom.iterable", "typed.ts");
  } finally {
    rmSync(project, { recursive: true, force: true });
  }
});
