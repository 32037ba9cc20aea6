/**
 * The functions of core/capi/include/quarc.h that the player calls. `core/wasm/build.sh --player` removes all others
 * from the module.
 */

export interface Functions {
  readonly memory: WebAssembly.Memory;
  quarc_allocate(size: number): number;
  quarc_free(place: number, size: number): void;
  quarc_open_parts(start: number): number;
  quarc_close(place: number): void;
  quarc_put(decoder: number, offset: bigint, bytes: number, length: number): number;
  quarc_limit(decoder: number, size: bigint): number;
  quarc_pull(decoder: number, state: number): number;
  quarc_missing(decoder: number, range: number): number;
  quarc_preview(decoder: number, state: number, sections: number): number;
  quarc_offset(decoder: number, offset: number): number;
  quarc_index(decoder: number, numbers: number, frames: number, room: number): number;
  quarc_head(decoder: number, head: number): number;
  quarc_camera(decoder: number, number: number, camera: number): number;
  quarc_metadata(decoder: number, number: number, entry: number): number;
  quarc_message(decoder: number): number;
  quarc_reject_id(decoder: number): number;
}
