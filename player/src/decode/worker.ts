/** The code of the decode worker. */

import type { DecodeReply, DecodeRequest } from "../protocol.js";
import { DecodeService } from "./decode-service.js";

/** The members of a worker's global scope that the decode worker uses. */
interface WorkerScope {
  onmessage: (event: MessageEvent<DecodeRequest>) => void;
  postMessage(reply: DecodeReply, transferList: readonly Transferable[]): void;
  close(): void;
}

const scope = self as unknown as WorkerScope;
const service = new DecodeService((reply, transferList) => scope.postMessage(reply, transferList));

scope.onmessage = ({ data }) => {
  service.handle(data);
  if (data.kind === "close") scope.close();
};
