/** The decoder, quarc.wasm: gzip in base64. */
declare module "wasm:quarc" {
  const compressed: string;
  export default compressed;
}
