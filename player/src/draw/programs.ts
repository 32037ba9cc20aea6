/** Builds WebGL programs; errors include the messages of the driver. */

/** Drawing is impossible on this machine, or the graphics context is lost. */
export class DrawingError extends Error {
  override readonly name = "DrawingError";
}

/** Compile and link a program. */
export function buildProgram(
  gl: WebGL2RenderingContext,
  vertexSource: string,
  fragmentSource: string,
): WebGLProgram {
  const program = gl.createProgram();
  const shaders = [
    compileShader(gl, gl.VERTEX_SHADER, vertexSource),
    compileShader(gl, gl.FRAGMENT_SHADER, fragmentSource),
  ];
  for (const shader of shaders) gl.attachShader(program, shader);
  gl.linkProgram(program);
  for (const shader of shaders) gl.deleteShader(shader);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) {
    throw new DrawingError(`a program does not link: ${gl.getProgramInfoLog(program) ?? ""}`);
  }
  return program;
}

/** Assign texture units 0, 1, 2, ... to the samplers of a program, in the order of `names`. */
export function numberSamplers(
  gl: WebGL2RenderingContext,
  program: WebGLProgram,
  names: readonly string[],
): void {
  gl.useProgram(program);
  names.forEach((name, unit) => gl.uniform1i(gl.getUniformLocation(program, name), unit));
}

function compileShader(gl: WebGL2RenderingContext, shaderType: GLenum, source: string): WebGLShader {
  const shader = gl.createShader(shaderType);
  if (shader === null) throw new DrawingError("the graphics context is lost");
  gl.shaderSource(shader, source);
  gl.compileShader(shader);
  if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS) && !gl.isContextLost()) {
    throw new DrawingError(`a shader does not compile: ${gl.getShaderInfoLog(shader) ?? ""}`);
  }
  return shader;
}
