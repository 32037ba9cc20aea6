/** Connects buttons, lists, slider and keys to their actions. */

import { SPEEDS, type ButtonName } from "./layout.js";
import type { Session } from "./session.js";

/** Connect the controls of a session to its player, until the session is disposed. */
export function connectControls(session: Session, root: ShadowRoot): void {
  const { layout, player, signal } = session;
  const actions = listActions(session);
  for (const [name, action] of Object.entries(actions)) {
    layout.buttons[name as ButtonName].addEventListener("click", action, { signal });
  }
  layout.slider.addEventListener("input", () => void player.setFrame(Number(layout.slider.value)), { signal });
  layout.speedSelect.addEventListener("change", () => (player.speed = Number(layout.speedSelect.value)), { signal });
  const selectCamera = (): void => void (player.camera = layout.cameraSelect.value);
  layout.cameraSelect.addEventListener("change", selectCamera, { signal });
  const onKeyDown = (event: Event): void => pressKey(event as KeyboardEvent, session, actions);
  root.addEventListener("keydown", onKeyDown, { signal });
}

function listActions(session: Session): Readonly<Record<ButtonName, () => void>> {
  const { player } = session;
  return {
    play: () => (player.isPlaying ? player.pause() : player.play()),
    back: () => void player.step(-1),
    forward: () => void player.step(1),
    loop: () => (player.loop = !player.loop),
    live: () => {
      void player.seekToLiveEdge();
      player.play();
    },
    mute: () => (player.muted = !player.muted && player.audioState !== "blocked"), // a press ends the blocking
    flip: () => player.flip(),
    statistics: () => session.toggleStatistics(),
    headset: () => session.toggleHeadset(),
    fullscreen: () => session.toggleFullscreen(),
  };
}

const KEYS: Readonly<Record<string, ButtonName>> = {
  " ": "play",
  k: "play",
  ",": "back",
  ".": "forward",
  l: "loop",
  m: "mute",
  u: "flip",
  i: "statistics",
  v: "headset",
  f: "fullscreen",
};

const REPEATED_BUTTONS: readonly ButtonName[] = ["back", "forward"];

function pressKey(
  event: KeyboardEvent,
  session: Session,
  actions: Readonly<Record<ButtonName, () => void>>,
): void {
  const isModified = event.ctrlKey || event.metaKey || event.altKey;
  const button = event.target instanceof HTMLButtonElement ? event.target : null;
  if (isModified || event.target instanceof HTMLSelectElement || (button !== null && event.key === " ")) return;
  const clickedButton = event.key === "Enter" ? button : null;
  const name = clickedButton === null ? KEYS[event.key.toLowerCase()] : (clickedButton.id as ButtonName);
  // A key that is held repeats steps, but no other action of a button.
  if (event.repeat && name !== undefined && !REPEATED_BUTTONS.includes(name)) return event.preventDefault();
  if (clickedButton !== null) return;
  if (name !== undefined) actions[name]();
  else if (event.key === "<" || event.key === ">") changeSpeed(session, event.key === ">" ? 1 : -1);
  else if (/^[1-9]$/.test(event.key)) chooseCamera(session, Number(event.key) - 1);
  else if (event.key === "0") session.player.camera = null;
  else if (event.key === "Home") void session.player.setFrame(session.player.info?.firstFrame ?? 0);
  else if (event.key === "End") void session.player.seekToLiveEdge();
  else return;
  event.preventDefault();
  session.refresh();
}

function chooseCamera(session: Session, index: number): void {
  const camera = session.player.cameras[index];
  if (camera !== undefined) session.player.camera = camera.name;
}

function changeSpeed({ player }: Session, direction: 1 | -1): void {
  const otherSpeeds = SPEEDS.filter((speed) => direction * (speed - player.speed) > 0);
  player.speed = otherSpeeds.at(direction > 0 ? 0 : -1) ?? player.speed;
}
