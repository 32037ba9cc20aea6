/** The promises of a player, which stay pending until their frames are shown. */

import type { PlayerFault, StreamInfo } from "./protocol.js";
import { StreamError } from "./stream-error.js";

interface Deferred<T> {
  resolve: (value: T) => void;
  reject: (error: StreamError) => void;
}

export class PendingPromises {
  readonly #deferredOpens: Deferred<StreamInfo>[] = [];
  readonly #deferredSeeks: Deferred<number | null>[] = [];
  #lastFault: PlayerFault | null = null; // with which all further promises reject

  /** Resolves when the first frame of the stream being opened is shown. */
  waitForOpen(): Promise<StreamInfo> {
    return this.#makePromise(this.#deferredOpens);
  }

  /** Resolves to the ordinal of the frame that the current seek or step has shown, or to null if no stream is open. */
  waitForSeek(): Promise<number | null> {
    return this.#makePromise(this.#deferredSeeks);
  }

  resolveOpen(info: StreamInfo): void {
    for (const deferred of this.#deferredOpens.splice(0)) deferred.resolve(info);
  }

  resolveSeeks(frame: number | null): void {
    for (const deferred of this.#deferredSeeks.splice(0)) deferred.resolve(frame);
  }

  rejectAll(fault: PlayerFault): void {
    const allDeferred = [...this.#deferredOpens.splice(0), ...this.#deferredSeeks.splice(0)];
    for (const deferred of allDeferred) deferred.reject(new StreamError(fault));
  }

  /** Reject all promises, and those of later calls. */
  close(fault: PlayerFault): void {
    this.#lastFault = fault;
    this.rejectAll(fault);
  }

  #makePromise<T>(allDeferred: Deferred<T>[]): Promise<T> {
    const promise = new Promise<T>((resolve, reject) => allDeferred.push({ resolve, reject }));
    promise.catch(() => undefined); // the error event also reports the error
    if (this.#lastFault !== null) this.rejectAll(this.#lastFault);
    return promise;
  }
}
