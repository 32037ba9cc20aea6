/** Checks the chunks came and meta (SPEC 5.6, 5.7); their contents are not used, because no state depends on them. */

import { Fields } from "./fields.js";

export function checkCameras(payload: Uint8Array): void {
  const fields = new Fields(payload);
  const count = fields.u16("count");
  for (let camera = 0; camera < count; camera++) checkCamera(fields);
  fields.finish();
}

export function checkMetadata(payload: Uint8Array): void {
  const fields = new Fields(payload);
  const count = fields.u16("count");
  for (let entry = 0; entry < count; entry++) {
    fields.text8("key");
    fields.text32("value");
  }
  fields.finish();
}

function checkCamera(fields: Fields): void {
  fields.text8("name");
  fields.u8("held_out", 0, 1);
  fields.u32("width", 1);
  fields.u32("height", 1);
  for (const name of ["fx", "fy"]) fields.positiveFloat(name);
  for (const name of ["cx", "cy"]) fields.finiteFloat(name);
  for (let i = 0; i < 9; i++) fields.finiteFloat("rotation");
  for (let i = 0; i < 3; i++) fields.finiteFloat("translation");
  fields.positiveFloat("near");
}
