/** Workers that the build bundles, as text. */
declare module "worker:*" {
  const code: string;
  export default code;
}
