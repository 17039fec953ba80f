import { LitElement, css, html, nothing } from "lit";
import type { TemplateResult } from "lit";
import { customElement, property } from "lit/decorators.js";
import { live } from "lit/directives/live.js";
import { StateChangeEvent } from "./changes.ts";
import type { Field, FieldFaults } from "./faults.ts";
import { fault_list, slider, text_input } from "./fields.ts";
import { kBaseStyles, kControlStyles } from "./shared_styles.ts";
import { kDefaultState, kFilters, kHalftones, kIlluminations } from "./state.ts";
import { kInterpolations, kShadings, number_of } from "./state.ts";
import type { PlaygroundState, StateChange } from "./state.ts";
import { kShutterTimes } from "./third_stops.ts";
import { TypedTexts } from "./typed_texts.ts";

const kSamples = [0, 1, 4, 16, 64];
const kIlluminationTexts: Readonly<Record<PlaygroundState["illumination"], string>> = {
  local: "Lamps alone, no mirrors",
  recursive: "Lamps, mirrors and glass",
  global: "All light between surfaces (slow)",
};
const kAsTheScene = "as the scene has it";

type Choices = readonly (readonly [string, string])[];

/// What classical systems do to light: motion, illumination, shading, textures, halftone.
@customElement("fstop-light-controls")
export class LightControls extends LitElement {
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
    const moves = state.velocity_m_s !== 0 && state.exposure === "relative";
    return html`${this.number_("velocity_m_s", "Camera moves to the right by", "m/s")}
    ${moves ? this.shutter_() : nothing}
    ${this.choice_("illumination", "Illumination", worded(kIlluminations, kIlluminationTexts))}
    ${this.choice_("shading", "Shading of materials", plain(kShadings, kAsTheScene))}
    ${this.choice_("interpolation", "Shading across polygons", plain(kInterpolations, kAsTheScene))}
    ${this.choice_("filter", "Texture filter", plain(kFilters, kAsTheScene))}
    ${this.choice_(
      "samples",
      "Samples of a pixel",
      kSamples.map((count) => [String(count), count === 0 ? "as the quality needs" : String(count)]),
      Number,
    )}
    ${this.choice_("halftone", "Halftone", plain(kHalftones, "none"))}
    ${
      state.halftone === "" || state.halftone === "error-diffusion"
        ? nothing
        : this.number_("cell_px", "Cell of the halftone", "px")
    }`;
  }

  private shutter_(): TemplateResult {
    const step = this.state.shutter_step;
    const spoken = `${kShutterTimes.labels[step] ?? ""} s`;
    return html`<div class="field">
      <div class="caption"><span>Shutter time</span><output>${spoken}</output></div>
      ${slider({
        field: "shutter_step",
        caption: "Shutter time",
        position: step,
        last: kShutterTimes.labels.length - 1,
        spoken,
        faults: this.faults_of_("shutter_step"),
        on_move: (position, settled) => this.change_({ shutter_step: position }, settled),
      })}
      ${fault_list("shutter_step", this.faults_of_("shutter_step"))}
    </div>`;
  }

  private choice_<Key extends "illumination" | "shading" | "interpolation" | "filter" | "samples" | "halftone">(
    field: Key,
    caption: string,
    choices: Choices,
    value_of: (text: string) => unknown = (text) => text,
  ): TemplateResult {
    const chosen = String(this.state[field]);
    return html`<label class="line"
        ><span>${caption}</span>
        <select
          id=${field}
          .value=${live(chosen)}
          @change=${(event: Event) =>
            this.change_({ [field]: value_of((event.target as HTMLSelectElement).value) })}
        >
          ${choices.map(
            ([value, text]) =>
              html`<option value=${value} ?selected=${value === chosen}>${text}</option>`,
          )}
        </select>
      </label>
      ${fault_list(field, this.faults_of_(field))}`;
  }

  private number_(field: "velocity_m_s" | "cell_px", caption: string, unit: string): TemplateResult {
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

function plain(values: readonly string[], of_empty: string): Choices {
  return values.map((value) => [value, value === "" ? of_empty : value]);
}

function worded<Value extends string>(
  values: readonly Value[],
  texts: Readonly<Record<Value, string>>,
): Choices {
  return values.map((value) => [value, texts[value]]);
}
