/** The decode worker. */

import type { DecodeReply, DecodeRequest } from "../protocol.js";
import { Decoding } from "./decoding.js";

/** The part of a worker's global scope that is used here. */
interface Scope {
  onmessage: (event: MessageEvent<DecodeRequest>) => void;
  postMessage(reply: DecodeReply, transferred: readonly Transferable[]): void;
  close(): void;
}

const scope = self as unknown as Scope;
const decoding = new Decoding((reply, transferred) => scope.postMessage(reply, transferred));

scope.onmessage = ({ data }) => {
  decoding.take(data);
  if (data.kind === "close") scope.close();
};
