#!/usr/bin/env node
/** The command line: a stream on the standard input, or of the file that is named. */

import { closeSync, openSync } from "node:fs";
import { decodeStream } from "./decode.js";
import { stateDigest } from "./digest.js";
import { Declined, Rejection } from "./reject.js";
import { FileSource } from "./source.js";

const EXIT_REJECTED = 1;
const EXIT_DECLINED = 3;

/** Write a line for every frame, and one for a stream that is not decoded to its end; return the exit status. */
function decode(descriptor: number): number {
  try {
    for (const { ordinal, phase, scene } of decodeStream(new FileSource(descriptor))) {
      const digest = stateDigest(scene, phase);
      writeLine({ frame: ordinal, phase, gaussians: scene.ids.length, sha256: digest });
    }
    return 0;
  } catch (error) {
    if (error instanceof Rejection) {
      writeLine({ refused: error.rejectId });
      console.error(error.message);
      return EXIT_REJECTED;
    }
    if (!(error instanceof Declined)) throw error;
    console.error(`beyond the limits of this decoder: ${error.message}`);
    return EXIT_DECLINED;
  }
}

function writeLine(line: object): void {
  process.stdout.write(`${JSON.stringify(line)}\n`);
}

const path = process.argv[2];
const descriptor = path === undefined ? 0 : openSync(path, "r");
process.exitCode = decode(descriptor);
if (path !== undefined) closeSync(descriptor);
