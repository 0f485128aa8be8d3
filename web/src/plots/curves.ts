/** A uPlot in the page's theme: axes titled with units, a legend with the value under the pointer, resized with its box. */
import uPlot from "uplot";
import "uplot/dist/uPlot.min.css";
import type { App } from "../panel";
import { exact, short } from "./base";

export interface Series {
  label: string;
  color: string;
  values: (number | null)[];
  /** Line style of a bound, as opposed to a model. */
  dashed?: boolean;
  width?: number;
  /** The edge of a band: not in the legend. */
  edge?: boolean;
}

export interface Chart {
  x: number[];
  series: Series[];
  xTitle: string;
  yTitle: string;
  log?: boolean;
  /** Bounds of y; computed from the data if null. */
  y?: [number, number] | null;
  xRange: [number, number];
  xTicks?: number;
  /** Labeled vertical lines, such as wo and the mirror direction. */
  marks?: { x: number; label: string }[];
  /** Pairs of series indices (in `series`) to be filled between: error bands. */
  bands?: [number, number, string][];
}

export class Curves {
  private plot: uPlot | null = null;
  private last: Chart | null = null;
  private shape = "";

  constructor(
    private readonly host: HTMLElement,
    private readonly app: App,
  ) {
    host.classList.add("p-curves");
    new ResizeObserver(() => {
      if (this.last) this.show(this.last);
    }).observe(host);
  }

  show(chart: Chart): void {
    this.last = chart;
    const { clientWidth: width, clientHeight: height } = this.host;
    if (width < 40 || height < 40) return;
    // uPlot fixes series and scales at construction: it is rebuilt if those differ, otherwise only its data changes.
    const shape = JSON.stringify([chart.series.map((s) => [s.label, s.color, s.dashed]), chart.xTitle, chart.yTitle, chart.log, chart.xRange, this.app.theme(), width < 480]);
    const data = [chart.x, ...chart.series.map((s) => s.values)] as uPlot.AlignedData;
    if (!this.plot || shape !== this.shape) {
      this.plot?.destroy();
      this.shape = shape;
      this.plot = new uPlot(this.options(chart, width, height), data, this.host);
    } else this.plot.setData(data);
    if (this.plot.width !== width || this.plot.height !== height) this.plot.setSize({ width, height });
  }

  private options(chart: Chart, width: number, height: number): uPlot.Options {
    const text = this.app.cssColor("--text");
    const grid = this.app.cssColor("--line");
    const font = "11px system-ui, sans-serif";
    const axis = { stroke: text, font, labelFont: font, labelSize: 18, grid: { stroke: grid, width: 1 }, ticks: { stroke: grid, size: 4 } };
    return {
      width,
      height,
      padding: [8, 12, 0, 0],
      cursor: { y: false, drag: { x: false, y: false } },
      scales: {
        x: { time: false, range: () => chart.xRange },
        y: { distr: chart.log ? 3 : 1, range: (_, low, high) => this.bounds(low, high) },
      },
      axes: [
        { ...axis, label: chart.xTitle, size: 26, space: width < 480 ? 40 : 50 },
        { ...axis, label: chart.yTitle, size: 48, ...(chart.log ? { splits: (_: uPlot, __: number, low: number, high: number) => decades(low, high) } : {}), values: (_, ticks) => ticks.map((v) => (v === null || v === undefined ? "" : short(v))) },
      ],
      series: [
        { label: chart.xTitle.split(" ")[0] ?? "", value: (_, v) => (v === null ? "" : short(v)) },
        ...chart.series.map((s) => ({
          label: s.label,
          stroke: s.color,
          width: s.width ?? 2,
          dash: s.dashed ? [6, 4] : [],
          points: { show: false },
          pxAlign: 0, // snapping to pixels would put steps into a smooth curve
          class: s.edge ? "p-edge" : "p-series",
          value: (_: uPlot, v: number | null) => (v === null ? "" : exact(Number(v.toPrecision(6)))),
        })),
      ],
      bands: (chart.bands ?? []).map(([a, b, fill]) => ({ series: [a + 1, b + 1] as uPlot.Band.Bounds, fill })),
      legend: { live: true },
      hooks: { draw: [(plot) => this.marks(plot)] },
    };
  }

  private bounds(low: number, high: number): [number, number] {
    const chart = this.last as Chart;
    if (chart.y) return chart.y;
    if (!Number.isFinite(high) || high <= 0) return chart.log ? [1e-3, 1] : [0, 1];
    // Six decades are enough to judge a lobe; smaller values are below float32's precision.
    if (chart.log) return [Math.max(low > 0 ? low : high * 1e-6, high * 1e-6) * 0.8, high * 1.5];
    return [Math.min(0, low), high * (chart.marks?.length ? 1.18 : 1.06)]; // room for the marks' labels
  }

  private marks(plot: uPlot): void {
    const { ctx, bbox } = plot;
    const scale = window.devicePixelRatio || 1;
    ctx.save();
    ctx.strokeStyle = ctx.fillStyle = this.app.cssColor("--text");
    ctx.lineWidth = scale;
    ctx.font = `${11 * scale}px system-ui, sans-serif`;
    (this.last?.marks ?? []).forEach((mark, i) => {
      const x = plot.valToPos(mark.x, "x", true);
      if (x < bbox.left - 1 || x > bbox.left + bbox.width + 1) return;
      ctx.setLineDash([3 * scale, 3 * scale]);
      ctx.beginPath();
      ctx.moveTo(x, bbox.top);
      ctx.lineTo(x, bbox.top + bbox.height);
      ctx.stroke();
      const right = x > bbox.left + 0.8 * bbox.width;
      ctx.textAlign = right ? "right" : "left";
      ctx.fillText(mark.label, x + (right ? -4 : 4) * scale, bbox.top + (11 + 13 * i) * scale);
    });
    ctx.restore();
  }
}

/** Powers of ten, and their 2- and 5-fold multiples if there are few. */
function decades(low: number, high: number): number[] {
  const [from, to] = [Math.floor(Math.log10(low)), Math.ceil(Math.log10(high))];
  const steps = to - from <= 3 ? [1, 2, 5] : [1];
  const all = Array.from({ length: to - from + 1 }, (_, i) => steps.map((s) => s * 10 ** (from + i))).flat();
  return all.filter((v) => v >= low && v <= high);
}
