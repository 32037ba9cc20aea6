/** The decoder, quarc-player.wasm, compressed with gzip and encoded in base64. */
declare module "wasm:quarc" {
  const compressed: string;
  export default compressed;
}
