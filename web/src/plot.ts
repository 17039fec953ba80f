import { scaleLinear, scaleLog } from "d3-scale";
import { line, symbol, symbolCircle, symbolDiamond, symbolSquare, symbolTriangle } from "d3-shape";
import { LitElement, html, nothing, svg } from "lit";
import type { TemplateResult } from "lit";
import { customElement, property, state } from "lit/decorators.js";
import { save_text, standalone_svg } from "./files.ts";
import { quantity } from "./format.ts";
import { box_along, fitting, words_above } from "./plot_labels.ts";
import type { Box, Drawn } from "./plot_labels.ts";
import { csv_of, domain_of, table_of } from "./plot_spec.ts";
import type { Axis, Mark, PlotSpec, Series } from "./plot_spec.ts";
import { kPlotStyles } from "./plot_styles.ts";
import { kBaseStyles } from "./shared_styles.ts";

const kMargin_rem = { top: 2.1, right: 1.1, bottom: 3.1, left: 3.6 };
const kLetter_rem = 0.8; // as in plot_styles.ts
const kName_rem = 0.85;
const kRow_rem = 1.15; // of words above the plot
const kSymbol_px = 12; // stand within the plot's edges
const kShapes = [symbolCircle, symbolSquare, symbolTriangle, symbolDiamond];
const kShortMinus = "\u2212";

type Scale = ((value: number) => number) & { ticks: (count: number) => number[] };

/// A plot with its legend, its table and its files.
@customElement("fstop-plot")
export class Plot extends LitElement {
  @property({ attribute: false }) spec: PlotSpec | undefined;
  @state() private width_ = 640;
  private readonly observer_ = new ResizeObserver(([entry]) => {
    if (entry) this.width_ = Math.max(Math.floor(entry.contentRect.width), 240);
  });

  static override styles = [kBaseStyles, kPlotStyles];

  override connectedCallback(): void {
    super.connectedCallback();
    this.observer_.observe(this);
  }

  override disconnectedCallback(): void {
    super.disconnectedCallback();
    this.observer_.disconnect();
  }

  override render(): TemplateResult | typeof nothing {
    const { spec } = this;
    if (spec === undefined) return nothing;
    return html`<figure>
      <figcaption>${spec.title}</figcaption>
      <ul class="legend">
        ${spec.series.map((one, i) => html`<li>${sample(one, i)} ${one.name}</li>`)}
      </ul>
      ${this.drawing_(spec)}
      <div class="files">
        <button type="button" @click=${() => this.save_drawing_(spec)}>SVG</button>
        <button
          type="button"
          @click=${() => save_text(`${spec.file}.csv`, "text/csv", csv_of(table_of(spec)))}
        >
          CSV
        </button>
        ${table(spec)}
      </div>
    </figure>`;
  }

  private drawing_(spec: PlotSpec): TemplateResult {
    // Letters are as large as the page's, and so are the margins that hold them.
    const rem = Number.parseFloat(getComputedStyle(document.documentElement).fontSize);
    const frame = frame_of(spec, Math.min(this.width_, 60 * rem), rem);
    const { width, height, room } = frame;
    const { x, y } = scales(spec, room);
    const ruler = ruler_of(getComputedStyle(this).fontFamily, rem);
    const choices = tick_choices(spec.x, x, width < 420 ? 4 : 8);
    const x_ticks = fitting(choices, x, (tick) => ruler(tick_text(tick), kLetter_rem));
    const [y_ticks = []] = tick_choices(spec.y, y, 6);
    const name_x = Math.min(
      (room.left + room.right) / 2,
      width - ruler(spec.x.caption, kName_rem) / 2,
    );
    return html`<svg
      class="plot"
      width=${width}
      height=${height}
      viewBox="0 0 ${width} ${height}"
      role="img"
      aria-label="${spec.title}. The table below has its numbers."
    >
      ${x_ticks.map(
        (tick) => svg`<line class="grid" x1=${x(tick)} x2=${x(tick)} y1=${room.top} y2=${room.bottom} />
          <text x=${x(tick)} y=${room.bottom + 1.15 * rem} text-anchor="middle">${tick_text(tick)}</text>`,
      )}
      ${y_ticks.map(
        (tick) => svg`<line class="grid" x1=${room.left} x2=${room.right} y1=${y(tick)} y2=${y(tick)} />
          <text x=${room.left - 6} y=${y(tick) + 0.28 * rem} text-anchor="end">${tick_text(tick)}</text>`,
      )}
      <text class="name" x=${name_x} y=${height - 6} text-anchor="middle">${spec.x.caption}</text>
      <text class="name" x="0" y=${rem}>${spec.y.caption}</text>
      ${marks_of(spec, frame, { x, y }, { rem, ruler })}
      ${spec.series.map((one, i) => series_shape(one, i, x, y, spec))}
    </svg>`;
  }

  private save_drawing_({ file }: PlotSpec): void {
    const drawing = this.renderRoot.querySelector<SVGSVGElement>("svg.plot");
    if (drawing) save_text(`${file}.svg`, "image/svg+xml", standalone_svg(drawing));
  }
}

/// The width of a text in letters of so many rem.
type Ruler = (text: string, letter_rem: number) => number;

function ruler_of(font_family: string, rem: number): Ruler {
  const context = new OffscreenCanvas(1, 1).getContext("2d");
  return (text, letter_rem) => {
    if (context === null) return 0;
    context.font = `${letter_rem * rem}px ${font_family}`;
    return context.measureText(text).width;
  };
}

interface Frame {
  width: number;
  height: number;
  room: Box; // within the axes
}

function frame_of(spec: PlotSpec, width: number, rem: number): Frame {
  const { top, right, bottom, left } = kMargin_rem;
  const rows = kRow_rem * spec.marks.filter(({ axis }) => axis === "x").length;
  const tall = Math.min(Math.max(0.5 * width, 15 * rem), 25 * rem) + rows * rem;
  const height = Math.round(tall);
  const room = {
    left: left * rem,
    top: (top + rows) * rem,
    right: width - right * rem,
    bottom: height - bottom * rem,
  };
  return { width, height, room };
}

function scales(spec: PlotSpec, room: Box): { x: Scale; y: Scale } {
  const points = spec.series.flatMap((one) => one.points);
  const of = (axis: "x" | "y"): number[] =>
    spec.marks.filter((mark) => mark.axis === axis).map(({ at }) => at);
  const inset = spec.series.some(({ kind }) => kind !== "line") ? kSymbol_px : 0;
  return {
    x: scale(spec.x, [...points.map(([at]) => at), ...of("x")], [room.left + inset, room.right - inset]),
    y: scale(spec.y, [...points.map(([, at]) => at), ...of("y")], [room.bottom - inset, room.top + inset]),
  };
}

function scale(axis: Axis, values: readonly number[], range: [number, number]): Scale {
  const domain = domain_of(axis, values);
  return axis.scale === "log"
    ? scaleLog(domain, range).clamp(true)
    : scaleLinear(domain, range).nice();
}

/// Lines across the plot: those at an x have their words above it, those at a y along the line.
function marks_of(
  spec: PlotSpec,
  { width, room }: Frame,
  { x, y }: { x: Scale; y: Scale },
  { rem, ruler }: { rem: number; ruler: Ruler },
) {
  const size = ({ caption }: Mark) => ({
    width: ruler(caption, kLetter_rem),
    height: kLetter_rem * rem,
  });
  const across = spec.marks.filter(({ axis }) => axis === "y");
  const upright = spec.marks.filter(({ axis }) => axis === "x");
  const above = words_above(
    upright.map((mark) => ({ x: x(mark.at), width: size(mark).width })),
    { left: 0, right: width },
  );
  const lines: Drawn[] = [
    ...spec.series.flatMap((one) => drawn(one, x, y, spec)),
    ...upright.map(({ at }): Drawn => [[x(at), room.top], [x(at), room.bottom]]),
  ];
  const boxes: Box[] = [];
  return [
    upright.map((mark, i) => {
      const { row, left } = above[i] ?? { row: 0, left: x(mark.at) };
      const top = (kMargin_rem.top - 0.4 + kRow_rem * row) * rem;
      return svg`<line class="mark" x1=${x(mark.at)} x2=${x(mark.at)} y1=${top} y2=${room.bottom} />
        <text class="mark" x=${left} y=${top + kLetter_rem * rem}>${mark.caption}</text>`;
    }),
    across.map((mark) => {
      const others = across.filter((other) => other !== mark);
      const beside = others.map(({ at }): Drawn => [[room.left, y(at)], [room.right, y(at)]]);
      const box = box_along(y(mark.at), size(mark), room, { boxes, lines: [...lines, ...beside] });
      boxes.push(box);
      return svg`<line class="mark" x1=${room.left} x2=${room.right} y1=${y(mark.at)} y2=${y(mark.at)} />
        <text class="mark" x=${(box.left + box.right) / 2} y=${box.bottom - 0.12 * rem}
          text-anchor="middle">${mark.caption}</text>`;
    }),
  ];
}

/// What a series covers, in pixels.
function drawn(one: Series, x: Scale, y: Scale, spec: PlotSpec): Drawn[] {
  const places = one.points
    .filter((point) => is_shown(point, spec))
    .map(([at, value]): [number, number] => [x(at), y(value)]);
  return one.kind === "line" ? [places] : places.map((place) => [place]);
}

function is_shown([, value]: readonly [number, number], { y }: PlotSpec): boolean {
  return Number.isFinite(value) && (y.scale === "linear" || value > 0);
}

/// On logarithmic axes 1, 2 and 5 of a decade, or its beginning alone where decades are many.
function tick_choices(axis: Axis, to: Scale, count: number): number[][] {
  const ticks = to.ticks(count);
  if (axis.scale === "linear") return [ticks];
  const leading = (tick: number): number => Math.round(tick / 10 ** Math.floor(Math.log10(tick) + 1e-9));
  const few = ticks.filter((tick) => [1, 2, 5].includes(leading(tick)));
  const ones = ticks.filter((tick) => leading(tick) === 1);
  if (few.length > 2 * count) return [ones];
  return ones.length > 1 ? [few, ones] : [few];
}

function tick_text(value: number): string {
  const small = value !== 0 && Math.abs(value) < 1e-3;
  const text = small ? value.toExponential(0) : String(Number(value.toPrecision(4)));
  return text.replace("-", kShortMinus);
}

function series_shape(one: Series, i: number, x: Scale, y: Scale, spec: PlotSpec) {
  const shown = (point: readonly [number, number]): boolean => is_shown(point, spec);
  if (one.kind === "line") {
    const path = line<readonly [number, number]>()
      .defined(shown)
      .x(([at]) => x(at))
      .y(([, value]) => y(value));
    return svg`<path class="line s${i % 7}" data-series=${one.name} d=${path([...one.points]) ?? ""} />`;
  }
  return one.points.filter(shown).map(
    ([at, value]) => svg`<path class="${one.kind} s${i % 7}" data-series=${one.name}
      transform="translate(${x(at)} ${y(value)})" d=${shape(one, i)}>
      <title>${one.name}: ${quantity(at)}, ${quantity(value)}</title></path>`,
  );
}

function shape(one: Series, i: number): string {
  const form = kShapes[i % kShapes.length] ?? symbolCircle;
  return symbol(one.kind === "rings" ? symbolCircle : form, one.kind === "rings" ? 190 : 52)() ?? "";
}

function sample(one: Series, i: number): TemplateResult {
  return html`<svg width="26" height="16" aria-hidden="true">
    ${
      one.kind === "line"
        ? svg`<path class="line s${i % 7}" d="M1 8H25" />`
        : svg`<path class="${one.kind} s${i % 7}" transform="translate(13 8) scale(0.8)" d=${shape(one, i)} />`
    }
  </svg>`;
}

function table(spec: PlotSpec): TemplateResult {
  const { columns, rows } = table_of(spec);
  return html`<details>
    <summary>Table</summary>
    <div class="scroll" tabindex="0" role="region" aria-label="Table of ${spec.title}">
      <table>
        <thead>
          <tr>
            ${columns.map((column) => html`<th scope="col">${column}</th>`)}
          </tr>
        </thead>
        <tbody>
          ${rows.map(
            (row) =>
              html`<tr>
                ${row.map((cell) => html`<td>${cell}</td>`)}
              </tr>`,
          )}
        </tbody>
      </table>
    </div>
  </details>`;
}
