/** Error messages for the user. */

import type { PlayerFault } from "../protocol.js";

const TITLES: Readonly<Record<PlayerFault["kind"], string>> = {
  rejected: "This stream is damaged",
  empty: "This stream is empty",
  network: "The stream cannot be loaded",
  limit: "This browser cannot play the stream",
  player: "The player has failed",
};

/** Create the panel that shows an error; if `retry` is not null, the panel has a button that calls it. */
export function describeFault(fault: PlayerFault, retry: (() => void) | null): HTMLElement {
  const panel = document.createElement("div");
  const title = document.createElement("h2");
  const text = document.createElement("p");
  title.textContent = TITLES[fault.kind];
  text.textContent = fault.message;
  panel.append(title, text);
  if (fault.rejectId !== null) panel.append(describeRejection(fault.rejectId, fault.frame));
  if (retry !== null) {
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = "Try again";
    button.addEventListener("click", retry);
    panel.append(button);
  }
  return panel;
}

function describeRejection(rejectId: string, frame: number | null): Node {
  const line = document.createElement("p");
  const id = document.createElement("code");
  id.textContent = rejectId;
  line.append("reject id ", id, frame === null ? "" : `, at frame ${frame}`);
  return line;
}
