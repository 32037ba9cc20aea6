/** Runs quarc-ref, if a Python with its packages is available: reference pictures and simulated streams. */

import { spawn, spawnSync, type ChildProcess } from "node:child_process";
import { createHash } from "node:crypto";
import { existsSync, mkdirSync, readdirSync, readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { fileURLToPath } from "node:url";

const ROOT = fileURLToPath(new URL("../../", import.meta.url));
const CACHE_FOLDER = join(ROOT, "player/.reference");
const python = findPython();

/** The reason for skipping tests that need quarc-ref; false if quarc-ref is available. */
export const referenceSkipReason =
  python === null && "quarc_ref and its renderer are not installed: set QUARC_PYTHON to a Python that has them";

/**
 * Render all frames of a stream from a camera with quarc-ref; return the PNGs in their order.
 *
 * `options` are further options of `quarc-ref render`, and `path` is the content of a file for `--path`.
 */
export function renderReference(stream: Uint8Array, camera: string, options: readonly string[] = [], path = ""): Uint8Array[] {
  const digest = createHash("sha256").update(stream).update([...options, path].join("\n")).digest("hex").slice(0, 16);
  const [streamPath, pathPath] = ["quarc", "json"].map((suffix) => join(CACHE_FOLDER, `${digest}.${suffix}`)) as [string, string];
  const folder = join(CACHE_FOLDER, `${digest}-${camera}`);
  const pathOptions = path === "" ? [] : ["--path", pathPath];
  if (!existsSync(folder)) {
    mkdirSync(CACHE_FOLDER, { recursive: true });
    writeFileSync(streamPath, stream);
    writeFileSync(pathPath, path);
    const allOptions = ["--camera", camera, ...options, ...pathOptions, "--to", "png", "-o", folder, "--quiet"];
    runPython(["-m", "quarc_ref", "render", streamPath, ...allOptions]);
  }
  const names = readdirSync(folder).filter((name) => name.endsWith(".png"));
  return names.sort().map((name) => readFileSync(join(folder, name)));
}

/** Make a stream of simulated moving Gaussians; `job` contains the arguments of Job in benchmarks/moving_stream.py. */
export function makeMovingStream(job: string): Uint8Array {
  const digest = createHash("sha256").update(job).digest("hex").slice(0, 16);
  const path = join(CACHE_FOLDER, `moving-${digest}.quarc`);
  if (!existsSync(path)) {
    mkdirSync(CACHE_FOLDER, { recursive: true });
    const program = "from benchmarks.moving_stream import *; import sys";
    runPython(["-c", `${program}; write_moving_stream(Path(sys.argv[1]), Job(${job}))`, path]);
  }
  return readFileSync(path);
}

/** Run a Python command, and wait until it has ended. Throws an Error if it fails. */
export function runPython(args: readonly string[]): void {
  const { status, stderr } = spawnSync(python ?? "", args, { cwd: ROOT });
  if (status !== 0) throw new Error(`python ${args.join(" ")}: ${String(stderr)}`);
}

/** Start a Python command with unbuffered output. */
export function startPython(args: readonly string[]): ChildProcess {
  return spawn(python ?? "", ["-u", ...args], { cwd: ROOT, stdio: ["ignore", "pipe", "inherit"] });
}

function findPython(): string | null {
  const configuredPython = process.env["QUARC_PYTHON"];
  const candidates = configuredPython === undefined ? [join(ROOT, ".venv/bin/python"), "python3"] : [configuredPython];
  const canRender = (name: string): boolean =>
    spawnSync(name, ["-c", "import quarc_ref.rendering.rasterizer"], { cwd: ROOT }).status === 0;
  return candidates.find(canRender) ?? null;
}
