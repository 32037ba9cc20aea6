/** The view of the scene: from a capture camera, or as moved by the controls. */

import type { Eye, Vector } from "../draw/eye.js";
import type { Stage } from "../draw/stage.js";
import type { CaptureCamera, FramePacket, StreamInfo } from "../protocol.js";
import { findDistance, findUp, makeCamera, samplePlaces, type Axis } from "./scene.js";
import { approach, eyeAt, flip, move, orbit, scale, standAt, turn, type Stand } from "./stand.js";

export class Viewer {
  readonly #stage: Stage;
  readonly #onMoved: () => void;
  #cameras: readonly CaptureCamera[] = [];
  #up: Vector = [0, 1, 0];
  #axis: Axis | null = null;
  #info: StreamInfo | null = null;
  #eye: Eye | null = null;
  #stand: Stand | null = null;
  #cameraIndex = 0;
  #places: Float32Array | null = null;
  #isMoved = false;
  #isWhole = false; // the camera was made here to see the whole scene

  constructor(stage: Stage, onMoved: () => void) {
    this.#stage = stage;
    this.#onMoved = onMoved;
  }

  get cameras(): readonly CaptureCamera[] {
    return this.#cameras;
  }

  /** Index of the camera of the view, or of the one from which the view was moved away. */
  get cameraIndex(): number {
    return this.#cameraIndex;
  }

  /** Whether the view is that of a camera and has not been moved. */
  get isAtCamera(): boolean {
    return !this.#isMoved;
  }

  /** The axis that points up; null for the one of the stream. */
  get axis(): Axis | null {
    return this.#axis;
  }

  set axis(axis: Axis | null) {
    this.#axis = axis;
    if (this.#info !== null) this.#up = findUp(this.#info, axis);
  }

  /** Look through a camera of a new stream: the named one, or else the first. */
  begin(info: StreamInfo, cameraName: string | null): void {
    this.#info = info;
    this.#cameras = info.cameras;
    this.#isWhole = false;
    this.#up = findUp(info, this.#axis);
    this.#stand = this.#eye = this.#places = null;
    const named = info.cameras.findIndex(({ name }) => name === cameraName);
    if (info.cameras.length > 0) this.lookThrough(Math.max(0, named));
  }

  /** Measure the scene in its first packet; without capture cameras, make one that sees it. */
  measure(packet: FramePacket, info: StreamInfo): void {
    this.#places = samplePlaces(packet, info);
    if (this.#cameras.length === 0) {
      this.#cameras = [makeCamera(this.#places, this.#up, info.isRightHanded)];
      this.#isWhole = true;
      this.lookThrough(0);
    } else if (this.#stand !== null && this.#eye !== null) {
      this.#stand = { ...this.#stand, distance: findDistance(eyeAt(this.#stand, this.#eye), this.#places) };
    }
  }

  /** Look through a camera by its index; an invalid index changes nothing. */
  lookThrough(index: number): void {
    const camera = this.#cameras[index];
    if (camera === undefined) return;
    this.#cameraIndex = index;
    this.#eye = camera;
    this.#isMoved = false;
    this.#stand = standAt(camera, findDistance(camera, this.#places));
    this.#look();
  }

  orbit(across: number, along: number): void {
    this.#go((stand) => orbit(stand, this.#up, across, along));
  }

  turn(across: number, along: number): void {
    this.#go((stand) => turn(stand, this.#up, across, along));
  }

  /** Move so that the pivot follows a pointer, by a number of CSS pixels. */
  pan(right: number, down: number, pixelsAcross: number): void {
    this.#go((stand) => {
      const size = (stand.distance * (this.#eye?.width ?? 1)) / (this.#eye?.fx ?? 1) / pixelsAcross;
      return move(stand, -right * size, -down * size, 0);
    });
  }

  /** Move by fractions of the distance to the pivot. */
  fly(right: number, down: number, ahead: number): void {
    this.#go((stand) => {
      const [x, y, z] = scale([right, down, ahead], stand.distance);
      return move(stand, x, y, z);
    });
  }

  approach(factor: number): void {
    this.#go((stand) => approach(stand, factor));
  }

  /** Negate the up vector, and turn the view with it. */
  flip(): void {
    this.#up = scale(this.#up, -1);
    this.#go(flip);
  }

  #go(change: (stand: Stand) => Stand): void {
    if (this.#stand === null) return;
    this.#stand = change(this.#stand);
    this.#isMoved = true;
    this.#look();
  }

  /** A camera's own picture keeps its proportions; any other view fills the canvas. */
  #look(): void {
    if (this.#stand === null || this.#eye === null) return;
    if (this.#isMoved || this.#isWhole) this.#stage.look(eyeAt(this.#stand, this.#eye), "wide");
    else this.#stage.look(this.#eye, "picture");
    this.#onMoved();
  }
}
