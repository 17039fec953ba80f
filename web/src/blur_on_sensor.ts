import { LitElement, css, html, nothing, svg } from "lit";
import type { TemplateResult } from "lit";
import { customElement, property } from "lit/decorators.js";
import type { Distance, OpticsReport } from "./contract.ts";
import { quantity } from "./format.ts";
import { size_of } from "./picture_updates.ts";
import { sensor_format } from "./sensor_formats.ts";
import { kBaseStyles } from "./shared_styles.ts";
import { kCssPxPerMm, magnification_for, row_at } from "./side_view_layout.ts";
import { kDefaultState } from "./state.ts";
import type { PlaygroundState } from "./state.ts";

const kSide_px = 168;
const kRoom_px = 150;
const kLeastGrid_px = 4;

/// The subject's blur disc on the sensor, the Airy disc and the pixels, all to one stated scale.
@customElement("fstop-blur-on-sensor")
export class BlurOnSensor extends LitElement {
  @property({ attribute: false }) state: PlaygroundState = kDefaultState;
  @property({ attribute: false }) optics: OpticsReport | undefined;
  @property({ attribute: false }) subject_m: Distance = 1;

  static override styles = [
    kBaseStyles,
    css`
      :host {
        display: block;
        flex: none;
        max-width: 100%;
      }
      figure {
        display: flex;
        gap: 0.8rem;
        margin: 0;
        font-size: 0.8125rem;
      }
      /* As wide for every number: what stands beside it must not move. */
      figcaption {
        width: 9.5rem;
      }
      svg {
        flex: none;
        border: 1px solid var(--line);
        background: var(--mat);
      }
      .grid {
        fill: none;
        stroke: var(--line);
      }
      circle {
        fill: none;
      }
      .disc {
        fill: var(--ray);
        fill-opacity: 0.35;
        stroke: var(--ray);
      }
      .airy {
        stroke: var(--text);
        stroke-dasharray: 2 2;
      }
      .limit {
        stroke: var(--sharp-line);
        stroke-width: 1.5;
      }
      dl {
        margin: 0.3rem 0 0;
      }
      dt {
        color: var(--muted);
      }
      dd {
        margin: 0 0 0.25rem;
        font-variant-numeric: tabular-nums;
      }
    `,
  ];

  override render(): TemplateResult | typeof nothing {
    const { optics } = this;
    const row = optics && row_at(optics, this.subject_m);
    if (!optics || !row) return nothing;
    const disc_mm = Math.abs(row.coc_mm);
    const airy_mm = optics.airy_diameter_um / 1000;
    const pixel_mm = sensor_format(this.state.sensor).sensor_mm[0] / size_of(this.state).width;
    const largest_mm = Math.max(disc_mm, airy_mm, pixel_mm, optics.coc_limit_mm);
    const magnification = magnification_for(largest_mm, kRoom_px);
    const px = (length_mm: number): number => length_mm * kCssPxPerMm * magnification;
    const circle = (name: string, diameter_mm: number) =>
      svg`<circle class=${name} cx=${kSide_px / 2} cy=${kSide_px / 2} r=${px(diameter_mm) / 2} />`;
    return html`<figure data-magnification=${magnification}>
      <svg width=${kSide_px} height=${kSide_px} role="img" aria-label="Blur disc on the sensor">
        ${px(pixel_mm) < kLeastGrid_px ? nothing : grid(px(pixel_mm))} ${circle("disc", disc_mm)}
        ${circle("limit", optics.coc_limit_mm)} ${circle("airy", airy_mm)}
      </svg>
      <figcaption>
        <b>On the sensor, ${quantity(magnification)} : 1</b>
        <dl>
          <dt>Blur disc, filled</dt>
          <dd>${quantity(disc_mm * 1000, "µm")} = ${quantity(Math.abs(row.coc_px), "px")}</dd>
          <dt>Airy disc, dashed</dt>
          <dd>${quantity(optics.airy_diameter_um, "µm")}</dd>
          <dt>Sharp up to, line</dt>
          <dd>${quantity(optics.coc_limit_mm * 1000, "µm")}</dd>
          <dt>Pixel</dt>
          <dd>${quantity(pixel_mm * 1000, "µm")}</dd>
        </dl>
      </figcaption>
    </figure>`;
  }
}

/// Pixels, one of them in the middle.
function grid(pitch_px: number): TemplateResult {
  const corner = kSide_px / 2 - pitch_px / 2;
  return svg`<defs>
      <pattern id="pixels" x=${corner} y=${corner} width=${pitch_px} height=${pitch_px}
        patternUnits="userSpaceOnUse">
        <path class="grid" d="M${pitch_px} 0H0V${pitch_px}" />
      </pattern>
    </defs>
    <rect width=${kSide_px} height=${kSide_px} fill="url(#pixels)" />` as TemplateResult;
}
