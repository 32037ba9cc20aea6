/** The user interface of the component, from its insertion into a page to its removal. */

import { Player } from "../player.js";
import type { PlayerEvents } from "../player-events.js";
import type { FramePacket, PlayerFault, StreamInfo, StreamSource } from "../protocol.js";
import { rateOf } from "../statistics.js";
import { connectControls, showLive, showPlaying } from "./buttons.js";
import { describeFault } from "./faults.js";
import { describeLoading, listStatistics } from "./format.js";
import { layOut, type Layout } from "./layout.js";
import { Timeline } from "./timeline.js";

const WAITING_MS = 400; // before the waiting indicator is shown
const FORWARDED: readonly (keyof PlayerEvents)[] = [
  ...(["info", "preview", "frame", "play", "pause", "ended"] as const),
  ...(["waiting", "progress", "view", "liveedge", "error"] as const),
];

export class Session {
  readonly layout: Layout;
  readonly player: Player;
  readonly #host: HTMLElement;
  readonly #timeline: Timeline;
  readonly #ended = new AbortController();
  #source: StreamSource | null = null;
  #start: number | null = null;
  #refreshing = 0;
  #waiting = 0;

  /** Throws DrawingError if the browser has no WebGL2. */
  constructor(host: HTMLElement, root: ShadowRoot) {
    this.#host = host;
    this.layout = layOut(root);
    this.#timeline = new Timeline(this.layout.chart);
    this.player = new Player(this.layout.view);
    this.#listen();
    const { signal } = this.#ended;
    connectControls(this, root, signal);
    const { slider } = this.layout;
    slider.addEventListener("pointermove", (event) => this.#describeFrame(event), { signal });
    const resized = new ResizeObserver(() => this.refresh());
    resized.observe(this.layout.chart);
    signal.addEventListener("abort", () => resized.disconnect());
  }

  /** Open a stream at a frame; until it is shown, show the poster, the address of a picture. */
  open(source: StreamSource, poster: string | null = null, frame: number | null = null): void {
    // Bytes are transferred, so only an address can be opened again.
    this.#source = "url" in source ? source : null;
    this.#start = frame;
    this.#timeline.clear();
    this.layout.fault.hidden = true;
    this.layout.poster.hidden = poster === null;
    if (poster !== null) this.layout.poster.src = poster;
    this.#showLoading(0, null);
    void this.player.open(source, { frame }).catch(() => undefined); // the event shows it
  }

  toggleStatistics(): void {
    const { statistics, buttons } = this.layout;
    statistics.hidden = !statistics.hidden;
    buttons.statistics.ariaPressed = String(!statistics.hidden);
    this.refresh();
  }

  toggleFullscreen(): void {
    const isFull = document.fullscreenElement === this.#host;
    // A page in an iframe may not have the permission; then nothing happens.
    void (isFull ? document.exitFullscreen() : this.#host.requestFullscreen()).catch(() => undefined);
  }

  /** Update figures, timeline and buttons with the next picture. */
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
    clearTimeout(this.#waiting);
    this.player.dispose();
  }

  #listen(): void {
    const { player } = this;
    player.onDecoded((packet) => this.#takeDecoded(packet));
    player.addEventListener("info", () => this.#listCameras());
    player.addEventListener("frame", () => this.#hideLoading());
    const { poster, view } = this.layout;
    poster.addEventListener("error", () => (poster.hidden = true));
    view.addEventListener("pointerdown", () => (poster.hidden = true)); // it does not turn with the view
    player.addEventListener("progress", ({ detail }) => this.#showLoading(detail.bytes, detail.byteLength));
    player.addEventListener("waiting", ({ detail }) => this.#takeWaiting(detail.isWaiting));
    player.addEventListener("error", ({ detail }) => this.#fail(detail));
    for (const type of ["play", "pause"] as const) {
      player.addEventListener(type, () => this.#host.toggleAttribute("playing", player.isPlaying));
    }
    for (const type of FORWARDED) {
      player.addEventListener(type, ({ detail }: CustomEvent<unknown>) => {
        this.refresh();
        this.#host.dispatchEvent(new CustomEvent(type, { detail }));
      });
    }
  }

  #takeDecoded(packet: FramePacket): void {
    if (packet.isPreview) return;
    this.#timeline.add(packet.frame, packet);
    if (this.layout.camera.options.length < 2) this.#listCameras(); // one has been made
    this.refresh();
  }

  #takeWaiting(isWaiting: boolean): void {
    clearTimeout(this.#waiting);
    if (!isWaiting) this.layout.waiting.hidden = true;
    else this.#waiting = window.setTimeout(() => this.#showWaiting(), WAITING_MS);
  }

  /** Show that frames are awaited, unless this is shown already. */
  #showWaiting(): void {
    const { waiting, loading, fault } = this.layout;
    waiting.hidden = !(loading.hidden && fault.hidden);
  }

  #fail(fault: PlayerFault): void {
    const { layout } = this;
    const source = this.#source;
    const canRetry = source !== null && fault.kind === "network";
    const retry = (): void => {
      if (source !== null) this.open(source, null, this.player.frame ?? this.#start);
    };
    layout.loading.hidden = layout.waiting.hidden = true;
    layout.fault.replaceChildren(describeFault(fault, canRetry ? retry : null));
    layout.fault.hidden = false;
  }

  #showLoading(bytes: number, byteLength: number | null): void {
    if (this.player.frame !== null || !this.layout.fault.hidden) return;
    const { loading, loaded, progress } = this.layout;
    loading.hidden = false;
    loaded.textContent = describeLoading(bytes, byteLength);
    if (byteLength === null) progress.removeAttribute("value");
    else progress.value = bytes / byteLength;
  }

  #hideLoading(): void {
    this.layout.poster.hidden = true;
    this.layout.loading.hidden = true;
    this.layout.fault.hidden = true;
  }

  #listCameras(): void {
    const options = this.player.cameras.map(({ name, isHeldOut }) => {
      const option = new Option(isHeldOut ? `${name} (held out)` : name, name);
      option.title = isHeldOut ? "The encoder was not trained on this camera" : "";
      return option;
    });
    const free = new Option("free view", "");
    free.hidden = true;
    this.layout.camera.replaceChildren(free, ...options);
  }

  #describeFrame(event: PointerEvent): void {
    const { slider } = this.layout;
    const [first, last] = [Number(slider.min), Number(slider.max)];
    const share = event.offsetX / Math.max(1, slider.clientWidth);
    slider.title = this.#timeline.describe(first + Math.floor(share * (last - first + 1)));
  }

  #update(): void {
    const { player, layout } = this;
    const { info } = player;
    const first = info?.firstFrame ?? 0;
    const shown = player.targetFrame ?? first;
    const end = player.endFrame ?? Math.max(player.bufferedTo, (player.liveEdge ?? shown) + 1, shown + 1);
    layout.slider.min = String(first);
    layout.slider.max = String(Math.max(first, end - 1));
    layout.slider.value = String(shown);
    const frameMs = info === null ? 1 : 1000 / rateOf(info);
    const isLoading = player.frame === null;
    this.#timeline.draw({ first, end: isLoading ? first : end, shown, bufferedTo: player.bufferedTo, frameMs });
    layout.time.replaceChildren(...(isLoading || info === null ? [] : describeTime(shown, player.endFrame, info)));
    layout.camera.value = player.camera ?? "";
    layout.speed.value = String(player.speed);
    layout.buttons.loop.ariaPressed = String(player.loop);
    showPlaying(layout.buttons.play, player.isPlaying);
    const isLive = info?.isLive === true && player.endFrame === null;
    layout.buttons.live.hidden = !isLive;
    layout.buttons.loop.hidden = isLive; // it has no end at which to loop
    showLive(layout.buttons.live, player.latency);
    if (!layout.statistics.hidden) this.#listStatistics();
  }

  #listStatistics(): void {
    const { info, statistics } = this.player;
    if (info === null || statistics === null) return;
    const rows = listStatistics(statistics, info).flatMap(([name, value]) => [
      makeText("dt", name),
      makeText("dd", value),
    ]);
    this.layout.statistics.replaceChildren(...rows);
  }
}

function describeTime(frame: number, end: number | null, info: StreamInfo): Node[] {
  const seconds = ((frame - info.firstFrame) / rateOf(info)).toFixed(2);
  const last = end === null ? "" : ` of ${end - 1}`;
  return [makeText("b", `${seconds} s`), new Text(` · frame ${frame}${last}`)];
}

function makeText(kind: string, text: string): HTMLElement {
  const element = document.createElement(kind);
  element.textContent = text;
  return element;
}
