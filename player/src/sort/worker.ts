/** The sort worker: keeps the places of a frame's Gaussians, and answers with their order. */

import type { Direction, SortReply, SortRequest } from "../protocol.js";
import { Sorter } from "./sorter.js";

/** What a worker has of its page. */
interface Scope {
  onmessage: (event: MessageEvent<SortRequest>) => void;
  postMessage(reply: SortReply, transferred: readonly Transferable[]): void;
  close(): void;
}

const scope = self as unknown as Scope;
const sorter = new Sorter();
let frame = 0;
let run = 0;

scope.onmessage = ({ data }) => {
  if (data.kind === "close") {
    scope.close();
    return;
  }
  const begun = performance.now();
  if (data.kind === "frame") {
    ({ frame, run } = data.packet);
    sorter.apply(data.packet);
  }
  reply(data.forward, begun);
};

function reply(forward: Direction, begun: number): void {
  const order = sorter.sort(forward);
  const sortMs = performance.now() - begun;
  const answer: SortReply = { kind: "order", frame, run, order, forward, sortMs };
  scope.postMessage(answer, [order.buffer]);
}
