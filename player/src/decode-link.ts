/**
 * The page's connection to the decode worker.
 *
 * Opening a stream, a seek and each lap of a loop start a new run, which replaces the previous run. Replies to replaced
 * runs are dropped, unless they describe the whole stream.
 */

import type { DecodeReply, PlayerFault, StreamSource } from "./protocol.js";
import { describeWorkerError, sendRequest } from "./workers.js";

export class DecodeLink {
  /** Number of the current run; 0 before the first. */
  run = 0;
  #openingRun = 0;
  readonly #decoder: Worker;

  constructor(decoder: Worker, onReply: (reply: DecodeReply) => void, onFault: (fault: PlayerFault) => void) {
    this.#decoder = decoder;
    decoder.onmessage = ({ data }) => {
      if (this.#isCurrent(data as DecodeReply)) onReply(data as DecodeReply);
    };
    decoder.onerror = (event) => onFault(describeWorkerError(event));
  }

  /** Open a stream, and allow `frames` frames to be decoded. If the bytes were transferred before, throw a DataCloneError. */
  open(source: StreamSource, frames: number): void {
    sendRequest(this.#decoder, { kind: "open", source, run: this.run + 1 });
    this.#openingRun = ++this.run;
    this.allowFrames(frames);
  }

  /** Continue at a frame, or at the last frame if the stream ends earlier; allow `frames` frames to be decoded. */
  seek(frame: number, frames: number): void {
    this.run += 1;
    sendRequest(this.#decoder, { kind: "seek", frame, run: this.run, clampToLast: true });
    this.allowFrames(frames);
  }

  /** Allow `frames` more frames to be decoded. */
  allowFrames(frames: number): void {
    sendRequest(this.#decoder, { kind: "more", frames, run: this.run });
  }

  /** Drop further replies to the current run, and return the number of a new run, which has no replies. */
  abandon(): number {
    return ++this.run;
  }

  close(): void {
    this.#decoder.onmessage = this.#decoder.onerror = null;
    this.#decoder.terminate();
  }

  #isCurrent(reply: DecodeReply): boolean {
    const run = reply.kind === "frame" ? reply.packet.run : reply.run;
    const describesStream = reply.kind === "info" || reply.kind === "edge";
    return run === this.run || (describesStream && run >= this.#openingRun);
  }
}
