/** Moves the view by pointers and keys on the canvas: orbit, pan, look around, zoom, fly. */

import type { Viewer } from "./viewer.js";

const RADIANS_PER_WIDTH = 4;
const ZOOM_PER_WHEEL_PIXEL = 0.001;
const PIXELS_PER_WHEEL_UNIT = [1, 20, 400]; // by deltaMode: pixels, lines, pages
const FLIGHT_SPEED = 0.8; // distances to the pivot per second
const RADIANS_PER_KEY = 0.06;

/** The direction in which each key flies: right, down, ahead. */
const FLIGHT_KEYS: Readonly<Record<string, readonly [number, number, number]>> = {
  KeyW: [0, 0, 1],
  KeyS: [0, 0, -1],
  KeyA: [-1, 0, 0],
  KeyD: [1, 0, 0],
  KeyQ: [0, 1, 0],
  KeyE: [0, -1, 0],
};
const TURN_KEYS: Readonly<Record<string, readonly [number, number]>> = {
  ArrowLeft: [1, 0],
  ArrowRight: [-1, 0],
  ArrowUp: [0, 1],
  ArrowDown: [0, -1],
};

interface Pointer {
  x: number;
  y: number;
}

export class Controls {
  readonly #canvas: HTMLCanvasElement;
  readonly #viewer: Viewer;
  readonly #pointers = new Map<number, Pointer>();
  readonly #pressedKeys = new Set<string>();
  readonly #abortController = new AbortController();
  #flightRequest = 0;
  #flightTime = 0;

  constructor(canvas: HTMLCanvasElement, viewer: Viewer) {
    this.#canvas = canvas;
    this.#viewer = viewer;
    this.#makeUsable();
    const { signal } = this.#abortController;
    canvas.addEventListener("pointerdown", (event) => this.#handlePointerDown(event), { signal });
    canvas.addEventListener("pointermove", (event) => this.#handlePointerMove(event), { signal });
    for (const kind of ["pointerup", "pointercancel"] as const) {
      canvas.addEventListener(kind, (event) => this.#pointers.delete(event.pointerId), { signal });
    }
    canvas.addEventListener("wheel", (event) => this.#handleWheel(event), { signal, passive: false });
    canvas.addEventListener("contextmenu", (event) => event.preventDefault(), { signal });
    canvas.addEventListener("keydown", (event) => this.#handleKeyDown(event), { signal });
    canvas.addEventListener("keyup", (event) => this.#handleKeyUp(event), { signal });
    canvas.addEventListener("blur", () => this.#pressedKeys.clear(), { signal });
  }

  dispose(): void {
    this.#abortController.abort();
    cancelAnimationFrame(this.#flightRequest);
  }

  /** Let the canvas receive keys, and touches with which the browser would otherwise scroll the page. */
  #makeUsable(): void {
    const canvas = this.#canvas;
    const { touchAction } = canvas.style;
    const isFocusable = canvas.hasAttribute("tabindex");
    canvas.style.touchAction = "none";
    if (!isFocusable) canvas.tabIndex = 0;
    this.#abortController.signal.addEventListener("abort", () => {
      canvas.style.touchAction = touchAction;
      if (!isFocusable) canvas.removeAttribute("tabindex");
    });
  }

  #handlePointerDown(event: PointerEvent): void {
    this.#canvas.focus({ preventScroll: true });
    this.#canvas.setPointerCapture(event.pointerId);
    this.#pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
  }

  #handlePointerMove(event: PointerEvent): void {
    const pointer = this.#pointers.get(event.pointerId);
    if (pointer === undefined) return;
    const [right, down] = [event.clientX - pointer.x, event.clientY - pointer.y];
    const previousDistance = this.#pointerDistance();
    this.#pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    const width = this.#canvas.clientWidth;
    const angle = RADIANS_PER_WIDTH / width;
    if (this.#pointers.size === 2) {
      this.#viewer.approach(previousDistance / Math.max(1, this.#pointerDistance()));
      this.#viewer.pan(right / 2, down / 2, width);
    } else if (event.shiftKey || event.buttons === 4) this.#viewer.pan(right, down, width);
    else if (event.buttons === 2) this.#viewer.turn(-right * angle, -down * angle);
    else if (this.#pointers.size === 1) this.#viewer.orbit(right * angle, down * angle);
  }

  /** Distance between two pointers, CSS pixels; 1 if there are fewer than two. */
  #pointerDistance(): number {
    const [a, b] = [...this.#pointers.values()];
    return a === undefined || b === undefined ? 1 : Math.max(1, Math.hypot(a.x - b.x, a.y - b.y));
  }

  #handleWheel(event: WheelEvent): void {
    event.preventDefault();
    const pixels = (PIXELS_PER_WHEEL_UNIT[event.deltaMode] ?? 1) * event.deltaY;
    this.#viewer.approach(Math.exp(pixels * ZOOM_PER_WHEEL_PIXEL));
  }

  #handleKeyDown(event: KeyboardEvent): void {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const turn = TURN_KEYS[event.code];
    if (turn !== undefined) {
      if (event.shiftKey) this.#viewer.fly(-RADIANS_PER_KEY * turn[0], -RADIANS_PER_KEY * turn[1], 0);
      else this.#viewer.orbit(RADIANS_PER_KEY * turn[0], RADIANS_PER_KEY * turn[1]);
    } else if (event.key === "+" || event.key === "=") this.#viewer.approach(0.9);
    else if (event.key === "-") this.#viewer.approach(1 / 0.9);
    else if (event.code in FLIGHT_KEYS) this.#startFlight(event.code);
    else return;
    event.preventDefault();
    event.stopPropagation();
  }

  /** While the key Meta is pressed, macOS does not tell that other keys are released. */
  #handleKeyUp({ key, code }: KeyboardEvent): void {
    if (key === "Meta") this.#pressedKeys.clear();
    else this.#pressedKeys.delete(code);
  }

  #startFlight(key: string): void {
    this.#pressedKeys.add(key);
    if (this.#flightRequest !== 0) return;
    this.#flightTime = performance.now();
    this.#flightRequest = requestAnimationFrame((now) => this.#fly(now));
  }

  #fly(now: number): void {
    const distance = FLIGHT_SPEED * Math.min(0.1, Math.max(0, now - this.#flightTime) / 1000);
    this.#flightTime = now;
    for (const key of this.#pressedKeys) {
      const [right, down, ahead] = FLIGHT_KEYS[key] ?? [0, 0, 0];
      this.#viewer.fly(right * distance, down * distance, ahead * distance);
    }
    const isFlying = this.#pressedKeys.size > 0;
    this.#flightRequest = isFlying ? requestAnimationFrame((next) => this.#fly(next)) : 0;
  }
}
