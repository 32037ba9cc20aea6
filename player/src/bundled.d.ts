/** The code of a worker, bundled by the build, as text. */
declare module "worker:*" {
  const code: string;
  export default code;
}
