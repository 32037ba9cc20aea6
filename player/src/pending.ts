/** The promises of a player, which are pending until their frames are shown. */

import type { PlayerFault, StreamInfo } from "./protocol.js";
import { StreamError } from "./stream-error.js";

interface Waiting<T> {
  resolve: (value: T) => void;
  reject: (error: StreamError) => void;
}

export class Pending {
  #opening: Waiting<StreamInfo> | null = null;
  #seeks: Waiting<number>[] = [];

  /** Resolves when the first frame of the stream being opened is shown. */
  open(): Promise<StreamInfo> {
    return promise((waiting) => (this.#opening = waiting));
  }

  /** Resolves when the current seek or step has shown its frame. */
  seek(): Promise<number> {
    return promise((waiting) => this.#seeks.push(waiting));
  }

  resolveOpened(info: StreamInfo): void {
    this.#opening?.resolve(info);
    this.#opening = null;
  }

  resolveSeeks(frame: number): void {
    for (const seek of this.#seeks.splice(0)) seek.resolve(frame);
  }

  reject(fault: PlayerFault): void {
    for (const waiting of [this.#opening, ...this.#seeks.splice(0)]) waiting?.reject(new StreamError(fault));
    this.#opening = null;
  }
}

function promise<T>(keep: (waiting: Waiting<T>) => void): Promise<T> {
  const promised = new Promise<T>((resolve, reject) => keep({ resolve, reject }));
  promised.catch(() => undefined); // the error event reports it, too
  return promised;
}
