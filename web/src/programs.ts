/**
 * Programs by key, each compiled once, without blocking the page if the browser allows that.
 *
 * A browser may compile a long shader for half a minute without painting. The page therefore first reports the work,
 * lets the report be painted, and then starts.
 */

export const HEADER = `#version 300 es
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp sampler3D;
`;

/** The source of a program. Texts are functions, which a cached program does not call. */
export interface Source {
  /** Identifies everything that the texts depend on. */
  key: string;
  /** The material's title, for messages. */
  title: string;
  /** Whether compiling may take long, by the material's functions that it includes. */
  long: boolean;
  vertex: () => string;
  fragment: () => string;
}

/** Linked program with the locations of its uniforms, looked up once. */
export interface Program {
  handle: WebGLProgram;
  uniform(name: string): WebGLUniformLocation | null;
}

/** Frames between the report of a long compilation and its start: the browser has painted the report by then. */
const FRAMES_TO_PAINT = 3;

interface Started {
  handle: WebGLProgram;
  source: Source;
  stages: WebGLShader[];
}

export class Programs {
  private readonly linked = new Map<string, Program>();
  private readonly started = new Map<string, Started>();
  private announced = new Map<string, number>();
  private readonly parallel: { COMPLETION_STATUS_KHR: number } | null;
  /** Called with the titles of the programs that are being compiled; with an empty list when there are none. */
  onMaking: (titles: string[]) => void = () => {};

  constructor(private readonly gl: WebGL2RenderingContext) {
    this.parallel = gl.getExtension("KHR_parallel_shader_compile") as { COMPLETION_STATUS_KHR: number } | null;
  }

  /**
   * Whether all programs can be used now; starts compiling those that cannot. Called once per frame: a long compilation
   * starts after a few calls.
   */
  ready(sources: Source[]): boolean {
    const missing = sources.filter((source) => !this.linked.has(source.key) && !this.complete(source));
    if (missing.length === 0) {
      // All of them before the first draws: a later query blocks the page until the browser is done.
      for (const source of sources) this.program(source);
      return true;
    }
    const long = missing.filter((source) => source.long);
    if (long.length) this.onMaking([...new Set(long.map((source) => source.title))]);
    const unseen = (this.gl.canvas as HTMLCanvasElement).clientWidth === 0; // nobody waits for the report
    for (const source of missing) {
      const frames = (this.announced.get(source.key) ?? 0) + 1;
      this.announced.set(source.key, frames);
      if (!source.long || unseen || frames > FRAMES_TO_PAINT) this.start(source);
    }
    return false;
  }

  /** Resolves with the program as soon as it can be used. */
  async made(source: Source): Promise<Program> {
    while (!this.ready([source])) await new Promise((resolve) => requestAnimationFrame(resolve));
    return this.program(source);
  }

  /** The program; waits for the browser if it is not ready yet. */
  program(source: Source): Program {
    const known = this.linked.get(source.key);
    if (known) return known;
    this.start(source);
    const program = finish(this.gl, this.started.get(source.key) as Started);
    this.started.delete(source.key);
    this.announced.delete(source.key);
    this.linked.set(source.key, program);
    return program;
  }

  /** Called when the GPU has drawn with new programs; some drivers compile only then. Pending ones report again. */
  drawn(): void {
    this.onMaking([]);
  }

  /** Drops programs whose key is no longer used. */
  forget(gone: (key: string) => boolean): void {
    for (const programs of [this.linked, this.started])
      for (const [key, { handle }] of programs)
        if (gone(key)) {
          this.gl.deleteProgram(handle);
          programs.delete(key);
        }
  }

  private start(source: Source): void {
    if (!this.started.has(source.key)) this.started.set(source.key, start(this.gl, source));
  }

  /** Whether compilation is complete, as far as the browser reports. */
  private complete({ key }: Source): boolean {
    const started = this.started.get(key);
    return started !== undefined && (!this.parallel || this.gl.isContextLost() || Boolean(this.gl.getProgramParameter(started.handle, this.parallel.COMPLETION_STATUS_KHR)));
  }
}

function start(gl: WebGL2RenderingContext, source: Source): Started {
  const handle = gl.createProgram();
  const stages = ([[gl.VERTEX_SHADER, source.vertex], [gl.FRAGMENT_SHADER, source.fragment]] as const).map(([type, text]) => {
    const stage = gl.createShader(type) as WebGLShader;
    gl.shaderSource(stage, text());
    gl.compileShader(stage);
    gl.attachShader(handle, stage);
    return stage;
  });
  gl.linkProgram(handle);
  return { handle, source, stages };
}

function finish(gl: WebGL2RenderingContext, { handle, source, stages }: Started): Program {
  if (!gl.getProgramParameter(handle, gl.LINK_STATUS)) {
    const log = [gl.getProgramInfoLog(handle), ...stages.map((s) => gl.getShaderInfoLog(s))].filter(Boolean).join("\n");
    throw new Error(`The shader ${source.key} does not compile:\n${log}`);
  }
  for (const stage of stages) gl.deleteShader(stage);
  const locations = new Map<string, WebGLUniformLocation | null>();
  return {
    handle,
    uniform(uniform: string) {
      let location = locations.get(uniform);
      if (location === undefined) {
        location = gl.getUniformLocation(handle, uniform);
        locations.set(uniform, location);
      }
      return location;
    },
  };
}

/** A short program of the page itself, compiled at once. */
export const link = (gl: WebGL2RenderingContext, key: string, vertex: string, fragment: string): Program =>
  finish(gl, start(gl, { key, title: key, long: false, vertex: () => vertex, fragment: () => fragment }));
