/** One life of the component: from when it is put on a page to when it is taken away. */

import type { Depth } from "../draw/picture.js";
import { NO_FRAME, Stage } from "../draw/stage.js";
import { Playing } from "../playing.js";
import type { FramePacket, PlayerFault, StreamInfo, StreamSource } from "../protocol.js";
import { Controls } from "../view/controls.js";
import { Viewer } from "../view/viewer.js";
import { makeDecoder, makeSorter } from "../workers.js";
import { connectControls, showPlaying } from "./buttons.js";
import { describeFault } from "./faults.js";
import { layOut, type Layout } from "./layout.js";
import { describeLoading, rateOf, Statistics } from "./statistics.js";
import { Timeline } from "./timeline.js";

export class Session {
  readonly layout: Layout;
  readonly playing: Playing;
  readonly viewer: Viewer;
  readonly #host: HTMLElement;
  readonly #stage: Stage;
  readonly #controls: Controls;
  readonly #timeline: Timeline;
  readonly #statistics = new Statistics();
  readonly #ended = new AbortController();
  #refreshing = 0;
  #isMeasured = false;
  #cameraName: string | null = null;

  constructor(host: HTMLElement, root: ShadowRoot) {
    this.#host = host;
    this.layout = layOut(root);
    this.#timeline = new Timeline(this.layout.chart);
    this.#stage = new Stage(this.layout.view, makeSorter(), {
      onShown: (packet, sortMs) => this.#takeShown(packet, sortMs),
      onForgotten: () => this.playing.seek(this.playing.frame ?? 0),
      onFault: (message) => this.fail({ kind: "limit", message, rejectId: null, frame: null }),
    });
    this.viewer = new Viewer(this.#stage);
    this.playing = new Playing(makeDecoder(), this.#stage, {
      onInfo: (info) => this.#takeInfo(info),
      onState: () => this.#takeState(),
      onProgress: (bytes, byteLength) => this.#showLoading(bytes, byteLength),
      onDecoded: (packet) => this.#takeDecoded(packet),
      onError: (fault) => this.fail(fault),
    });
    this.#controls = new Controls(this.layout.view, this.viewer, () => this.refresh());
    connectControls(this, root, this.#ended.signal);
  }

  open(source: StreamSource, cameraName: string | null): void {
    this.#cameraName = cameraName;
    this.#isMeasured = false;
    this.#timeline.clear();
    this.layout.fault.hidden = true;
    this.#showLoading(0, null);
    this.playing.open(source);
  }

  /** Show what is wrong, instead of a page that stands still without a word. */
  fail(fault: PlayerFault): void {
    this.playing.pause();
    this.layout.loading.hidden = true;
    this.layout.fault.replaceChildren(...describeFault(fault));
    this.layout.fault.hidden = false;
    this.#host.dispatchEvent(new CustomEvent("error", { detail: fault }));
  }

  /** Draw a camera's picture apart from the page, of the camera's size. */
  takePicture(cameraIndex: number, depth: Depth): Float32Array | null {
    const camera = this.viewer.cameras[cameraIndex];
    return camera === undefined ? null : this.#stage.takePicture(camera, depth);
  }

  toggleStatistics(): void {
    const { statistics, buttons } = this.layout;
    statistics.hidden = !statistics.hidden;
    buttons.statistics.ariaPressed = String(!statistics.hidden);
    this.refresh();
  }

  toggleFullscreen(): void {
    const isFull = document.fullscreenElement === this.#host;
    // A page in a frame may not be allowed to; then there is nothing to do about it.
    void (isFull ? document.exitFullscreen() : this.#host.requestFullscreen()).catch(() => undefined);
  }

  /** Bring figures, timeline and buttons up to date with the next picture. */
  refresh(): void {
    if (this.#refreshing !== 0) return;
    this.#refreshing = requestAnimationFrame(() => {
      this.#refreshing = 0;
      this.#update();
    });
  }

  dispose(): void {
    this.#ended.abort();
    cancelAnimationFrame(this.#refreshing);
    this.#controls.dispose();
    this.playing.close();
    this.#stage.dispose();
  }

  #takeInfo(info: StreamInfo): void {
    if (!this.#isMeasured) this.viewer.begin(info, this.#cameraName);
    this.#listCameras();
    this.layout.notice.hidden = !info.isLive;
    this.layout.notice.textContent = "Live";
    this.#host.dispatchEvent(new CustomEvent("info", { detail: info }));
    this.refresh();
  }

  #takeDecoded(packet: FramePacket): void {
    this.#timeline.add(packet.frame, packet.bytes, packet.isCanonical);
    const { info } = this.playing;
    if (info !== null && !this.#isMeasured) {
      this.#isMeasured = true;
      this.viewer.measure(packet, info);
      this.#listCameras();
    }
    this.refresh();
  }

  #takeShown(packet: FramePacket, sortMs: number): void {
    if (packet.frame === NO_FRAME) return;
    this.layout.loading.hidden = true;
    this.#statistics.add(packet, sortMs);
    this.playing.shown(packet);
    this.#host.dispatchEvent(new CustomEvent("frame", { detail: { frame: packet.frame } }));
    this.refresh();
  }

  #takeState(): void {
    const { isPlaying } = this.playing;
    if (isPlaying !== this.#host.hasAttribute("playing")) {
      this.#host.toggleAttribute("playing", isPlaying);
      this.#host.dispatchEvent(new Event(isPlaying ? "play" : "pause"));
    }
    this.refresh();
  }

  #showLoading(bytes: number, byteLength: number | null): void {
    if (this.playing.frame !== null || !this.layout.fault.hidden) return;
    const { loading, loaded, progress } = this.layout;
    loading.hidden = false;
    loaded.textContent = describeLoading(bytes, byteLength);
    if (byteLength === null) progress.removeAttribute("value");
    else progress.value = bytes / byteLength;
  }

  #listCameras(): void {
    const options = this.viewer.cameras.map(({ name, isHeldOut }, index) => {
      const option = new Option(isHeldOut ? `${name} (held out)` : name, String(index));
      option.title = isHeldOut ? "The encoder has not seen this camera's pictures" : "";
      return option;
    });
    const free = new Option("free view", "");
    free.hidden = true;
    this.layout.camera.replaceChildren(free, ...options);
  }

  #update(): void {
    const { playing, layout } = this;
    const { info } = playing;
    const shown = playing.frame ?? info?.firstFrame ?? 0;
    const first = info?.firstFrame ?? 0;
    const end = playing.end ?? playing.bufferedTo;
    layout.slider.min = String(first);
    layout.slider.max = String(Math.max(first, end - 1));
    layout.slider.value = String(shown);
    this.#timeline.draw({ first, end, shown, bufferedTo: playing.bufferedTo });
    layout.time.replaceChildren(...describeTime(shown, end, info));
    layout.camera.value = this.viewer.isAtCamera ? String(this.viewer.cameraIndex) : "";
    layout.speed.value = String(playing.speed);
    layout.buttons.loop.ariaPressed = String(playing.isLooping);
    showPlaying(layout.buttons.play, playing.isPlaying);
    if (!layout.statistics.hidden) this.#listFigures();
  }

  #listFigures(): void {
    const { info, frame, bufferedTo } = this.playing;
    if (info === null || frame === null) return;
    const rows = this.#statistics.list(info, bufferedTo - frame - 1);
    this.layout.statistics.replaceChildren(
      ...rows.flatMap(([name, value]) => [makeText("dt", name), makeText("dd", value)]),
    );
  }
}

function describeTime(frame: number, end: number, info: StreamInfo | null): Node[] {
  if (info === null || end <= 0) return [];
  const seconds = (frame / rateOf(info)).toFixed(2);
  return [makeText("b", `${seconds} s`), new Text(` · frame ${frame} of ${end - 1}`)];
}

function makeText(kind: string, text: string): HTMLElement {
  const element = document.createElement(kind);
  element.textContent = text;
  return element;
}
