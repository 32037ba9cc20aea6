/** The promises of a player, which stay pending until their frames are shown. */

import type { PlayerFault, StreamInfo } from "./protocol.js";
import { StreamError } from "./stream-error.js";

interface Deferred<T> {
  resolve: (value: T) => void;
  reject: (error: StreamError) => void;
}

export class PendingPromises {
  #deferredOpen: Deferred<StreamInfo> | null = null;
  #deferredSeeks: Deferred<number>[] = [];

  /** Resolves when the first frame of the stream being opened is shown. */
  waitForOpen(): Promise<StreamInfo> {
    return makePromise((deferred) => (this.#deferredOpen = deferred));
  }

  /** Resolves to the ordinal of the frame that the current seek or step has shown. */
  waitForSeek(): Promise<number> {
    return makePromise((deferred) => this.#deferredSeeks.push(deferred));
  }

  resolveOpen(info: StreamInfo): void {
    this.#deferredOpen?.resolve(info);
    this.#deferredOpen = null;
  }

  resolveSeeks(frame: number): void {
    for (const deferred of this.#deferredSeeks.splice(0)) deferred.resolve(frame);
  }

  rejectAll(fault: PlayerFault): void {
    const allDeferred = [this.#deferredOpen, ...this.#deferredSeeks.splice(0)];
    this.#deferredOpen = null;
    for (const deferred of allDeferred) deferred?.reject(new StreamError(fault));
  }
}

function makePromise<T>(store: (deferred: Deferred<T>) => void): Promise<T> {
  const promise = new Promise<T>((resolve, reject) => store({ resolve, reject }));
  promise.catch(() => undefined); // the error event also reports the error
  return promise;
}
