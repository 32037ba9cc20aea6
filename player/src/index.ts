/** The player: `<quarc-player>`, what programs do with it, and the frames themselves. */

import { QuarcPlayer } from "./component/quarc-player.js";

export type * from "./protocol.js";
export { QuarcPlayer };

if (customElements.get("quarc-player") === undefined) {
  customElements.define("quarc-player", QuarcPlayer);
}
