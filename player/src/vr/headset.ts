/** Shows the scene in a headset (WebXR): the trigger plays and pauses; the left stick moves, the right one turns and lifts. */

import { DrawingError } from "../draw/programs.js";
import type { Stage } from "../draw/stage.js";
import type { PlayerOptions } from "../player-options.js";
import type { Viewer } from "../view/viewer.js";
import { eyeFromView, moveHeadset, turnHeadset, type Placement } from "./placement.js";

const METERS_PER_SECOND = 1.5;
const TURN_ANGLE = Math.PI / 6;
const DEAD_ZONE = 0.15; // deflections of a stick that are ignored
const TURN_DEFLECTION = 0.7; // at which a stick turns the view, once until it is released

const LAYER_OPTIONS: XRWebGLLayerInit = { antialias: false, depth: false, stencil: false };

export interface HeadsetEvents {
  /** The scene appears in the headset, or no longer. */
  onChange(): void;
  onSelect(): void;
}

export class Headset {
  readonly #stage: Stage;
  readonly #viewer: Viewer;
  readonly #isTransparent: boolean;
  readonly #events: HeadsetEvents;
  #session: XRSession | null = null;
  #placement: Placement | null = null;
  #entering: Promise<void> | null = null;
  #leaving: Promise<void> | null = null;
  #isWanted = false; // the scene should be in the headset, or soon
  #isDisposed = false;
  #isTurning = false;
  #frameTime = 0;

  constructor(stage: Stage, viewer: Viewer, isTransparent: boolean, events: HeadsetEvents) {
    this.#stage = stage;
    this.#viewer = viewer;
    this.#isTransparent = isTransparent;
    this.#events = events;
  }

  get isActive(): boolean {
    return this.#placement !== null;
  }

  /** Show the scene in the headset; see `Player.enterHeadset`. */
  enter(): Promise<void> {
    this.#isWanted = !this.#isDisposed;
    this.#entering ??= this.#enter().finally(() => (this.#entering = null));
    return this.#entering;
  }

  /** Return to the page. */
  leave(): Promise<void> {
    this.#isWanted = false;
    this.#leaving ??= this.#leave().finally(() => (this.#leaving = null));
    return this.#leaving;
  }

  /** Place the viewer again, because the scene or the view is another. */
  placeAgain(): void {
    if (this.isActive) this.#placement = this.#viewer.placeHeadset() ?? this.#placement;
  }

  /** Return to the page after the graphics context was lost, because the headset's framebuffer is lost with it. */
  handleContextLost(): void {
    if (this.isActive) void this.leave(); // entering may itself lose and restore the context
  }

  dispose(): void {
    this.#isDisposed = true;
    this.#placement = null; // nothing can be drawn until the session ends
    void this.leave();
  }

  async #leave(): Promise<void> {
    const session = this.#session;
    await session?.end().catch(() => undefined); // it may have ended already
    if (session !== null) this.#handleEnd(session);
  }

  async #enter(): Promise<void> {
    if (this.#leaving !== null) await this.#leaving;
    if (this.isActive) return;
    if (this.#isDisposed) throw new DrawingError("the player was disposed");
    if (navigator.xr === undefined) throw new DrawingError("this browser has no WebXR, which pages have only over https");
    const placement = this.#viewer.placeHeadset();
    if (placement === null) throw new DrawingError("no frame is shown");
    try {
      this.#session = await navigator.xr.requestSession(await chooseMode(this.#isTransparent));
      await this.#start(this.#session, placement);
    } catch (error) {
      await this.leave();
      throw error;
    }
  }

  async #start(session: XRSession, placement: Placement): Promise<void> {
    session.addEventListener("end", () => this.#handleEnd(session));
    session.addEventListener("select", () => this.#events.onSelect());
    const layerOptions = { ...LAYER_OPTIONS, alpha: this.#isTransparent };
    const layer = new XRWebGLLayer(session, await this.#stage.openHeadsetContext(), layerOptions);
    const space = await session.requestReferenceSpace("local");
    if (!this.#isWanted || this.#session !== session) throw new DrawingError("the headset was left");
    await session.updateRenderState({ baseLayer: layer });
    this.#stage.isInHeadset = true;
    this.#placement = this.#viewer.placeHeadset() ?? placement;
    const draw = (time: number, frame: XRFrame): void => {
      session.requestAnimationFrame(draw);
      this.#draw(time, frame, layer, space);
    };
    session.requestAnimationFrame(draw);
    this.#events.onChange();
  }

  #handleEnd(session: XRSession): void {
    if (this.#session !== session) return;
    const wasActive = this.isActive;
    this.#session = this.#placement = null;
    if (this.#isDisposed) return;
    this.#stage.isInHeadset = false;
    this.#viewer.restore();
    if (wasActive) this.#events.onChange();
  }

  #draw(time: number, frame: XRFrame, layer: XRWebGLLayer, space: XRReferenceSpace): void {
    const pose = frame.getViewerPose(space);
    if (!pose || this.#placement === null) return; // the pose is null while the headset has lost its position
    const seconds = Math.min(0.1, (time - this.#frameTime) / 1000);
    this.#frameTime = time;
    for (const source of frame.session.inputSources) this.#steer(source, pose.transform, seconds);
    const placement = this.#placement;
    const pictures = pose.views.flatMap((view) => {
      const viewport = layer.getViewport(view);
      return viewport ? [{ eye: eyeFromView(view, viewport, placement), viewport }] : [];
    });
    this.#stage.paintHeadset(pictures, layer.framebuffer);
  }

  #steer({ gamepad, handedness }: XRInputSource, head: XRRigidTransform, seconds: number): void {
    if (gamepad === undefined || this.#placement === null) return;
    const [x = 0, y = 0] = gamepad.axes.slice(-2).map((value) => (Math.abs(value) < DEAD_ZONE ? 0 : value));
    const meters = METERS_PER_SECOND * seconds;
    if (handedness !== "right") {
      this.#placement = moveHeadset(this.#placement, head, x * meters, 0, -y * meters);
      return;
    }
    this.#placement = moveHeadset(this.#placement, head, 0, -y * meters, 0);
    const isTurning = Math.abs(x) > TURN_DEFLECTION;
    if (isTurning && !this.#isTurning) this.#placement = turnHeadset(this.#placement, head, -Math.sign(x) * TURN_ANGLE);
    if (isTurning || x === 0) this.#isTurning = isTurning;
  }
}

/**
 * Return whether this browser can show scenes in a headset. A transparent player can also be shown in augmented reality, for
 * example by a phone.
 */
export async function hasHeadset({ transparent = false }: Pick<PlayerOptions, "transparent"> = {}): Promise<boolean> {
  return supports(await chooseMode(transparent));
}

/** Return the mode of a session: a transparent scene is shown in the room, if the device can. */
async function chooseMode(transparent: boolean): Promise<XRSessionMode> {
  return transparent && (await supports("immersive-ar")) ? "immersive-ar" : "immersive-vr";
}

async function supports(mode: XRSessionMode): Promise<boolean> {
  // Pages in an iframe need the permission `xr-spatial-tracking`.
  return (await navigator.xr?.isSessionSupported(mode).catch(() => false)) ?? false;
}
