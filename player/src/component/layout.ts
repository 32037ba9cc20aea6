/** The elements of the component. */

import { ICONS } from "./icons.js";
import { STYLE } from "./style.js";

export const SPEEDS = [0.25, 0.5, 1, 2, 4] as const;

/** Buttons by name: icon, label, and the key with the same action. */
const BUTTONS = {
  play: ["play", "Play", "Space"],
  back: ["back", "One frame back", ","],
  forward: ["forward", "One frame forward", "."],
  loop: ["loop", "Loop", "L"],
  live: ["live", "Jump to the newest frame", "End"],
  flip: ["flip", "Turn upside down", "U"],
  statistics: ["statistics", "Statistics", "I"],
  fullscreen: ["fullscreen", "Full screen", "F"],
} as const;

export type ButtonName = keyof typeof BUTTONS;

export interface Layout {
  readonly view: HTMLCanvasElement;
  readonly poster: HTMLImageElement;
  readonly chart: HTMLCanvasElement;
  readonly slider: HTMLInputElement;
  readonly time: HTMLElement;
  readonly camera: HTMLSelectElement;
  readonly speed: HTMLSelectElement;
  readonly statistics: HTMLElement;
  readonly waiting: HTMLElement;
  readonly loading: HTMLElement;
  readonly loaded: HTMLElement;
  readonly progress: HTMLProgressElement;
  readonly fault: HTMLElement;
  readonly buttons: Readonly<Record<ButtonName, HTMLButtonElement>>;
}

const button = (name: ButtonName): string => {
  const [icon, what, key] = BUTTONS[name];
  const kind = name === "play" ? ' class="main"' : "";
  return `<button type="button" id="${name}"${kind} title="${what} (${key})" aria-label="${what}">${ICONS[icon]}</button>`;
};

const speeds = SPEEDS.map((speed) => `<option value="${speed}">${speed}×</option>`).join("");

const PAGE = `<style>${STYLE}</style>
<div class="frame">
  <div class="picture">
    <canvas class="view" tabindex="0" role="img" aria-label="The scene: drag to orbit, scroll to zoom, W A S D Q E to fly"></canvas>
    <img class="poster" alt="" hidden>
    <dl class="statistics" hidden></dl>
    <div class="waiting" role="status" aria-label="Waiting for frames" hidden></div>
    <div class="loading" role="status" hidden><span>Loading</span><progress></progress></div>
    <div class="fault" role="alert" hidden></div>
  </div>
  <div class="bar">
    <div class="timeline"><canvas></canvas><input type="range" min="0" max="0" value="0" step="1" aria-label="Frame"></div>
    <div class="row">
      ${button("play")}${button("back")}${button("forward")}${button("loop")}${button("live")}
      <span class="time"></span><span class="gap"></span>
      <select id="camera" aria-label="Camera" title="Camera (1 to 9)"></select>
      <select id="speed" aria-label="Speed" title="Speed (&lt; and &gt;)">${speeds}</select>
      ${button("flip")}${button("statistics")}${button("fullscreen")}
    </div>
  </div>
</div>`;

/** Fill a shadow root. */
export function layOut(root: ShadowRoot): Layout {
  root.innerHTML = PAGE;
  const find = <T extends Element>(selector: string): T => root.querySelector(selector) as T;
  const names = Object.keys(BUTTONS) as ButtonName[];
  const buttons = Object.fromEntries(names.map((name) => [name, find(`#${name}`)]));
  return {
    view: find("canvas.view"),
    poster: find(".poster"),
    chart: find(".timeline canvas"),
    slider: find(".timeline input"),
    time: find(".time"),
    camera: find("#camera"),
    speed: find("#speed"),
    statistics: find(".statistics"),
    waiting: find(".waiting"),
    loading: find(".loading"),
    loaded: find(".loading span"),
    progress: find(".loading progress"),
    fault: find(".fault"),
    buttons: buttons as Layout["buttons"],
  };
}
