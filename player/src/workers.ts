/** The workers, whose code is part of the bundle, so that a page needs only one file. */

import decoderCode from "worker:decode/worker";
import sorterCode from "worker:sort/worker";

const urls = new Map<string, string>();

export const makeDecoder = (): Worker => start(decoderCode);
export const makeSorter = (): Worker => start(sorterCode);

function start(code: string): Worker {
  const url = urls.get(code) ?? URL.createObjectURL(new Blob([code], { type: "text/javascript" }));
  urls.set(code, url);
  return new Worker(url);
}
