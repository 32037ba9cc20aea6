/** Pointers and keys on the canvas: orbit, pan, look around, zoom, fly. */

import type { Viewer } from "./viewer.js";

const RADIANS_PER_WIDTH = 4;
const WHEEL = 0.001;
const FLIGHT = 0.8; // of the distance to the pivot, per second
const KEY_ANGLE = 0.06;

/** The direction that a key flies in: right, down, ahead. */
const FLIGHTS: Readonly<Record<string, readonly [number, number, number]>> = {
  KeyW: [0, 0, 1],
  KeyS: [0, 0, -1],
  KeyA: [-1, 0, 0],
  KeyD: [1, 0, 0],
  KeyQ: [0, 1, 0],
  KeyE: [0, -1, 0],
};
const TURNS: Readonly<Record<string, readonly [number, number]>> = {
  ArrowLeft: [1, 0],
  ArrowRight: [-1, 0],
  ArrowUp: [0, 1],
  ArrowDown: [0, -1],
};

interface Finger {
  x: number;
  y: number;
}

export class Controls {
  readonly #canvas: HTMLCanvasElement;
  readonly #viewer: Viewer;
  readonly #fingers = new Map<number, Finger>();
  readonly #keys = new Set<string>();
  readonly #ended = new AbortController();
  #flight = 0;
  #flownAt = 0;

  constructor(canvas: HTMLCanvasElement, viewer: Viewer) {
    this.#canvas = canvas;
    this.#viewer = viewer;
    const { signal } = this.#ended;
    canvas.addEventListener("pointerdown", (event) => this.#press(event), { signal });
    canvas.addEventListener("pointermove", (event) => this.#drag(event), { signal });
    for (const kind of ["pointerup", "pointercancel"] as const) {
      canvas.addEventListener(kind, (event) => this.#fingers.delete(event.pointerId), { signal });
    }
    canvas.addEventListener("wheel", (event) => this.#roll(event), { signal, passive: false });
    canvas.addEventListener("contextmenu", (event) => event.preventDefault(), { signal });
    canvas.addEventListener("keydown", (event) => this.#pressKey(event), { signal });
    canvas.addEventListener("keyup", (event) => this.#keys.delete(event.code), { signal });
    canvas.addEventListener("blur", () => this.#keys.clear(), { signal });
  }

  dispose(): void {
    this.#ended.abort();
    cancelAnimationFrame(this.#flight);
  }

  #press(event: PointerEvent): void {
    this.#canvas.focus({ preventScroll: true });
    this.#canvas.setPointerCapture(event.pointerId);
    this.#fingers.set(event.pointerId, { x: event.clientX, y: event.clientY });
  }

  #drag(event: PointerEvent): void {
    const finger = this.#fingers.get(event.pointerId);
    if (finger === undefined) return;
    const [right, down] = [event.clientX - finger.x, event.clientY - finger.y];
    const before = this.#spread();
    this.#fingers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    const width = this.#canvas.clientWidth;
    const angle = RADIANS_PER_WIDTH / width;
    if (this.#fingers.size === 2) {
      this.#viewer.approach(before / Math.max(1, this.#spread()));
      this.#viewer.pan(right / 2, down / 2, width);
    } else if (event.shiftKey || event.buttons === 4) this.#viewer.pan(right, down, width);
    else if (event.buttons === 2) this.#viewer.turn(-right * angle, -down * angle);
    else if (this.#fingers.size === 1) this.#viewer.orbit(right * angle, down * angle);
  }

  /** Distance between two fingers, pixels. */
  #spread(): number {
    const [a, b] = [...this.#fingers.values()];
    return a === undefined || b === undefined ? 1 : Math.max(1, Math.hypot(a.x - b.x, a.y - b.y));
  }

  #roll(event: WheelEvent): void {
    event.preventDefault();
    const pixels = event.deltaMode === WheelEvent.DOM_DELTA_LINE ? 20 * event.deltaY : event.deltaY;
    this.#viewer.approach(Math.exp(pixels * WHEEL));
  }

  #pressKey(event: KeyboardEvent): void {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const turn = TURNS[event.code];
    if (turn !== undefined) {
      if (event.shiftKey) this.#viewer.fly(-KEY_ANGLE * turn[0], -KEY_ANGLE * turn[1], 0);
      else this.#viewer.orbit(KEY_ANGLE * turn[0], KEY_ANGLE * turn[1]);
    } else if (event.key === "+" || event.key === "=") this.#viewer.approach(0.9);
    else if (event.key === "-") this.#viewer.approach(1 / 0.9);
    else if (event.code in FLIGHTS) this.#takeOff(event.code);
    else return;
    event.preventDefault();
    event.stopPropagation();
  }

  #takeOff(key: string): void {
    this.#keys.add(key);
    if (this.#flight !== 0) return;
    this.#flownAt = performance.now();
    this.#flight = requestAnimationFrame((now) => this.#fly(now));
  }

  #fly(now: number): void {
    const way = FLIGHT * Math.min(0.1, Math.max(0, now - this.#flownAt) / 1000);
    this.#flownAt = now;
    for (const key of this.#keys) {
      const [right, down, ahead] = FLIGHTS[key] ?? [0, 0, 0];
      this.#viewer.fly(right * way, down * way, ahead * way);
    }
    const goesOn = this.#keys.size > 0;
    this.#flight = goesOn ? requestAnimationFrame((next) => this.#fly(next)) : 0;
  }
}
