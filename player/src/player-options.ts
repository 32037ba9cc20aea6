/** Options of a player. */

export interface PlayerOptions {
  /** Whether mouse, touch and keys on the canvas move the view; true by default. */
  readonly controls?: boolean;
  /** Whether the page is visible behind the scene, and in augmented reality the room; false by default. */
  readonly transparent?: boolean;
}

export interface OpenOptions {
  /** Ordinal of the frame to show first; by default the first frame of the stream. */
  readonly frame?: number | null;
}
