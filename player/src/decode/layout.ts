/** Structures of core/capi/include/quarc.h, as laid out in 32-bit memory. */

import type { CaptureCamera, StreamInfo } from "../protocol.js";

/** The fields of `StreamInfo` from HEAD. */
export type Head = Pick<
  StreamInfo,
  | "timescale"
  | "frameTicks"
  | "latticeExponent"
  | "logScaleStep"
  | "opacityStep"
  | "shDcStep"
  | "shRestStep"
  | "shDegree"
  | "upAxis"
  | "isRightHanded"
  | "metersPerUnit"
>;

export function readHead(memory: DataView, place: number): Head {
  const number = (field: number): number => memory.getUint32(place + 4 * field, true);
  const float = (field: number): number => memory.getFloat32(place + 4 * field, true);
  return {
    timescale: number(0),
    frameTicks: number(1),
    latticeExponent: number(3),
    logScaleStep: float(4),
    opacityStep: float(5),
    shDcStep: float(6),
    shRestStep: float(7),
    shDegree: number(8),
    isRightHanded: number(9) === 1,
    upAxis: number(10),
    metersPerUnit: float(11),
  };
}

export function readCamera(memory: DataView, place: number, name: string): CaptureCamera {
  const number = (field: number): number => memory.getUint32(place + 4 * field, true);
  const float = (field: number): number => memory.getFloat32(place + 4 * field, true);
  return {
    name,
    isHeldOut: number(2) === 1,
    width: number(3),
    height: number(4),
    fx: float(5),
    fy: float(6),
    cx: float(7),
    cy: float(8),
    rotation: Array.from({ length: 9 }, (_, at) => float(9 + at)),
    translation: Array.from({ length: 3 }, (_, at) => float(18 + at)),
    near: float(21),
  };
}
