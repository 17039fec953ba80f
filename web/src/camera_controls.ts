import { LitElement, css, html, nothing } from "lit";
import type { TemplateResult } from "lit";
import { customElement, property } from "lit/decorators.js";
import { live } from "lit/directives/live.js";
import "./body_controls.ts";
import { StateChangeEvent } from "./changes.ts";
import type { SceneSummary } from "./contract.ts";
import type { Field, FieldFaults } from "./faults.ts";
import { fault_list, segments, slider, text_input, tick_box } from "./fields.ts";
import { distance_at, kInfinityPosition, position_of } from "./focus_scale.ts";
import { quantity } from "./format.ts";
import { kBaseStyles, kControlStyles } from "./shared_styles.ts";
import { distance_of, kCriteria, kDefaultState, number_of } from "./state.ts";
import type { PlaygroundState, StateChange } from "./state.ts";
import { f_number_of_step, kLastThirdStop, nominal_label } from "./third_stops.ts";
import { TypedTexts } from "./typed_texts.ts";

const kFocalLengths_mm = [14, 20, 24, 28, 35, 50, 85, 105, 135, 200];
const kQualities = [
  { value: 0.03, caption: "Draft" },
  { value: 0.01, caption: "Good" },
  { value: 0.005, caption: "Fine" },
  { value: 0.002, caption: "Finest" },
];

/// Scene, camera and quality. Shows `state`, reports what the user wants instead.
@customElement("fstop-camera-controls")
export class CameraControls extends LitElement {
  @property({ attribute: false }) state: PlaygroundState = kDefaultState;
  @property({ attribute: false }) scenes: readonly SceneSummary[] = [];
  @property({ attribute: false }) faults: FieldFaults = new Map();
  /// What the server takes for "optimal", to start from when a number is wanted instead.
  @property({ attribute: false }) optimal_diameter_mm = 0.35;

  private readonly typed_ = new TypedTexts(this);
  /// Where the focus goes when infinity is unticked.
  private last_finite_focus_m_ = 2;
  private light_is_open_ = false;

  static override styles = [
    kBaseStyles,
    kControlStyles,
    css`
      :host {
        display: block;
      }
      .row + .row {
        margin-top: 0.4rem;
      }
      .criterion {
        display: flex;
        align-items: center;
        gap: 0.5rem;
        margin-top: 0.4rem;
      }
      .note {
        margin: 0.2rem 0 0;
        font-size: 0.875rem;
      }
      summary {
        padding: 0.2rem 0;
        font-weight: 500;
        cursor: pointer;
      }
    `,
  ];

  override willUpdate(): void {
    const focus_m = this.state.focus_distance_m;
    if (focus_m !== "infinity") this.last_finite_focus_m_ = focus_m;
  }

  override render(): TemplateResult {
    return html`
      <h2>Scene</h2>
      ${this.scene_()}
      <h2>Camera</h2>
      ${segments(
        "camera",
        "Image formed by",
        [
          { value: "lens", caption: "Lens" },
          { value: "pinhole", caption: "Pinhole" },
        ],
        this.state.camera,
        (camera) => this.change_({ camera }),
      )}
      ${this.state.camera === "lens" ? this.lens_() : this.pinhole_()}
      <fstop-body-controls .state=${this.state} .faults=${this.faults}></fstop-body-controls>
      <h2>Picture</h2>
      ${this.quality_()} ${this.light_()}
    `;
  }

  /// Folded away, and loaded when it is opened or a link has something of it; then it stays open
  /// until it is closed by hand.
  private light_(): TemplateResult {
    this.light_is_open_ ||= kOfLight.some((key) => this.state[key] !== kDefaultState[key]);
    if (this.light_is_open_) void load_light_controls();
    const toggled = ({ currentTarget }: Event): void => {
      this.light_is_open_ = (currentTarget as HTMLDetailsElement).open;
      void load_light_controls();
    };
    return html`<details ?open=${this.light_is_open_} @toggle=${toggled}>
      <summary>Motion, light, textures, halftone</summary>
      <fstop-light-controls .state=${this.state} .faults=${this.faults}></fstop-light-controls>
    </details>`;
  }

  private scene_(): TemplateResult {
    const { scene } = this.state;
    const known = this.scenes.some(({ name }) => name === scene);
    const note = this.scenes.find(({ name }) => name === scene)?.description ?? "";
    return html`<div class="field">
      <select
        id="scene"
        aria-label="Scene"
        aria-describedby="scene-fault"
        aria-invalid=${this.faults_of_("scene").length > 0 ? "true" : "false"}
        .value=${live(scene)}
        @change=${(event: Event) => this.change_({ scene: chosen_value(event) })}
      >
        ${known ? nothing : html`<option value=${scene} selected>${scene || "…"}</option>`}
        ${this.scenes.map(
          ({ name, title }) =>
            html`<option value=${name} ?selected=${name === scene}>${title}</option>`,
        )}
      </select>
      ${note === "" ? nothing : html`<p class="note muted">${note}</p>`}
      ${fault_list("scene", this.faults_of_("scene"))}
    </div>`;
  }

  private lens_(): TemplateResult {
    const { focal_length_mm, f_stop } = this.state;
    const label = `f/${nominal_label(f_stop)}`;
    return html`
      <div class="field">
        ${segments(
          "focal-length",
          "Focal length",
          kFocalLengths_mm.map((value) => ({ value, caption: String(value) })),
          focal_length_mm,
          (value) => this.change_({ focal_length_mm: value }),
        )}
        <div class="row">
          ${this.number_("focal_length_mm", "Focal length", "mm")}
          ${tick_box(
            "Lock framing",
            this.state.lock_framing,
            (lock_framing) => this.change_({ lock_framing }),
            "lock-note",
          )}
        </div>
        <p class="note muted" id="lock-note" ?hidden=${!this.state.lock_framing}>
          Another focal length moves the camera: what is in focus keeps its size.
        </p>
        ${fault_list("focal_length_mm", this.faults_of_("focal_length_mm"))}
      </div>
      <div class="field">
        <div class="caption">
          <span>Aperture</span>
          <output>
            ${label} <span class="muted">= ${quantity(f_number_of_step(f_stop))}</span>
          </output>
        </div>
        ${slider({
          field: "f_stop",
          caption: "Aperture, f-number in third stops",
          position: f_stop,
          last: kLastThirdStop,
          spoken: label,
          faults: this.faults_of_("f_stop"),
          on_move: (step, settled) => this.change_({ f_stop: step }, settled),
        })}
        ${fault_list("f_stop", this.faults_of_("f_stop"))}
      </div>
      ${this.focus_()}
      <div class="field">
        ${tick_box(
          "Focus breathing",
          this.state.breathing,
          (breathing) => this.change_({ breathing }),
          "breathing-note",
        )}
        <p class="note muted" id="breathing-note">
          ${
            this.state.breathing
              ? "The sensor moves to the image of the focused plane: framing changes with focus."
              : "The sensor stays at the focal length: framing is the same at every focus."
          }
        </p>
        ${fault_list("breathing", this.faults_of_("breathing"))}
      </div>
    `;
  }

  private focus_(): TemplateResult {
    const { focus_distance_m } = this.state;
    const faults = this.faults_of_("focus_distance_m");
    return html`<div class="field">
      <div class="caption"><span>Focus distance</span></div>
      ${slider({
        field: "focus_distance_m",
        caption: "Focus distance, from near to infinity",
        position: position_of(focus_distance_m),
        last: kInfinityPosition,
        spoken: focus_distance_m === "infinity" ? "infinity" : `${focus_distance_m} m`,
        faults,
        on_move: (position, settled) =>
          this.change_({ focus_distance_m: distance_at(position) }, settled),
      })}
      <div class="row">
        ${this.text_("focus_distance_m", "Focus distance", "m", (text) => {
          const focus_m = distance_of(text);
          return focus_m === undefined ? undefined : { focus_distance_m: focus_m };
        })}
        ${tick_box("Infinity", focus_distance_m === "infinity", (far) =>
          this.change_({ focus_distance_m: far ? "infinity" : this.last_finite_focus_m_ }),
        )}
      </div>
      ${fault_list("focus_distance_m", faults)}
    </div>`;
  }

  private pinhole_(): TemplateResult {
    const optimal = this.state.diameter_mm === "optimal";
    return html`
      <div class="field">
        <div class="caption"><span>Diameter of the hole</span></div>
        <div class="row">
          ${this.text_("diameter_mm", "Diameter of the hole", "mm", (text) => {
            const value = text.trim() === "optimal" ? text.trim() : number_of(text);
            return value === undefined ? undefined : ({ diameter_mm: value } as StateChange);
          })}
          ${tick_box("Optimal", optimal, (wanted) =>
            this.change_({
              diameter_mm: wanted ? "optimal" : Number(this.optimal_diameter_mm.toPrecision(3)),
            }),
          )}
        </div>
        ${optimal ? this.criterion_() : nothing}
        ${fault_list("criterion", this.faults_of_("criterion"))}
        ${fault_list("diameter_mm", this.faults_of_("diameter_mm"))}
      </div>
      <div class="field">
        <div class="caption"><span>Hole to sensor</span></div>
        ${this.number_("image_distance_mm", "Distance from the hole to the sensor", "mm")}
        ${fault_list("image_distance_mm", this.faults_of_("image_distance_mm"))}
      </div>
    `;
  }

  /// What the optimal hole is best at.
  private criterion_(): TemplateResult {
    return html`<label class="criterion">
      <span class="muted">by</span>
      <select
        aria-label="What the optimal hole is best at"
        .value=${live(this.state.criterion)}
        @change=${(event: Event) =>
          this.change_({ criterion: chosen_value(event) as PlaygroundState["criterion"] })}
      >
        ${kCriteria.map(
          (name) =>
            html`<option value=${name} ?selected=${name === this.state.criterion}>${name}</option>`,
        )}
      </select>
    </label>`;
  }

  private quality_(): TemplateResult {
    return html`${segments(
      "quality",
      html`Quality <span class="muted number">error ≤ ${this.state.max_error}</span>`,
      kQualities,
      this.state.max_error,
      (max_error) => this.change_({ max_error }),
    )}
    ${fault_list("max_error", this.faults_of_("max_error"))}`;
  }

  private number_(
    field: "focal_length_mm" | "image_distance_mm",
    caption: string,
    unit: string,
  ): TemplateResult {
    return this.text_(field, caption, unit, (text) => {
      const value = number_of(text);
      return value === undefined ? undefined : { [field]: value };
    });
  }

  /// A typed member of the state; `change_of` reads the text, or gives nothing if it is no value.
  private text_(
    field: Field,
    caption: string,
    unit: string,
    change_of: (text: string) => StateChange | undefined,
  ): TemplateResult {
    const value = this.state[field];
    return text_input({
      field,
      caption,
      unit: value === "infinity" || value === "optimal" ? "" : unit,
      text: this.typed_.text(field) ?? (value === "infinity" ? "∞" : String(value)),
      faults: this.faults_of_(field),
      on_text: (text) => {
        const change = change_of(text);
        if (change === undefined) this.typed_.keep(field, text);
        else this.change_(change);
      },
    });
  }

  private faults_of_(field: Field): readonly string[] {
    return this.typed_.faults(field);
  }

  private change_(change: StateChange, settled = true): void {
    this.typed_.drop(Object.keys(change));
    this.dispatchEvent(new StateChangeEvent(change, settled));
  }
}

const kOfLight = [
  "velocity_m_s",
  "illumination",
  "shading",
  "interpolation",
  "filter",
  "samples",
  "halftone",
] as const;

function load_light_controls(): Promise<unknown> {
  return import("./light_controls.ts");
}

function chosen_value(event: Event): string {
  return (event.target as HTMLSelectElement).value;
}
