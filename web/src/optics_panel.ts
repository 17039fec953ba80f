import { LitElement, css, html, nothing } from "lit";
import type { TemplateResult } from "lit";
import { customElement, property } from "lit/decorators.js";
import type { Distance, OpticsAtDistance, OpticsReport, PinholeOptics } from "./contract.ts";
import { quantity } from "./format.ts";
import { kBaseStyles } from "./shared_styles.ts";

/// The numbers of the camera and a table of its blur at several distances.
@customElement("fstop-optics")
export class OpticsPanel extends LitElement {
  @property({ attribute: false }) optics: OpticsReport | undefined;
  /// Undefined for a pinhole.
  @property({ attribute: false }) focus_distance_m: Distance | undefined;
  @property({ type: Boolean, reflect: true }) outdated = false;

  static override styles = [
    kBaseStyles,
    css`
      :host {
        display: block;
      }
      :host([outdated]) .numbers {
        padding-left: 0.6rem;
        border-left: 3px dotted var(--control);
      }
      dl {
        display: grid;
        grid-template-columns: repeat(auto-fill, minmax(9.5rem, 1fr));
        gap: 0.55rem 1rem;
        margin: 0 0 1.1rem;
      }
      dt {
        font-size: 0.8125rem;
        color: var(--muted);
      }
      dd {
        margin: 0;
        font-variant-numeric: tabular-nums;
      }
      .scroll {
        overflow-x: auto;
      }
      table {
        width: 100%;
        border-collapse: collapse;
        font-variant-numeric: tabular-nums;
      }
      caption {
        padding-bottom: 0.3rem;
        text-align: left;
        font-size: 0.875rem;
        color: var(--muted);
      }
      th,
      td {
        padding: 0.25rem 0 0.25rem 0.6rem;
        border-bottom: 1px solid var(--line);
        text-align: right;
        font-weight: 400;
        white-space: nowrap;
      }
      th:first-child {
        padding-left: 0;
      }
      thead th {
        font-size: 0.8125rem;
        color: var(--muted);
        vertical-align: bottom;
        white-space: normal;
      }
      tr.focused th,
      tr.focused td {
        font-weight: 600;
      }
    `,
  ];

  override render(): TemplateResult {
    return html`<h2>Optics</h2>
      ${
        this.optics === undefined
          ? html`<p class="muted">No numbers yet.</p>`
          : html`<div class="numbers">
              ${this.numbers_(this.optics)}${this.table_(this.optics.at)}
            </div>`
      }`;
  }

  private numbers_(optics: OpticsReport): TemplateResult {
    const [across, down] = optics.view_angle_deg;
    const entries: [string, string][] = [
      ["Image distance", quantity(optics.image_distance_mm, "mm")],
      ...(this.focus_distance_m === undefined
        ? hole_entries(optics.pinhole)
        : focus_entries(optics)),
      ["Working f-number", quantity(optics.f_number_effective)],
      ["Airy diameter", quantity(optics.airy_diameter_um, "µm")],
      ["View angle", `${quantity(across)}° × ${quantity(down)}°`],
    ];
    return html`<dl>
      ${entries.map(
        ([name, value]) =>
          html`<div>
            <dt>${name}</dt>
            <dd>${value}</dd>
          </div>`,
      )}
    </dl>`;
  }

  private table_(rows: readonly OpticsAtDistance[]): TemplateResult | typeof nothing {
    if (rows.length === 0) return nothing;
    const caption =
      this.focus_distance_m === undefined
        ? "Blur disc on the sensor"
        : "Blur disc on the sensor; negative in front of the focused plane";
    return html`<div class="scroll">
      <table>
        <caption>
          ${caption}
        </caption>
        <thead>
          <tr>
            <th scope="col">Object at</th>
            <th scope="col">Image at</th>
            <th scope="col">Diameter, mm</th>
            <th scope="col">in pixels</th>
          </tr>
        </thead>
        <tbody>
          ${rows.map(
            (row) =>
              html`<tr class=${row.object_distance_m === this.focus_distance_m ? "focused" : ""}>
                <th scope="row">${quantity(row.object_distance_m, "m")}</th>
                <td>${quantity(row.image_distance_mm, "mm")}</td>
                <td>${quantity(row.coc_mm)}</td>
                <td>${quantity(row.coc_px)}</td>
              </tr>`,
          )}
        </tbody>
      </table>
    </div>`;
  }
}

/// What a lens has and a pinhole has not.
function focus_entries(optics: OpticsReport): [string, string][] {
  return [
    ["Magnification", quantity(optics.magnification)],
    ["Sharp from", quantity(optics.near_m, "m")],
    ["Sharp to", quantity(optics.far_m, "m")],
    ["Hyperfocal distance", quantity(optics.hyperfocal_m, "m")],
  ];
}

/// What holds of a pinhole camera alone.
function hole_entries(hole: PinholeOptics): [string, string][] {
  return [
    ["Hole diameter", quantity(hole.diameter_mm, "mm")],
    ["Optimal diameter", quantity(hole.optimal_diameter_mm, "mm")],
    ["Fresnel number", quantity(hole.fresnel_number)],
  ];
}
