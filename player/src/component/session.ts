/** The user interface of the component, from its insertion into a page to its removal. */

import { onScreenResize } from "../draw/screen-size.js";
import { Player } from "../player.js";
import type { PlayerEvents } from "../player-events.js";
import type { FramePacket, PlayerFault, StreamInfo, StreamSource } from "../protocol.js";
import { frameRate } from "../statistics.js";
import { hasHeadset } from "../vr/headset.js";
import { showLive, showPlaying, showSound, showSpeed } from "./button-states.js";
import { describeFault } from "./faults.js";
import { describeLoaded, listStatistics } from "./format.js";
import { createLayout, type Layout } from "./layout.js";
import { Timeline } from "./timeline.js";

const WAITING_DELAY_MS = 400; // before the waiting indicator is shown
const FORWARDED_EVENTS: readonly (keyof PlayerEvents)[] = [
  ...(["info", "preview", "frame", "play", "pause", "ended"] as const),
  ...(["waiting", "progress", "view", "liveedge", "settings", "headset", "audioerror", "error"] as const),
];

export class Session {
  readonly layout: Layout;
  readonly player: Player;
  readonly #host: HTMLElement;
  readonly #timeline: Timeline;
  readonly #abortController = new AbortController();
  #source: StreamSource | null = null;
  #startFrame: number | null = null;
  #refreshRequest = 0;
  #waitingTimer = 0;

  /** Create the user interface in a shadow root. Throws DrawingError if the browser has no WebGL2. */
  constructor(host: HTMLElement, root: ShadowRoot) {
    this.#host = host;
    this.layout = createLayout(root);
    this.#timeline = new Timeline(this.layout.chart);
    const transparent = host.hasAttribute("transparent");
    this.player = new Player(this.layout.canvas, { transparent });
    this.#addListeners();
    const { layout, signal } = this;
    const showHeadsetButton = async (): Promise<void> =>
      void (layout.buttons.headset.hidden = !(await hasHeadset({ transparent })));
    navigator.xr?.addEventListener("devicechange", () => void showHeadsetButton(), { signal });
    void showHeadsetButton();
    layout.buttons.fullscreen.hidden = !document.fullscreenEnabled; // in an iframe without permission, and on phones
    layout.slider.addEventListener("pointermove", (event) => this.#describeFrame(event), { signal });
    onScreenResize(layout.chart, () => this.refresh(), signal);
  }

  /** Aborts when the session is disposed. */
  get signal(): AbortSignal {
    return this.#abortController.signal;
  }

  /** Open a stream at a frame; `poster` is the address of a picture to show until the frame is shown. */
  open(source: StreamSource, poster: string | null = null, frame: number | null = null): void {
    // First: if it throws, the stream that is open stays. The error event shows other errors.
    void this.player.open(source, { frame }).catch(() => undefined);
    // Bytes are transferred to the worker, so only an address can be opened again.
    this.#source = "url" in source ? source : null;
    this.#startFrame = frame;
    this.#timeline.clear();
    this.layout.faultPanel.hidden = true;
    this.layout.poster.hidden = poster === null;
    if (poster !== null) this.layout.poster.src = poster;
    this.#showLoading(0, null);
  }

  toggleStatistics(): void {
    const { statisticsPanel } = this.layout;
    statisticsPanel.hidden = !statisticsPanel.hidden;
    this.refresh();
  }

  toggleFullscreen(): void {
    if (!document.fullscreenEnabled) return;
    const isFullscreen = this.#host.matches(":fullscreen"); // also inside another shadow root
    void (isFullscreen ? document.exitFullscreen() : this.#host.requestFullscreen()).catch(() => undefined);
  }

  /** Enter or leave a headset; the browser tells the user if it cannot be entered. */
  toggleHeadset(): void {
    const { player } = this;
    void (player.isInHeadset ? player.leaveHeadset() : player.enterHeadset()).catch(() => undefined);
  }

  /** Update statistics, timeline and buttons at the next animation frame. */
  refresh(): void {
    if (this.#refreshRequest !== 0) return;
    this.#refreshRequest = requestAnimationFrame(() => {
      this.#refreshRequest = 0;
      this.#update();
    });
  }

  dispose(): void {
    this.player.dispose();
    this.#abortController.abort();
    cancelAnimationFrame(this.#refreshRequest);
    clearTimeout(this.#waitingTimer);
  }

  #addListeners(): void {
    const { player } = this;
    player.onDecoded((packet) => this.#handleDecoded(packet));
    player.addEventListener("info", () => this.#listCameras());
    player.addEventListener("frame", () => this.#hideLoading());
    for (const type of ["frame", "waiting"] as const) player.addEventListener(type, () => this.#restartWaiting());
    const { poster, canvas } = this.layout;
    poster.addEventListener("error", () => (poster.hidden = true));
    canvas.addEventListener("pointerdown", () => (poster.hidden = true)); // the poster does not follow the view
    player.addEventListener("progress", ({ detail }) => this.#showLoading(detail.bytes, detail.byteLength));
    player.addEventListener("error", ({ detail }) => this.#showFault(detail));
    player.addEventListener("audioerror", ({ detail }) => console.warn(detail.message)); // the pictures go on
    for (const type of ["play", "pause"] as const) {
      player.addEventListener(type, () => this.#host.toggleAttribute("playing", player.isPlaying));
    }
    for (const type of FORWARDED_EVENTS) {
      player.addEventListener(type, ({ detail }: CustomEvent<unknown>) => {
        this.refresh();
        this.#host.dispatchEvent(new CustomEvent(type, { detail }));
      });
    }
  }

  #handleDecoded(packet: FramePacket): void {
    if (packet.isPreview) return;
    this.#timeline.add(packet.frame, packet);
    if (this.layout.cameraSelect.options.length < 2) this.#listCameras(); // the viewer has created a camera
    this.refresh();
  }

  /** Hide the waiting indicator until playback has waited for WAITING_DELAY_MS since the last frame. */
  #restartWaiting(): void {
    clearTimeout(this.#waitingTimer);
    this.layout.waitingIndicator.hidden = true;
    if (this.player.isWaiting) this.#waitingTimer = window.setTimeout(() => this.#showWaiting(), WAITING_DELAY_MS);
  }

  /** Show the waiting indicator if playback waits, unless the loading panel or an error is shown. */
  #showWaiting(): void {
    const { waitingIndicator, loadingPanel, faultPanel } = this.layout;
    waitingIndicator.hidden = !(this.player.isWaiting && loadingPanel.hidden && faultPanel.hidden);
  }

  #showFault(fault: PlayerFault): void {
    const { layout } = this;
    const source = this.#source;
    const wasPlaying = this.player.isStoppedByError;
    const canRetry = source !== null && fault.kind === "network";
    const retry = (): void => {
      if (source !== null) this.open(source, null, this.player.targetFrame ?? this.#startFrame);
      if (wasPlaying) this.player.play();
      layout.canvas.focus({ preventScroll: true }); // the button disappears
    };
    layout.loadingPanel.hidden = layout.waitingIndicator.hidden = true;
    layout.faultPanel.replaceChildren(describeFault(fault, canRetry ? retry : null));
    layout.faultPanel.hidden = false;
  }

  #showLoading(bytes: number, byteLength: number | null): void {
    if (this.player.frame !== null || !this.layout.faultPanel.hidden) return;
    const { loadingPanel, loadedText, progress, waitingIndicator } = this.layout;
    loadingPanel.hidden = false;
    waitingIndicator.hidden = true;
    loadedText.textContent = describeLoaded(bytes, byteLength);
    if (byteLength === null) progress.removeAttribute("value");
    else progress.value = bytes / Math.max(1, byteLength);
  }

  #hideLoading(): void {
    this.layout.poster.hidden = true;
    this.layout.loadingPanel.hidden = true;
    this.layout.faultPanel.hidden = true;
  }

  #listCameras(): void {
    const options = this.player.cameras.map(({ name, isHeldOut }) => {
      const option = new Option(isHeldOut ? `${name} (held out)` : name, name);
      option.title = isHeldOut ? "The encoder was not trained on this camera" : "";
      return option;
    });
    const freeView = new Option("free view", "");
    freeView.hidden = true;
    this.layout.cameraSelect.replaceChildren(freeView, ...options);
  }

  #describeFrame(event: PointerEvent): void {
    const { slider } = this.layout;
    const [firstFrame, lastFrame] = [Number(slider.min), Number(slider.max)];
    const fraction = event.offsetX / Math.max(1, slider.clientWidth);
    slider.title = this.#timeline.describe(firstFrame + Math.floor(fraction * (lastFrame - firstFrame + 1)));
  }

  #update(): void {
    const { player, layout } = this;
    const { info } = player;
    const firstFrame = info?.firstFrame ?? 0;
    const shownFrame = player.targetFrame ?? firstFrame;
    const knownEnd = Math.max(player.bufferedTo, (player.liveEdge ?? shownFrame) + 1, shownFrame + 1);
    const endFrame = player.endFrame ?? knownEnd;
    layout.slider.min = String(firstFrame);
    layout.slider.max = String(Math.max(firstFrame, endFrame - 1));
    layout.slider.value = String(shownFrame);
    const frameMs = info === null ? 1 : 1000 / frameRate(info);
    const isLoading = player.frame === null;
    const { bufferedTo } = player;
    this.#timeline.draw({ firstFrame, endFrame: isLoading ? firstFrame : endFrame, shownFrame, bufferedTo, frameMs });
    const timeNodes = isLoading || info === null ? [] : describeTime(shownFrame, player.endFrame, info);
    layout.timeText.replaceChildren(...timeNodes);
    layout.slider.ariaValueText = layout.timeText.textContent;
    layout.cameraSelect.value = player.camera ?? "";
    showSpeed(layout.speedSelect, player.speed);
    layout.buttons.loop.ariaPressed = String(player.loop);
    showPlaying(layout.buttons.play, player.isPlaying);
    const isLive = info?.isLive === true && player.endFrame === null;
    layout.buttons.live.hidden = !isLive;
    layout.buttons.loop.hidden = isLive; // a live stream has no end at which to loop
    showSound(layout.buttons.mute, player);
    showLive(layout.buttons.live, player.latency);
    layout.buttons.statistics.ariaPressed = String(!layout.statisticsPanel.hidden);
    if (!layout.statisticsPanel.hidden) this.#listStatistics();
  }

  #listStatistics(): void {
    const { info, statistics } = this.player;
    if (info === null || statistics === null) return;
    const rows = listStatistics(statistics, info).flatMap(([name, value]) => [
      makeTextElement("dt", name),
      makeTextElement("dd", value),
    ]);
    this.layout.statisticsPanel.replaceChildren(...rows);
  }
}

function describeTime(frame: number, endFrame: number | null, info: StreamInfo): Node[] {
  const seconds = ((frame - info.firstFrame) / frameRate(info)).toFixed(2);
  const totalText = endFrame === null ? "" : ` of ${endFrame - 1}`;
  return [makeTextElement("b", `${seconds} s`), new Text(` · frame ${frame}${totalText}`)];
}

function makeTextElement(tagName: string, text: string): HTMLElement {
  const element = document.createElement(tagName);
  element.textContent = text;
  return element;
}
