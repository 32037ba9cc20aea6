/** The package that `npm pack` makes can be installed into another project, and includes types. */

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdtempSync, readdirSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { fileURLToPath } from "node:url";
import { test } from "node:test";

const PLAYER_FOLDER = fileURLToPath(new URL("../", import.meta.url));
const STREAM_PATH = fileURLToPath(new URL("../../conformance/streams/journey.quarc", import.meta.url));

const JAVASCRIPT_PROGRAM = `
import { readFileSync } from "node:fs";
import { readFrames } from "quarc-player/decode";
const bytes = new Uint8Array(readFileSync(process.argv[2])).buffer;
let frames = 0;
for await (const packet of readFrames({ bytes })) frames += packet.count > 0 ? 1 : 0;
console.log(frames);
`;
const TYPESCRIPT_PROGRAM = `
import { Player, StreamError, type Axis, type PixelFormat, type PlayerEvents, type PlayerFault, type Statistics } from "quarc-player";
export const [up, format]: [Axis, PixelFormat] = ["-y", "bytes"];
export function watch(player: Player): void {
  const element = document.createElement("quarc-player");
  const log = ({ detail }: CustomEvent<PlayerEvents["error"]>): void => console.log(detail.kind);
  for (const target of [player, element]) {
    target.addEventListener("error", log);
    target.removeEventListener("error", log);
  }
  element.removeEventListener("click", ({ clientX }) => console.log(clientX));
  element.play();
}
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

test("another project can install and use the package", () => {
  const project = mkdtempSync(join(tmpdir(), "quarc-player-"));
  const runCommand = (name: string, ...args: string[]): string =>
    execFileSync(name, args, { cwd: project, encoding: "utf8" });
  try {
    const [packResult] = JSON.parse(
      execFileSync("npm", ["pack", "--json", "--pack-destination", project], { cwd: PLAYER_FOLDER, encoding: "utf8" }),
    );
    const packedPaths = packResult.files.map(({ path }: { path: string }) => path);
    assert.ok(packedPaths.includes("dist/LICENSE"), `${packedPaths}`);
    writeFileSync(join(project, "package.json"), '{ "type": "module" }');
    runCommand("npm", "install", "--offline", "--no-audit", "--no-fund", "--ignore-scripts", `./${packResult.filename}`);
    writeFileSync(join(project, "program.mjs"), JAVASCRIPT_PROGRAM);
    assert.equal(runCommand(process.execPath, "program.mjs", STREAM_PATH).trim(), "9");
    writeFileSync(join(project, "typed.ts"), TYPESCRIPT_PROGRAM);
    const options = ["--noEmit", "--strict", "--target", "es2022", "--module", "esnext", "--moduleResolution", "bundler"];
    runCommand(process.execPath, join(PLAYER_FOLDER, "node_modules/typescript/bin/tsc"), ...options, "--lib", "es2022,dom,dom.iterable", "typed.ts");
    const typesFolder = join(project, "node_modules/quarc-player/dist/types");
    for (const name of readdirSync(typesFolder, { recursive: true, encoding: "utf8" })) {
      const types = name.endsWith(".ts") ? readFileSync(join(typesFolder, name), "utf8") : "";
      assert.doesNotMatch(types, /Array<Array/, `${name}: before version 5.7 of TypeScript, typed arrays have no type parameter`);
    }
  } finally {
    rmSync(project, { recursive: true, force: true });
  }
});
