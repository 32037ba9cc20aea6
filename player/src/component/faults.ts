/** What went wrong, in words for people. */

import type { PlayerFault } from "../protocol.js";

const TITLES: Readonly<Record<PlayerFault["kind"], string>> = {
  rejected: "The stream is refused",
  network: "The stream does not come",
  limit: "This is more than the browser can do",
  player: "The player has failed",
};

/** What to put on the panel. */
export function describeFault({ kind, message, rejectId, frame }: PlayerFault): Node[] {
  const panel = document.createElement("div");
  const title = document.createElement("h2");
  const text = document.createElement("p");
  title.textContent = TITLES[kind];
  text.textContent = message;
  panel.append(title, text);
  if (rejectId !== null) panel.append(describeRejection(rejectId, frame));
  return [panel];
}

function describeRejection(rejectId: string, frame: number | null): Node {
  const line = document.createElement("p");
  const id = document.createElement("code");
  id.textContent = rejectId;
  line.append("reject id ", id, frame === null ? "" : `, at frame ${frame}`);
  return line;
}
