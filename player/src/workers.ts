/** Starts the workers. Their code is part of the bundle, so that a page needs only one file. */

import decoderCode from "worker:decode/worker";
import sorterCode from "worker:sort/worker";
import type { DecodeRequest, PlayerFault } from "./protocol.js";
import { makeFault } from "./stream-error.js";
import { trust } from "./trusted.js";

const urlByCode = new Map<string, string>();

export const makeDecoder = (): Worker => startWorker(decoderCode);
export const makeSorter = (): Worker => startWorker(sorterCode);

/** Send a request to a decode worker. Bytes are transferred; the worker cannot resolve a relative address. */
export function sendRequest(decoder: Worker, request: DecodeRequest): void {
  if (request.kind !== "open") return decoder.postMessage(request);
  const { source } = request;
  if ("bytes" in source) return decoder.postMessage(request, [source.bytes]);
  const link = document.createElement("a"); // leaves an invalid address to the worker, which reports it
  link.href = source.url;
  decoder.postMessage({ ...request, source: { ...source, url: link.href } });
}

/** Describe the error of a decode worker; it has no message if the browser did not start the worker. */
export function describeWorkerError({ message }: ErrorEvent): PlayerFault {
  if (message) return makeFault("player", message);
  return makeFault("limit", "the browser did not start the decoder; a Content-Security-Policy must allow worker-src blob:");
}

function startWorker(code: string): Worker {
  const url = urlByCode.get(code) ?? URL.createObjectURL(new Blob([code], { type: "text/javascript" }));
  urlByCode.set(code, url);
  return new Worker(trust().createScriptURL(url));
}
