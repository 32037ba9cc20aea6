/** Shows states of the player on its buttons. */

import type { Player } from "../player.js";
import { trust } from "../trusted.js";
import { ICONS } from "./icons.js";
import { SPEEDS } from "./layout.js";

const LIVE_TOLERANCE_S = 1; // a live stream arrives in pieces, so the picture is always a little behind

/** Show on the play button whether it plays or pauses. */
export function showPlaying(button: HTMLButtonElement, isPlaying: boolean): void {
  if (isPlaying) showAction(button, ICONS.pause, "Pause", "Space");
  else showAction(button, ICONS.play, "Play", "Space");
}

/** Show on the mute button whether there is sound; without audio, the button is hidden. */
export function showSound(button: HTMLButtonElement, { audioState, muted }: Player): void {
  button.hidden = audioState === "none" || audioState === "failed";
  if (muted || audioState === "blocked") showAction(button, ICONS.silence, "Unmute", "M");
  else showAction(button, ICONS.sound, "Mute", "M");
}

function showAction(button: HTMLButtonElement, icon: string, label: string, key: string): void {
  if (button.ariaLabel === label) return; // replacing the icon during a press would lose the click
  button.innerHTML = trust().createHTML(icon);
  button.ariaLabel = label;
  button.title = `${label} (${key})`;
}

/** Show on the live button how many seconds the picture is behind the newest frame, if more than LIVE_TOLERANCE_S. */
export function showLive(button: HTMLButtonElement, latency: number | null): void {
  const isBehind = latency !== null && latency > LIVE_TOLERANCE_S;
  button.ariaPressed = String(latency !== null && !isBehind);
  const label = button.querySelector("span");
  if (label !== null) label.textContent = isBehind ? `Live −${latency.toFixed(1)} s` : "Live";
}

/** Show the speed in the list; the last speed that SPEEDS does not contain is added to the list. */
export function showSpeed(list: HTMLSelectElement, speed: number): void {
  if (list.value === String(speed)) return; // the list may be open
  list.options[SPEEDS.length]?.remove();
  list.value = String(speed);
  if (list.value === "") list.add(new Option(`${Number(speed.toPrecision(3))}×`, String(speed), true, true));
}
