/** What buttons, lists, slider and keys do. */

import { ICONS } from "./icons.js";
import { SPEEDS, type ButtonName } from "./layout.js";
import type { Session } from "./session.js";

/** Let people steer a session. */
export function connectControls(session: Session, root: ShadowRoot, signal: AbortSignal): void {
  const { layout, playing, viewer } = session;
  const actions = listActions(session);
  for (const [name, act] of Object.entries(actions)) {
    layout.buttons[name as ButtonName].addEventListener("click", act, { signal });
  }
  layout.slider.addEventListener("input", () => playing.seek(Number(layout.slider.value)), { signal });
  layout.speed.addEventListener("change", () => (playing.speed = Number(layout.speed.value)), { signal });
  const choose = (): void => {
    viewer.lookThrough(Number(layout.camera.value));
    session.refresh();
  };
  layout.camera.addEventListener("change", choose, { signal });
  const press = (event: Event): void => pressKey(event as KeyboardEvent, session, actions);
  root.addEventListener("keydown", press, { signal });
}

/** Have the button for playing say what it does next. */
export function showPlaying(button: HTMLButtonElement, isPlaying: boolean): void {
  const label = isPlaying ? "Pause" : "Play";
  if (button.ariaLabel === label) return; // a press must not lose the icon that it began on
  button.innerHTML = isPlaying ? ICONS.pause : ICONS.play;
  button.ariaLabel = label;
  button.title = `${label} (Space)`;
}

function listActions(session: Session): Readonly<Record<ButtonName, () => void>> {
  const { playing, viewer } = session;
  return {
    play: () => (playing.isPlaying ? playing.pause() : playing.play()),
    back: () => playing.step(-1),
    forward: () => playing.step(1),
    loop: () => {
      playing.isLooping = !playing.isLooping;
      session.refresh();
    },
    flip: () => {
      viewer.flip();
      session.refresh();
    },
    statistics: () => session.toggleStatistics(),
    fullscreen: () => session.toggleFullscreen(),
  };
}

const KEYS: Readonly<Record<string, ButtonName>> = {
  " ": "play",
  k: "play",
  ",": "back",
  ".": "forward",
  l: "loop",
  u: "flip",
  i: "statistics",
  f: "fullscreen",
};

function pressKey(
  event: KeyboardEvent,
  session: Session,
  actions: Readonly<Record<ButtonName, () => void>>,
): void {
  const isModified = event.ctrlKey || event.metaKey || event.altKey;
  const isOnButton = event.target instanceof HTMLButtonElement && [" ", "Enter"].includes(event.key);
  if (isModified || isOnButton || event.target instanceof HTMLSelectElement) return;
  const name = KEYS[event.key.toLowerCase()];
  if (name !== undefined) actions[name]();
  else if (event.key === "<" || event.key === ">") changeSpeed(session, event.key === ">" ? 1 : -1);
  else if (/^[1-9]$/.test(event.key)) session.viewer.lookThrough(Number(event.key) - 1);
  else if (event.key === "0") session.viewer.lookThrough(session.viewer.cameraIndex);
  else return;
  event.preventDefault();
  session.refresh();
}

function changeSpeed(session: Session, by: 1 | -1): void {
  const index = SPEEDS.findIndex((speed) => speed >= session.playing.speed);
  const next = SPEEDS[Math.max(0, index) + by];
  if (next !== undefined) session.playing.speed = next;
}
