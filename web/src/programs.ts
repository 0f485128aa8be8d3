/**
 * Programs by key, each made once, without stopping the page where the browser allows that.
 *
 * A long shader may take a browser half a minute, in which it draws nothing, not even the page's own text. So the page
 * first says that it is at work, lets that be painted, and only then begins.
 */

export const HEADER = `#version 300 es
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp sampler3D;
`;

/** What a program is made of. Texts are functions: a known program needs none. */
export interface Source {
  /** Names all that the texts depend on. */
  key: string;
  /** Whose it is, for the user to read. */
  title: string;
  /** Whether the browser may be busy with it for long, by what it holds of a material's text. */
  long: boolean;
  vertex: () => string;
  fragment: () => string;
}

/** Linked program with the locations of its uniforms, looked up once. */
export interface Program {
  handle: WebGLProgram;
  uniform(name: string): WebGLUniformLocation | null;
}

/** Frames between saying that a long program is made and beginning: the browser has painted it by then. */
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
  /** Hears whose programs are being made; nothing any more by an empty list. */
  onMaking: (titles: string[]) => void = () => {};

  constructor(private readonly gl: WebGL2RenderingContext) {
    this.parallel = gl.getExtension("KHR_parallel_shader_compile") as { COMPLETION_STATUS_KHR: number } | null;
  }

  /**
   * Whether programs can be used at once; begins to make those that cannot. To be asked once a frame: a long one is
   * begun when it was asked for in a few.
   */
  ready(sources: Source[]): boolean {
    const missing = sources.filter((source) => !this.linked.has(source.key) && !this.complete(source));
    if (missing.length === 0) {
      // All of them before the first draws: asked later, a browser answers when that is done, and the page stands still.
      for (const source of sources) this.program(source);
      return true;
    }
    const long = missing.filter((source) => source.long);
    if (long.length) this.onMaking([...new Set(long.map((source) => source.title))]);
    for (const source of missing) {
      const frames = (this.announced.get(source.key) ?? 0) + 1;
      this.announced.set(source.key, frames);
      if (!source.long || frames > FRAMES_TO_PAINT) this.start(source);
    }
    return false;
  }

  /** `program`, as soon as it can be used. */
  async made(source: Source): Promise<Program> {
    while (!this.ready([source])) await new Promise((resolve) => requestAnimationFrame(resolve));
    return this.program(source);
  }

  /** The program; waits for the browser where it is not ready yet. */
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

  /** The GPU has drawn with what was made; some drivers compile only then. Others that wait say so again. */
  drawn(): void {
    this.onMaking([]);
  }

  /** Drops those whose key is gone. */
  forget(gone: (key: string) => boolean): void {
    for (const kept of [this.linked, this.started])
      for (const [key, { handle }] of kept)
        if (gone(key)) {
          this.gl.deleteProgram(handle);
          kept.delete(key);
        }
  }

  private start(source: Source): void {
    if (!this.started.has(source.key)) this.started.set(source.key, start(this.gl, source));
  }

  /** Whether what was begun is done, as far as the browser tells. */
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

/** A short program of the page itself, at once. */
export const link = (gl: WebGL2RenderingContext, key: string, vertex: string, fragment: string): Program =>
  finish(gl, start(gl, { key, title: key, long: false, vertex: () => vertex, fragment: () => fragment }));
