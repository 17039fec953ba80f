import { scaleLinear, scaleLog } from "d3-scale";
import { line, symbol, symbolCircle, symbolDiamond, symbolSquare, symbolTriangle } from "d3-shape";
import { LitElement, html, nothing, svg } from "lit";
import type { TemplateResult } from "lit";
import { customElement, property, state } from "lit/decorators.js";
import { save_text, standalone_svg } from "./files.ts";
import { quantity } from "./format.ts";
import { csv_of, domain_of, table_of } from "./plot_spec.ts";
import type { Axis, PlotSpec, Series } from "./plot_spec.ts";
import { kPlotStyles } from "./plot_styles.ts";
import { kBaseStyles } from "./shared_styles.ts";

const kMargin_rem = { top: 0.8, right: 1.1, bottom: 2.95, left: 3.9 };
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
    const margin = margins(rem);
    const width = Math.min(this.width_, 60 * rem);
    const height = Math.round(Math.min(Math.max(0.5 * width, 15 * rem), 25 * rem));
    const right = width - margin.right;
    const bottom = height - margin.bottom;
    const points = spec.series.flatMap((one) => one.points);
    const of = (axis: "x" | "y"): number[] =>
      spec.marks.filter((mark) => mark.axis === axis).map(({ at }) => at);
    const x = scale(spec.x, [...points.map(([at]) => at), ...of("x")], [margin.left, right]);
    const y = scale(spec.y, [...points.map(([, at]) => at), ...of("y")], [bottom, margin.top]);
    return html`<svg
      class="plot"
      width=${width}
      height=${height}
      viewBox="0 0 ${width} ${height}"
      role="img"
      aria-label="${spec.title}. The table below has its numbers."
    >
      ${ticks_of(spec.x, x, width < 420 ? 4 : 8).map(
        (tick) => svg`<line class="grid" x1=${x(tick)} x2=${x(tick)} y1=${margin.top} y2=${bottom} />
          <text x=${x(tick)} y=${bottom + 1.1 * rem} text-anchor="middle">${tick_text(tick)}</text>`,
      )}
      ${ticks_of(spec.y, y, 6).map(
        (tick) => svg`<line class="grid" x1=${margin.left} x2=${right} y1=${y(tick)} y2=${y(tick)} />
          <text x=${margin.left - 6} y=${y(tick) + 0.27 * rem} text-anchor="end">${tick_text(tick)}</text>`,
      )}
      <text class="name" x=${(margin.left + right) / 2} y=${height - 6} text-anchor="middle">
        ${spec.x.caption}
      </text>
      <text class="name" transform="translate(${0.85 * rem} ${(margin.top + bottom) / 2}) rotate(-90)"
        text-anchor="middle">${spec.y.caption}</text>
      ${spec.marks.map((mark, i) =>
        mark.axis === "x"
          ? svg`<line class="mark" x1=${x(mark.at)} x2=${x(mark.at)} y1=${margin.top} y2=${bottom} />
            <text class="mark" transform="translate(${x(mark.at) - 4} ${margin.top + (0.3 + 2.3 * (i % 3)) * rem}) rotate(-90)"
              text-anchor="end">${mark.caption}</text>`
          : svg`<line class="mark" x1=${margin.left} x2=${right} y1=${y(mark.at)} y2=${y(mark.at)} />
            <text class="mark" x=${i % 2 ? margin.left + 4 : right - 4} y=${y(mark.at) - 4}
              text-anchor=${i % 2 ? "start" : "end"}>${mark.caption}</text>`,
      )}
      ${spec.series.map((one, i) => series_shape(one, i, x, y, spec))}
    </svg>`;
  }

  private save_drawing_({ file }: PlotSpec): void {
    const drawing = this.renderRoot.querySelector<SVGSVGElement>("svg.plot");
    if (drawing) save_text(`${file}.svg`, "image/svg+xml", standalone_svg(drawing));
  }
}

function margins(rem: number) {
  const { top, right, bottom, left } = kMargin_rem;
  return { top: top * rem, right: right * rem, bottom: bottom * rem, left: left * rem };
}

function scale(axis: Axis, values: readonly number[], range: [number, number]): Scale {
  const domain = domain_of(axis, values);
  return axis.scale === "log"
    ? scaleLog(domain, range).clamp(true)
    : scaleLinear(domain, range).nice();
}

/// On logarithmic axes 1, 2 and 5 of a decade, or its beginning alone where decades are many.
function ticks_of(axis: Axis, to: Scale, count: number): number[] {
  const ticks = to.ticks(count);
  if (axis.scale === "linear") return ticks;
  const leading = (tick: number): number => Math.round(tick / 10 ** Math.floor(Math.log10(tick) + 1e-9));
  const few = ticks.filter((tick) => [1, 2, 5].includes(leading(tick)));
  return few.length <= 2 * count ? few : few.filter((tick) => leading(tick) === 1);
}

function tick_text(value: number): string {
  const small = value !== 0 && Math.abs(value) < 1e-3;
  const text = small ? value.toExponential(0) : String(Number(value.toPrecision(4)));
  return text.replace("-", kShortMinus);
}

function series_shape(one: Series, i: number, x: Scale, y: Scale, spec: PlotSpec) {
  const shown = ([, value]: readonly [number, number]): boolean =>
    Number.isFinite(value) && (spec.y.scale === "linear" || value > 0);
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
