import { LitElement, css, html, nothing } from "lit";
import type { TemplateResult } from "lit";
import { customElement, property } from "lit/decorators.js";
import type { ModelledEffect, RenderReport } from "./contract.ts";
import { bound_size, error_size, quantity } from "./format.ts";
import { kBaseStyles } from "./shared_styles.ts";

/// Why the picture was made this way: what was modelled, what was left out, what else was weighed.
@customElement("fstop-report")
export class ReportPanel extends LitElement {
  @property({ attribute: false }) report: RenderReport | undefined;
  /// Whether a newer picture is there already, whose report is still to come.
  @property({ type: Boolean, reflect: true }) outdated = false;

  static override styles = [
    kBaseStyles,
    css`
      :host {
        display: block;
      }
      :host([outdated]) .reasons {
        padding-left: 0.6rem;
        border-left: 3px dotted var(--control);
      }
      ul {
        margin: 0 0 1rem;
        padding: 0;
        list-style: none;
      }
      li {
        padding: 0.4rem 0;
        border-bottom: 1px solid var(--line);
        overflow-wrap: anywhere;
      }
      h3 {
        margin: 0 0 0.2rem;
        font-size: 0.9375rem;
        font-weight: 600;
      }
      b {
        font-weight: 600;
      }
    `,
  ];

  override render(): TemplateResult {
    return html`<h2>How it was made</h2>
      ${
        this.report === undefined
          ? html`<p class="muted">The reasons come with the picture.</p>`
          : html`<div class="reasons">${this.reasons_(this.report)}</div>`
      }`;
  }

  private reasons_(report: RenderReport): TemplateResult {
    return html`
      ${this.outdated ? html`<p class="muted">Of the picture before.</p>` : nothing}
      ${list("Effects", report.model.map(effect_text))}
      ${list(
        "Methods passed over",
        report.passed_over.map(({ method, why }) => html`<b>${method}</b>: ${with_stop(why)}`),
      )}
      ${list(
        "Warnings",
        report.warnings.map((warning) => html`${sentence(warning)}`),
      )}
      ${this.cost_(report)}
    `;
  }

  private cost_({ cost, error }: RenderReport): TemplateResult {
    return html`<p class="muted number">
      ${quantity(cost.samples_mean)} samples per pixel on average, ${quantity(cost.samples_max)} at
      most; the error asked for was ${error_size(error.target)}.
    </p>`;
  }
}

function list(title: string, entries: readonly TemplateResult[]): TemplateResult | typeof nothing {
  if (entries.length === 0) return nothing;
  return html`<h3>${title}</h3>
    <ul>
      ${entries.map((entry) => html`<li>${entry}</li>`)}
    </ul>`;
}

/// A bound of 0 says nothing: the effect is off, or absent from the scene.
function effect_text({ effect, modelled, bound, why }: ModelledEffect): TemplateResult {
  const consequence =
    bound === 0
      ? "."
      : modelled
        ? `; without it the picture would be wrong by up to ${bound_size(bound)}.`
        : `; that changes the picture by at most ${bound_size(bound)}.`;
  return html`<b>${capitalized(effect)}</b>
    <span class="number">${modelled ? "is modelled" : "is left out"}${consequence}</span>
    ${why === "" ? nothing : html`<span class="muted">${sentence(why)}</span>`}`;
}

function capitalized(text: string): string {
  return text.charAt(0).toUpperCase() + text.slice(1);
}

function sentence(text: string): string {
  return with_stop(capitalized(text));
}

function with_stop(text: string): string {
  return /[.!?]$/.test(text) ? text : `${text}.`;
}
