/** Inspects pictures for faults twice per state: the first picture at rest, and the complete one. */
import type { Evaluator } from "./evaluator";
import { type Flaw, shines } from "./flaws";
import type { DrawnBall, Renderer, Scene } from "./renderer";
import type { Term } from "./state";
import { cameraFrame } from "./vectors";

/** Terms in which an illuminated ball is never black. */
const LIT: readonly Term[] = ["full", "compensated", "split"];

interface Watched {
  readonly renderer: Renderer;
  readonly evaluator: Evaluator;
  scene(): Scene;
}

export class Inspector {
  flaws: Flaw[] = [];
  private state = 0;
  private looked = 0;

  constructor(
    private readonly app: Watched,
    private readonly report: (flaws: Flaw[]) => void,
  ) {}

  /** Marks the state as changed. The last report remains until the new picture is inspected. */
  changed(): void {
    this.state += 1;
    this.looked = 0;
  }

  /** Whether an inspection of the current picture, complete or not, may differ from the last one. */
  due(done: boolean): boolean {
    return this.looked < (done ? 2 : 1);
  }

  /** Inspects now: the GPU should have drawn the picture. */
  async look(done: boolean): Promise<void> {
    const { app, state } = this;
    const scene = app.scene();
    this.looked = done ? 2 : 1;
    const flaws: Flaw[] = [];
    for (const [index, { broken, covered, largest }] of (app.renderer.inspect(scene) ?? []).entries()) {
      const one = scene.balls[index] as DrawnBall;
      const { slot, ball } = one;
      const dark = covered > 0 && largest === 0 && !scene.mesh && LIT.includes(scene.state.view.term);
      if (broken > 0) flaws.push({ slot, ball, kind: "no number", pixels: broken });
      else if (dark && (await this.scatters(scene, one))) flaws.push({ slot, ball, kind: "black", pixels: covered });
      if (state !== this.state) return;
    }
    this.flaws = flaws;
    this.report(flaws);
  }

  private async scatters(scene: Scene, ball: DrawnBall): Promise<boolean> {
    try {
      return await shines(this.app.evaluator, scene.state, cameraFrame(scene.state.camera), ball);
    } catch {
      return false; // without an evaluator nothing is known
    }
  }
}
