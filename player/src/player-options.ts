/** Options of a player. */

export interface PlayerOptions {
  /** Whether mouse, touch and keys on the canvas move the view; true by default. */
  readonly controls?: boolean;
}

export interface OpenOptions {
  /** Ordinal of the frame to show first; by default the first frame of the stream. */
  readonly frame?: number | null;
}
