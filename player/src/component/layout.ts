/** The elements of the component. */

import { trust } from "../trusted.js";
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
  mute: ["sound", "Mute", "M"],
  flip: ["flip", "Turn upside down", "U"],
  statistics: ["statistics", "Statistics", "I"],
  headset: ["headset", "Show in a headset", "V"],
  fullscreen: ["fullscreen", "Full screen", "F"],
} as const;

export type ButtonName = keyof typeof BUTTONS;

export interface Layout {
  readonly canvas: HTMLCanvasElement;
  readonly poster: HTMLImageElement;
  readonly chart: HTMLCanvasElement;
  readonly slider: HTMLInputElement;
  readonly timeText: HTMLElement;
  readonly cameraSelect: HTMLSelectElement;
  readonly speedSelect: HTMLSelectElement;
  readonly statisticsPanel: HTMLElement;
  readonly waitingIndicator: HTMLElement;
  readonly loadingPanel: HTMLElement;
  readonly loadedText: HTMLElement;
  readonly progress: HTMLProgressElement;
  readonly faultPanel: HTMLElement;
  readonly buttons: Readonly<Record<ButtonName, HTMLButtonElement>>;
}

const makeButton = (name: ButtonName): string => {
  const [icon, label, key] = BUTTONS[name];
  const attributes = { play: ' class="main"', headset: " hidden", mute: " hidden" }[name as string] ?? "";
  return `<button type="button" id="${name}"${attributes} title="${label} (${key})" aria-label="${label}">${ICONS[icon]}</button>`;
};

const speedOptions = SPEEDS.map((speed) => `<option value="${speed}">${speed}×</option>`).join("");

const TEMPLATE = `<div class="frame">
  <div class="picture">
    <canvas class="view" tabindex="0" role="img" aria-label="The scene: drag to orbit, scroll to zoom, W A S D Q E to fly"></canvas>
    <img class="poster" alt="" hidden>
    <dl class="statistics" hidden></dl>
    <div class="waiting" role="status" aria-label="Waiting for frames" hidden></div>
    <div class="loading" hidden>
      <span role="status">Loading</span> <span class="amount"></span><progress aria-label="Loading"></progress>
    </div>
    <div class="fault" role="alert" hidden></div>
  </div>
  <div class="bar">
    <div class="timeline"><canvas></canvas><input type="range" min="0" max="0" value="0" step="1" aria-label="Frame"></div>
    <div class="row">
      ${makeButton("play")}${makeButton("back")}${makeButton("forward")}${makeButton("loop")}${makeButton("live")}${makeButton("mute")}
      <span class="time"></span><span class="gap"></span>
      <select id="camera" aria-label="Camera" title="Camera (1 to 9)"></select>
      <select id="speed" aria-label="Speed" title="Speed (&lt; and &gt;)">${speedOptions}</select>
      ${makeButton("flip")}${makeButton("statistics")}${makeButton("headset")}${makeButton("fullscreen")}
    </div>
  </div>
</div>`;

/** Fill a shadow root with the elements of the component, and return them. */
export function createLayout(root: ShadowRoot): Layout {
  root.innerHTML = trust().createHTML(TEMPLATE);
  // Unlike the element `style`, a style sheet needs no permission in the page's Content-Security-Policy.
  const { defaultView } = root.ownerDocument; // the page may have moved the element to another window
  const styleSheet = new (defaultView ?? window).CSSStyleSheet();
  styleSheet.replaceSync(STYLE);
  root.adoptedStyleSheets = [styleSheet];
  const find = <T extends Element>(selector: string): T => root.querySelector(selector) as T;
  const names = Object.keys(BUTTONS) as ButtonName[];
  const buttons = Object.fromEntries(names.map((name) => [name, find(`#${name}`)]));
  return {
    canvas: find("canvas.view"),
    poster: find(".poster"),
    chart: find(".timeline canvas"),
    slider: find(".timeline input"),
    timeText: find(".time"),
    cameraSelect: find("#camera"),
    speedSelect: find("#speed"),
    statisticsPanel: find(".statistics"),
    waitingIndicator: find(".waiting"),
    loadingPanel: find(".loading"),
    loadedText: find(".amount"),
    progress: find(".loading progress"),
    faultPanel: find(".fault"),
    buttons: buttons as Layout["buttons"],
  };
}
