/** Starts the workers. Their code is part of the bundle, so that a page needs only one file. */

import decoderCode from "worker:decode/worker";
import sorterCode from "worker:sort/worker";
import type { DecodeRequest } from "./protocol.js";

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

function startWorker(code: string): Worker {
  const url = urlByCode.get(code) ?? URL.createObjectURL(new Blob([code], { type: "text/javascript" }));
  urlByCode.set(code, url);
  return new Worker(url);
}
