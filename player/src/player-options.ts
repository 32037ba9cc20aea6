/** Options of a player. */

export interface PlayerOptions {
  /** Whether mouse, touch and keys on the canvas move the view; default true. */
  readonly controls?: boolean;
}

export interface OpenOptions {
  /** Ordinal of the frame to show first; default the first of the stream. */
  readonly frame?: number | null;
}
