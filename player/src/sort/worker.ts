/** The sort worker: keeps the positions of a frame's Gaussians and replies with their order. */

import type { SortReply, SortRequest } from "../protocol.js";
import { Sorter } from "./sorter.js";

/** The part of a worker's global scope that is used here. */
interface Scope {
  onmessage: (event: MessageEvent<SortRequest>) => void;
  postMessage(reply: SortReply, transferred: readonly Transferable[]): void;
}

const scope = self as unknown as Scope;
const sorter = new Sorter();

scope.onmessage = ({ data }) => {
  const begun = performance.now();
  if (data.kind === "frame") sorter.apply(data.packet);
  const order = sorter.sort(data.forward);
  const sortMs = performance.now() - begun;
  scope.postMessage({ token: data.token, order, sortMs }, [order.buffer]);
};
