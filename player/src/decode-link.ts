/**
 * The page's connection to the decode worker.
 *
 * Opening a stream, a seek and each lap of a loop start a new run, which replaces the previous run. Replies to replaced
 * runs are dropped, unless they describe the whole stream.
 */

import type { DecodeReply, PlayerFault, StreamSource } from "./protocol.js";
import { describeWorkerError, makeDecoder, sendRequest } from "./workers.js";

export class DecodeLink {
  /** Number of the current run; 0 before the first. */
  run = 0;
  #openingRun = 0;
  readonly #onReply: (reply: DecodeReply) => void;
  readonly #onFault: (fault: PlayerFault) => void;
  #hasFailed = false;
  #decoder: Worker;

  constructor(onReply: (reply: DecodeReply) => void, onFault: (fault: PlayerFault) => void) {
    this.#onReply = onReply;
    this.#onFault = onFault;
    this.#decoder = this.#startDecoder();
  }

  /**
   * Open a stream, and allow `frames` frames to be decoded; a decoder that has failed is started again. If the bytes were
   * transferred before, throw a DataCloneError.
   */
  open(source: StreamSource, frames: number): void {
    if (this.#hasFailed) {
      this.close();
      this.#decoder = this.#startDecoder();
    }
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
    this.#hasFailed = false;
    this.#decoder.onmessage = this.#decoder.onerror = null;
    this.#decoder.terminate();
  }

  #startDecoder(): Worker {
    const decoder = makeDecoder();
    decoder.onmessage = ({ data }) => {
      if (this.#isCurrent(data as DecodeReply)) this.#onReply(data as DecodeReply);
    };
    decoder.onerror = (event) => {
      this.#hasFailed = true;
      this.#onFault(describeWorkerError(event));
    };
    return decoder;
  }

  #isCurrent(reply: DecodeReply): boolean {
    const run = reply.kind === "frame" ? reply.packet.run : reply.run;
    const describesStream = reply.kind === "info" || reply.kind === "edge";
    return run === this.run || (describesStream && run >= this.#openingRun);
  }
}
