/**
 * The page's side of the decode worker: runs, and the replies to them.
 *
 * A run is an opening, a seek or a lap of a loop. Replies to a replaced run are dropped, except for information on the
 * stream as a whole.
 */

import type { DecodeReply, DecodeRequest, PlayerFault, StreamSource } from "./protocol.js";

export class DecodeLink {
  /** Number of the last run. */
  run = 0;
  #runOpened = 0;
  readonly #decoder: Worker;

  constructor(decoder: Worker, receive: (reply: DecodeReply) => void, fail: (fault: PlayerFault) => void) {
    this.#decoder = decoder;
    decoder.onmessage = ({ data }) => {
      if (this.#isWanted(data as DecodeReply)) receive(data as DecodeReply);
    };
    decoder.onerror = (event) => {
      const message = event.message || "the decode worker could not be started";
      fail({ kind: "player", message, rejectId: null, frame: null });
    };
  }

  /** Open a stream, and allow a number of frames to be decoded. */
  open(source: StreamSource, frames: number): void {
    this.#runOpened = ++this.run;
    const transferred = "bytes" in source ? [source.bytes] : [];
    this.#decoder.postMessage({ kind: "open", source, run: this.run }, transferred);
    this.allow(frames);
  }

  /** Continue at a frame, or at the last one of the stream if that comes first. */
  seek(frame: number, frames: number): void {
    this.run += 1;
    this.#request({ kind: "seek", frame, run: this.run, orLast: true });
    this.allow(frames);
  }

  /** Allow more frames to be decoded. */
  allow(frames: number): void {
    this.#request({ kind: "more", frames, run: this.run });
  }

  /** Drop further replies to the last run, and return the number of a run without replies. */
  abandon(): number {
    return ++this.run;
  }

  close(): void {
    this.#decoder.onmessage = this.#decoder.onerror = null;
    this.#decoder.terminate();
  }

  #isWanted(reply: DecodeReply): boolean {
    const run = reply.kind === "frame" ? reply.packet.run : reply.run;
    const isOfStream = reply.kind === "info" || reply.kind === "edge";
    return run === this.run || (isOfStream && run >= this.#runOpened);
  }

  #request(request: DecodeRequest): void {
    this.#decoder.postMessage(request);
  }
}
