/// The parts that the controls are made of: a caption, an input, and the faults of its value.
import { html, nothing } from "lit";
import type { TemplateResult } from "lit";
import { live } from "lit/directives/live.js";
import type { Field } from "./faults.ts";

export interface TextField {
  field: Field;
  caption: string;
  unit: string;
  text: string;
  faults: readonly string[];
  on_text: (text: string) => void;
}

export interface Slider {
  field: Field;
  caption: string;
  position: number;
  last: number;
  spoken: string; // what a screen reader says for the position
  faults: readonly string[];
  on_move: (position: number, settled: boolean) => void;
}

export interface Choice<Value> {
  value: Value;
  caption: string;
}

/// Rows are filled evenly: up to four choices stand in one row, others in rows of five.
const kColumns: ReadonlyMap<number, string> = new Map([
  [2, "two"],
  [3, "three"],
  [4, "four"],
]);

/// A list of faults, empty or not: it stays in the page, so that a screen reader hears of news.
export function fault_list(field: Field, faults: readonly string[]): TemplateResult {
  return html`<div id="${field}-fault" aria-live="polite">
    ${faults.map((fault) => html`<p class="fault">${fault}</p>`)}
  </div>`;
}

/// A typed value. It counts when the input is left or Enter is pressed, not at every key.
export function text_input(input: TextField): TemplateResult {
  return html`<span class="with-unit">
    <input
      id=${input.field}
      type="text"
      inputmode="decimal"
      autocomplete="off"
      spellcheck="false"
      aria-label=${input.unit === "" ? input.caption : `${input.caption}, ${input.unit}`}
      aria-describedby="${input.field}-fault"
      aria-invalid=${input.faults.length > 0 ? "true" : "false"}
      .value=${live(input.text)}
      @change=${(event: Event) => input.on_text((event.target as HTMLInputElement).value)}
    />
    <span class="muted" aria-hidden="true">${input.unit}</span>
  </span>`;
}

export function slider(input: Slider): TemplateResult {
  const report = (event: Event, settled: boolean): void =>
    input.on_move(Number((event.target as HTMLInputElement).value), settled);
  return html`<input
    id="${input.field}-slider"
    type="range"
    min="0"
    max=${input.last}
    step="1"
    aria-label=${input.caption}
    aria-valuetext=${input.spoken}
    aria-describedby="${input.field}-fault"
    aria-invalid=${input.faults.length > 0 ? "true" : "false"}
    .value=${live(String(input.position))}
    @input=${(event: Event) => report(event, false)}
    @change=${(event: Event) => report(event, true)}
  />`;
}

/// One of a few values, side by side; none is marked where the value is not among them.
export function segments<Value extends string | number>(
  name: string,
  legend: TemplateResult | string,
  choices: readonly Choice<Value>[],
  chosen: Value,
  on_choice: (value: Value) => void,
): TemplateResult {
  return html`<fieldset>
    <legend>${legend}</legend>
    <div class="segments ${kColumns.get(choices.length) ?? ""}">
      ${choices.map(
        ({ value, caption }) =>
          html`<label>
            <input
              type="radio"
              name=${name}
              .checked=${live(value === chosen)}
              @change=${() => on_choice(value)}
            />${caption}
          </label>`,
      )}
    </div>
  </fieldset>`;
}

export function tick_box(
  caption: string,
  ticked: boolean,
  on_change: (ticked: boolean) => void,
  described_by?: string,
): TemplateResult {
  return html`<label class="tick">
    <input
      type="checkbox"
      aria-describedby=${described_by ?? nothing}
      .checked=${live(ticked)}
      @change=${(event: Event) => on_change((event.target as HTMLInputElement).checked)}
    />${caption}
  </label>`;
}
