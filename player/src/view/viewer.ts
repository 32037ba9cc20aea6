/** Who looks at the scene: at a capture camera's picture, or wherever the controls have led. */

import type { Eye, Vector } from "../draw/eye.js";
import type { Framing, Stage } from "../draw/stage.js";
import type { CaptureCamera, FramePacket, StreamInfo } from "../protocol.js";
import { findDistance, findUp, inventCamera } from "./scene.js";
import { approach, eyeAt, flip, move, orbit, scale, standAt, turn, type Stand } from "./stand.js";

export class Viewer {
  readonly #stage: Stage;
  #cameras: readonly CaptureCamera[] = [];
  #up: Vector = [0, 1, 0];
  #eye: Eye | null = null;
  #stand: Stand | null = null;
  #cameraIndex = 0;
  #framing: Framing = "picture";

  constructor(stage: Stage) {
    this.#stage = stage;
  }

  get cameras(): readonly CaptureCamera[] {
    return this.#cameras;
  }

  /** The camera that is looked through, or was before the controls led away from it. */
  get cameraIndex(): number {
    return this.#cameraIndex;
  }

  /** Whether the picture is a camera's own. */
  get isAtCamera(): boolean {
    return this.#framing === "picture";
  }

  /** Look through a camera of a stream from its start. */
  begin(info: StreamInfo, cameraName: string | null): void {
    this.#cameras = info.cameras;
    this.#up = findUp(info);
    this.#stand = this.#eye = null;
    const named = info.cameras.findIndex(({ name }) => name === cameraName);
    if (info.cameras.length > 0) this.lookThrough(Math.max(0, named));
  }

  /** Find out how far the scene is, from the first of its frames. */
  measure(packet: FramePacket, info: StreamInfo): void {
    if (this.#cameras.length === 0) {
      this.#cameras = [inventCamera(packet, info)];
      this.lookThrough(0, "wide");
    }
    if (this.#stand === null || this.#eye === null) return;
    const distance = findDistance(eyeAt(this.#stand, this.#eye), packet, info);
    this.#stand = { ...this.#stand, distance };
  }

  /** Look through a camera; of one that there is not, nothing changes. */
  lookThrough(index: number, framing: Framing = "picture"): void {
    const camera = this.#cameras[index];
    if (camera === undefined) return;
    this.#cameraIndex = index;
    this.#eye = camera;
    this.#stand = standAt(camera, this.#stand?.distance ?? 2 * camera.near);
    this.#look(framing);
  }

  orbit(across: number, along: number): void {
    this.#go((stand) => orbit(stand, this.#up, across, along));
  }

  turn(across: number, along: number): void {
    this.#go((stand) => turn(stand, this.#up, across, along));
  }

  /** Move so that what is at the point turned about goes so many pixels of the page. */
  pan(right: number, down: number, pixelsAcross: number): void {
    this.#go((stand) => {
      const size = (stand.distance * (this.#eye?.width ?? 1)) / (this.#eye?.fx ?? 1) / pixelsAcross;
      return move(stand, -right * size, -down * size, 0);
    });
  }

  /** Move by shares of the distance to the point turned about. */
  fly(right: number, down: number, ahead: number): void {
    this.#go((stand) => {
      const [x, y, z] = scale([right, down, ahead], stand.distance);
      return move(stand, x, y, z);
    });
  }

  approach(factor: number): void {
    this.#go((stand) => approach(stand, factor));
  }

  /** Take what is down for up. */
  flip(): void {
    this.#up = scale(this.#up, -1);
    this.#go(flip);
  }

  #go(change: (stand: Stand) => Stand): void {
    if (this.#stand === null) return;
    this.#stand = change(this.#stand);
    this.#look("wide");
  }

  #look(framing: Framing): void {
    if (this.#stand === null || this.#eye === null) return;
    this.#framing = framing;
    const isOwn = framing === "picture";
    this.#stage.look(isOwn ? this.#eye : eyeAt(this.#stand, this.#eye), framing);
  }
}
