/** The events of a player, and their types. */

import type { PlayerFault, StreamInfo } from "./protocol.js";

/** The events of a player; `detail` is passed to listeners. */
export interface PlayerEvents {
  /**
   * The description of the stream is available; sent again when the index has been read, and when a later chunk has
   * changed the cameras or the metadata.
   */
  info: StreamInfo;
  /** The first frame is partly loaded, and a preview of it is on the screen. */
  preview: null;
  /** A frame is on the screen. */
  frame: { readonly frame: number };
  play: null;
  pause: null;
  /** The last frame has been shown, and playback does not loop. */
  ended: null;
  /** Playback has started or stopped waiting for frames. */
  waiting: { readonly isWaiting: boolean };
  /** A live stream has grown: `frame` is the ordinal of its newest frame. */
  liveedge: { readonly frame: number };
  progress: { readonly bytes: number; readonly byteLength: number | null };
  /** The user or the program has changed the view. */
  view: null;
  /** Speed, loop or a property of the sound has changed. */
  settings: null;
  /** The scene is now shown in a headset, or on the canvas again. */
  headset: { readonly isInHeadset: boolean };
  /** The audio file cannot be played; the pictures go on. */
  audioerror: { readonly message: string };
  error: PlayerFault;
}

/** A target whose listeners know the type of `detail`. */
export class PlayerEventTarget extends EventTarget {
  protected dispatch<K extends keyof PlayerEvents>(type: K, detail: PlayerEvents[K]): void {
    this.dispatchEvent(new CustomEvent(type, { detail }));
  }
}

export interface PlayerEventTarget {
  addEventListener<K extends keyof PlayerEvents>(
    type: K,
    listener: (event: CustomEvent<PlayerEvents[K]>) => void,
    options?: boolean | AddEventListenerOptions,
  ): void;
  addEventListener(
    type: string,
    listener: EventListenerOrEventListenerObject | null,
    options?: boolean | AddEventListenerOptions,
  ): void;
  removeEventListener<K extends keyof PlayerEvents>(
    type: K,
    listener: (event: CustomEvent<PlayerEvents[K]>) => void,
    options?: boolean | EventListenerOptions,
  ): void;
  removeEventListener(
    type: string,
    listener: EventListenerOrEventListenerObject | null,
    options?: boolean | EventListenerOptions,
  ): void;
}
