/** Pictures of `quarc-ref render`, if its Python is available. */

import { spawn, spawnSync, type ChildProcess } from "node:child_process";
import { createHash } from "node:crypto";
import { existsSync, mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { fileURLToPath } from "node:url";

const ROOT = fileURLToPath(new URL("../../", import.meta.url));
const KEPT = join(ROOT, "player/.reference");
const python = findPython();

/** Why there are no reference pictures; false if there are. */
export const skipReference =
  python === null && "no quarc_ref with its renderer here: QUARC_PYTHON names a Python that has it";

/** A PNG of a frame of a stream through a camera. */
export function renderReference(stream: Uint8Array, camera: string, frame: number): Uint8Array {
  const digest = createHash("sha256").update(stream).digest("hex").slice(0, 16);
  const [file, picture] = [`${digest}.quarc`, `${digest}-${camera}-${frame}.png`];
  if (!existsSync(join(KEPT, picture))) {
    mkdirSync(KEPT, { recursive: true });
    writeFileSync(join(KEPT, file), stream);
    const which = ["--camera", camera, "--frames", String(frame), "-o", join(KEPT, picture)];
    runPython(["-m", "quarc_ref", "render", join(KEPT, file), ...which, "--quiet", "--force"]);
  }
  return readFileSync(join(KEPT, picture));
}

/** A stream of simulated Gaussians in motion: `job` are the arguments of Job in benchmarks/moving_stream.py. */
export function makeMovingStream(job: string): Uint8Array {
  const digest = createHash("sha256").update(job).digest("hex").slice(0, 16);
  const path = join(KEPT, `moving-${digest}.quarc`);
  if (!existsSync(path)) {
    mkdirSync(KEPT, { recursive: true });
    const program = "from benchmarks.moving_stream import *; import sys";
    runPython(["-c", `${program}; write_moving_stream(Path(sys.argv[1]), Job(${job}))`, path]);
  }
  return readFileSync(path);
}

/** Run a Python command to its end. */
export function runPython(more: readonly string[]): void {
  const { status, stderr } = spawnSync(python ?? "", more, { cwd: ROOT });
  if (status !== 0) throw new Error(`python ${more.join(" ")}: ${String(stderr)}`);
}

/** Start a Python command with unbuffered output. */
export function startPython(more: readonly string[]): ChildProcess {
  return spawn(python ?? "", ["-u", ...more], { cwd: ROOT, stdio: ["ignore", "pipe", "inherit"] });
}

function findPython(): string | null {
  const known = process.env["QUARC_PYTHON"];
  const candidates = known === undefined ? [join(ROOT, ".venv/bin/python"), "python3"] : [known];
  const works = (name: string): boolean =>
    spawnSync(name, ["-c", "import quarc_ref.rendering.rasterizer"], { cwd: ROOT }).status === 0;
  return candidates.find(works) ?? null;
}
