/** Reads the structures of core/capi/include/quarc.h from the module's 32-bit memory. */

import type { CaptureCamera, StreamInfo } from "../protocol.js";

/** The fields of `StreamInfo` that HEAD contains. */
export type HeadFields = Pick<
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

export function readHead(memory: DataView, address: number): HeadFields {
  const readUint = (field: number): number => memory.getUint32(address + 4 * field, true);
  const readFloat = (field: number): number => memory.getFloat32(address + 4 * field, true);
  return {
    timescale: readUint(0),
    frameTicks: readUint(1),
    latticeExponent: readUint(3),
    logScaleStep: readFloat(4),
    opacityStep: readFloat(5),
    shDcStep: readFloat(6),
    shRestStep: readFloat(7),
    shDegree: readUint(8),
    isRightHanded: readUint(9) === 1,
    upAxis: readUint(10),
    metersPerUnit: readFloat(11),
  };
}

export function readCamera(memory: DataView, address: number, name: string): CaptureCamera {
  const readUint = (field: number): number => memory.getUint32(address + 4 * field, true);
  const readFloat = (field: number): number => memory.getFloat32(address + 4 * field, true);
  return {
    name,
    isHeldOut: readUint(2) === 1,
    width: readUint(3),
    height: readUint(4),
    fx: readFloat(5),
    fy: readFloat(6),
    cx: readFloat(7),
    cy: readFloat(8),
    rotation: Array.from({ length: 9 }, (_, index) => readFloat(9 + index)),
    translation: Array.from({ length: 3 }, (_, index) => readFloat(18 + index)),
    near: readFloat(21),
  };
}
