/** Errors for streams that violate a clause (SPEC 3.3), or exceed the limits of this decoder (SPEC 3.2). */

export const REJECT_IDS = [
  "bad-magic",
  "truncated",
  "bad-sync",
  "header-crc",
  "payload-crc",
  "sequence",
  "bad-chunk-type",
  "chunk-order",
  "unknown-critical",
  "chunk-exceeds-level",
  "trailing-data",
  "tail-mismatch",
  "index-mismatch",
  "unsupported-version",
  "unsupported-feature",
  "field",
  "bad-probability",
  "invalid-words",
  "unconsumed-words",
  "symbol-range",
  "count-exceeds-level",
  "count",
  "frame-order",
  "position-range",
  "code-range",
  "rotation-range",
  "degenerate-rotation",
  "parent-range",
  "state-crc",
] as const;

export type RejectId = (typeof REJECT_IDS)[number];

/** The stream is invalid; `rejectId` is a reject id that applies to it. */
export class Rejection extends Error {
  constructor(
    readonly rejectId: RejectId,
    message: string,
  ) {
    super(message);
    this.name = "Rejection";
  }
}

/** The stream is at the unlimited level and exceeds the limits of this decoder; it may be valid. */
export class Declined extends Error {
  constructor(message: string) {
    super(message);
    this.name = "Declined";
  }
}

/** Reject the stream with `rejectId` unless `condition` is true. */
export function demand(condition: boolean, rejectId: RejectId, message: string): asserts condition {
  if (!condition) throw new Rejection(rejectId, message);
}
