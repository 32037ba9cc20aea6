/** Starts the workers. Their code is part of the bundle, so that a page needs only one file. */

import decoderCode from "worker:decode/worker";
import sorterCode from "worker:sort/worker";

const urlByCode = new Map<string, string>();

export const makeDecoder = (): Worker => startWorker(decoderCode);
export const makeSorter = (): Worker => startWorker(sorterCode);

function startWorker(code: string): Worker {
  const url = urlByCode.get(code) ?? URL.createObjectURL(new Blob([code], { type: "text/javascript" }));
  urlByCode.set(code, url);
  return new Worker(url);
}
