import { LitElement, css, html, nothing } from "lit";
import type { TemplateResult } from "lit";
import { customElement, property } from "lit/decorators.js";
import { live } from "lit/directives/live.js";
import { StateChangeEvent } from "./changes.ts";
import type { Field, FieldFaults } from "./faults.ts";
import { fault_list, slider, text_input } from "./fields.ts";
import { kSensorNames, sensor_format } from "./sensor_formats.ts";
import { kBaseStyles, kControlStyles } from "./shared_styles.ts";
import { kDefaultState, number_of } from "./state.ts";
import type { Exposure, PlaygroundState, StateChange } from "./state.ts";
import { kIsoSpeeds, kShutterTimes } from "./third_stops.ts";
import type { StopScale } from "./third_stops.ts";
import { TypedTexts } from "./typed_texts.ts";

const kBlades = [0, 5, 6, 7, 8, 9, 11];
const kExposureTexts: Readonly<Record<Exposure, string>> = {
  relative: "As bright at every f-stop",
  manual: "Manual: stopping down darkens",
  time: "Time makes up for the f-stop",
  iso: "ISO makes up for the f-stop",
};
const kSpectra: Readonly<Record<PlaygroundState["spectrum"], string>> = {
  rgb: "White: a band for each channel",
  monochromatic: "One wavelength",
};

/// What belongs to the camera's body: format, iris, exposure, light, place. Folded away at first.
@customElement("fstop-body-controls")
export class BodyControls extends LitElement {
  @property({ attribute: false }) state: PlaygroundState = kDefaultState;
  @property({ attribute: false }) faults: FieldFaults = new Map();

  private readonly typed_ = new TypedTexts(this);

  static override styles = [
    kBaseStyles,
    kControlStyles,
    css`
      :host {
        display: block;
      }
      details {
        margin-bottom: 0.95rem;
      }
      summary {
        padding: 0.2rem 0;
        font-weight: 500;
        cursor: pointer;
      }
      label.line {
        display: grid;
        gap: 0.2rem;
        margin: 0.5rem 0;
      }
      label.line span {
        font-size: 0.875rem;
        color: var(--muted);
      }
    `,
  ];

  override render(): TemplateResult {
    const { state } = this;
    return html`
      <div class="field">
        ${this.choice_(
          "sensor",
          "Sensor",
          kSensorNames.map((name) => [name, sensor_format(name).caption]),
          state.sensor,
          (sensor) => ({ sensor: sensor as PlaygroundState["sensor"] }),
        )}
        ${this.choice_(
          "exposure",
          "Exposure",
          Object.entries(kExposureTexts),
          state.exposure,
          (exposure) => ({ exposure: exposure as Exposure }),
        )}
      </div>
      ${state.exposure === "relative" ? nothing : this.exposure_()}
      <details ?open=${has_more(state)}>
        <summary>Iris, light, place</summary>
        ${
          state.camera === "lens"
            ? this.choice_(
                "blades",
                "Blades of the iris",
                kBlades.map((count) => [String(count), count === 0 ? "round" : String(count)]),
                String(state.blades),
                (count) => ({ blades: Number(count) }),
              )
            : nothing
        }
        ${
          state.blades > 0 && state.camera === "lens"
            ? this.number_("blade_rotation_deg", "Rotation of the blades", "°")
            : nothing
        }
        ${this.choice_(
          "spectrum",
          "Light for diffraction",
          Object.entries(kSpectra),
          state.spectrum,
          (spectrum) => ({ spectrum: spectrum as PlaygroundState["spectrum"] }),
        )}
        ${this.number_("wavelength_nm", "Wavelength", "nm")}
        ${this.number_("camera_z_m", "Camera stands back by", "m")}
      </details>
    `;
  }

  private exposure_(): TemplateResult {
    return html`${this.stop_("shutter_step", "Shutter time", kShutterTimes, "s")}
    ${this.stop_("iso_step", "ISO speed", kIsoSpeeds, "")}`;
  }

  private stop_(
    field: "shutter_step" | "iso_step",
    caption: string,
    { labels }: StopScale,
    unit: string,
  ): TemplateResult {
    const step = this.state[field];
    const spoken = `${labels[step] ?? ""} ${unit}`.trim();
    return html`<div class="field">
      <div class="caption"><span>${caption}</span><output>${spoken}</output></div>
      ${slider({
        field,
        caption,
        position: step,
        last: labels.length - 1,
        spoken,
        faults: this.faults_of_(field),
        on_move: (position, settled) => this.change_({ [field]: position }, settled),
      })}
      ${fault_list(field, this.faults_of_(field))}
    </div>`;
  }

  private choice_(
    field: Field,
    caption: string,
    choices: readonly (readonly [string, string])[],
    chosen: string,
    change_of: (value: string) => StateChange,
  ): TemplateResult {
    return html`<label class="line"
        ><span>${caption}</span>
        <select
          id=${field}
          .value=${live(chosen)}
          @change=${(event: Event) =>
            this.change_(change_of((event.target as HTMLSelectElement).value))}
        >
          ${choices.map(
            ([value, text]) =>
              html`<option value=${value} ?selected=${value === chosen}>${text}</option>`,
          )}
        </select>
      </label>
      ${fault_list(field, this.faults_of_(field))}`;
  }

  private number_(
    field: "blade_rotation_deg" | "wavelength_nm" | "camera_z_m",
    caption: string,
    unit: string,
  ): TemplateResult {
    return html`<label class="line"
        ><span>${caption}</span>${text_input({
          field,
          caption,
          unit,
          text: this.typed_.text(field) ?? String(this.state[field]),
          faults: this.faults_of_(field),
          on_text: (text) => {
            const value = number_of(text);
            if (value === undefined) this.typed_.keep(field, text);
            else this.change_({ [field]: value });
          },
        })}</label
      >
      ${fault_list(field, this.faults_of_(field))}`;
  }

  private faults_of_(field: Field): readonly string[] {
    return this.typed_.faults(field);
  }

  private change_(change: StateChange, settled = true): void {
    this.typed_.drop(Object.keys(change));
    this.dispatchEvent(new StateChangeEvent(change, settled));
  }
}

/// Whether something that is folded away has another value than at first.
function has_more(state: PlaygroundState): boolean {
  return (["blades", "spectrum", "wavelength_nm", "camera_z_m"] as const).some(
    (key) => state[key] !== kDefaultState[key],
  );
}
