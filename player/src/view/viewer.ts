/** The view of the scene: that of a capture camera, or moved away from a camera by the controls. */

import type { Eye, Vector } from "../draw/eye.js";
import type { Stage } from "../draw/stage.js";
import type { CaptureCamera, FramePacket, StreamInfo } from "../protocol.js";
import { findDistance, findUp, makeCamera, samplePositions, type Axis } from "./scene.js";
import { approach, eyeFromPose, flip, move, orbit, scale, poseFromEye, turn, type Pose } from "./pose.js";
import { placeHeadset, type Placement } from "../vr/placement.js";

export class Viewer {
  readonly #stage: Stage;
  readonly #onMoved: () => void;
  #cameras: readonly CaptureCamera[] = [];
  #up: Vector = [0, 1, 0];
  #axis: Axis | null = null;
  #info: StreamInfo | null = null;
  #eye: Eye | null = null;
  #pose: Pose | null = null;
  #cameraIndex = 0;
  #samplePositions: Float32Array | null = null;
  #isMoved = false;
  #showsWholeScene = false; // the stream has no cameras

  constructor(stage: Stage, onMoved: () => void) {
    this.#stage = stage;
    this.#onMoved = onMoved;
  }

  get cameras(): readonly CaptureCamera[] {
    return this.#cameras;
  }

  /** Index of the last selected camera, which is the camera of the view until the view is moved. */
  get cameraIndex(): number {
    return this.#cameraIndex;
  }

  /** Whether the view is that of the selected camera, so that it has not been moved. */
  get isAtCamera(): boolean {
    return !this.#isMoved;
  }

  /** The requested up axis; null means the up axis of the stream. */
  get axis(): Axis | null {
    return this.#axis;
  }

  set axis(axis: Axis | null) {
    this.#axis = axis;
    if (this.#info !== null) this.#up = findUp(this.#info, axis);
  }

  /** Begin a new stream: select the camera `cameraName`, or the first camera if there is no such camera. */
  begin(info: StreamInfo, cameraName: string | null): void {
    this.#info = info;
    this.#cameras = info.cameras;
    this.#showsWholeScene = false;
    this.#up = findUp(info, this.#axis);
    this.#pose = this.#eye = this.#samplePositions = null;
    const namedIndex = info.cameras.findIndex(({ name }) => name === cameraName);
    if (info.cameras.length > 0) this.lookThrough(Math.max(0, namedIndex));
  }

  /** Use cameras that come after the first frame, unless there are none; a view that has been moved stays. */
  update(info: StreamInfo, cameraName: string | null): void {
    const { cameras } = info;
    this.#info = info;
    if (cameras.length === 0 || JSON.stringify(cameras) === JSON.stringify(this.#cameras)) return;
    const selectedName = this.#cameras[this.#cameraIndex]?.name;
    const [sameIndex = 0, namedIndex = 0] = [selectedName, cameraName].map((requested) =>
      cameras.findIndex(({ name }) => name === requested),
    );
    this.#cameras = cameras;
    this.#cameraIndex = sameIndex < 0 ? Math.max(0, namedIndex) : sameIndex;
    this.#showsWholeScene = false;
    this.#up = findUp(info, this.#axis);
    if (!this.#isMoved) this.lookThrough(this.#cameraIndex);
  }

  /** Measure the scene in its first packet; if the stream has no cameras, make a camera that sees the scene. */
  measure(packet: FramePacket, info: StreamInfo): void {
    this.#samplePositions = samplePositions(packet, info);
    if (this.#cameras.length === 0) {
      this.#cameras = [makeCamera(this.#samplePositions, this.#up, info.isRightHanded)];
      this.#showsWholeScene = true;
      this.lookThrough(0);
    } else if (this.#pose !== null && this.#eye !== null) {
      this.#pose = { ...this.#pose, distance: findDistance(eyeFromPose(this.#pose, this.#eye), this.#samplePositions) };
    }
  }

  /** Select a camera by its index; an invalid index changes nothing. */
  lookThrough(index: number): void {
    const camera = this.#cameras[index];
    if (camera === undefined) return;
    this.#cameraIndex = index;
    this.#eye = camera;
    this.#isMoved = false;
    this.#pose = poseFromEye(camera, findDistance(camera, this.#samplePositions));
    this.#updateStage();
  }

  orbit(yaw: number, pitch: number): void {
    this.#changePose((pose) => orbit(pose, this.#up, yaw, pitch));
  }

  turn(yaw: number, pitch: number): void {
    this.#changePose((pose) => turn(pose, this.#up, yaw, pitch));
  }

  /** Move so that the scene at the distance of the pivot follows a pointer by `right` and `down` CSS pixels. */
  pan(right: number, down: number, widthPixels: number): void {
    this.#changePose((pose) => {
      const unitsPerPixel = (pose.distance * (this.#eye?.width ?? 1)) / (this.#eye?.fx ?? 1) / widthPixels;
      return move(pose, -right * unitsPerPixel, -down * unitsPerPixel, 0);
    });
  }

  /** Move right, down and ahead, in units of the distance to the pivot. */
  fly(right: number, down: number, ahead: number): void {
    this.#changePose((pose) => {
      const [x, y, z] = scale([right, down, ahead], pose.distance);
      return move(pose, x, y, z);
    });
  }

  approach(factor: number): void {
    this.#changePose((pose) => approach(pose, factor));
  }

  /** Negate the up vector, and rotate the view by 180 degrees about the line of sight. */
  flip(): void {
    this.#up = scale(this.#up, -1);
    this.#changePose(flip);
  }

  /** Place a headset at the view; null before the first frame. */
  placeHeadset(): Placement | null {
    return this.#pose && placeHeadset(this.#pose, this.#up, this.#info?.metersPerUnit ?? 0);
  }

  /** Pass the view to the stage. The picture of a capture camera keeps its aspect ratio; other views fill the canvas. */
  restore(): void {
    if (this.#pose === null || this.#eye === null) return;
    if (this.#isMoved || this.#showsWholeScene) this.#stage.setView(eyeFromPose(this.#pose, this.#eye), "wide");
    else this.#stage.setView(this.#eye, "picture");
  }

  #changePose(change: (pose: Pose) => Pose): void {
    if (this.#pose === null) return;
    this.#pose = change(this.#pose);
    this.#isMoved = true;
    this.#updateStage();
  }

  #updateStage(): void {
    this.restore();
    this.#onMoved();
  }
}
