/** Entry point of the player: `<quarc-player>` for pages, `Player` for programs, `readFrames` for other renderers. */

import "./workers.js"; // first: the decoder then begins the file, which compresses it by 1.5 KB more
import { QuarcPlayer } from "./component/quarc-player.js";

export type { PixelFormat } from "./draw/picture.js";
export { DrawingError } from "./draw/programs.js";
export { Player } from "./player.js";
export type { OpenOptions, PlayerOptions } from "./player-options.js";
export type { PlayerEvents } from "./player-events.js";
export type * from "./protocol.js";
export type { AudioState } from "./sound.js";
export { Splats } from "./splats.js";
export type { Statistics } from "./statistics.js";
export { StreamError } from "./stream-error.js";
export type { Axis } from "./view/scene.js";
export { hasHeadset } from "./vr/headset.js";
export { readFrames } from "./worker-frames.js";
export type { FramesOptions } from "./decode/frames.js";
export { QuarcPlayer };

if (customElements.get("quarc-player") === undefined) {
  customElements.define("quarc-player", QuarcPlayer);
}
