/** The code of the sort worker, which stores the positions of a frame's Gaussians and replies with their order. */

import type { SortReply, SortRequest } from "../protocol.js";
import { Sorter } from "./sorter.js";

/** The members of a worker's global scope that the sort worker uses. */
interface WorkerScope {
  onmessage: (event: MessageEvent<SortRequest>) => void;
  postMessage(reply: SortReply, transferred: readonly Transferable[]): void;
}

const scope = self as unknown as WorkerScope;
const sorter = new Sorter();

scope.onmessage = ({ data }) => {
  const startTime = performance.now();
  if (data.kind === "frame") sorter.apply(data.packet);
  const order = sorter.sort(data.forward);
  const sortMs = performance.now() - startTime;
  scope.postMessage({ token: data.token, order, sortMs }, [order.buffer]);
};
