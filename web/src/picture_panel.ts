import { LitElement, css, html, nothing } from "lit";
import type { PropertyValues, TemplateResult } from "lit";
import { customElement, property, state } from "lit/decorators.js";
import type { RenderedImage } from "./api_client.ts";
import type { RenderReport } from "./contract.ts";
import { bound_size, duration, error_size } from "./format.ts";
import { kNoPicture, kPictureSize } from "./picture_updates.ts";
import type { Activity, PictureView } from "./picture_updates.ts";
import { kBaseStyles } from "./shared_styles.ts";

const kActivityText: Readonly<Record<Activity, string>> = {
  idle: "",
  preview: "rendering a preview …",
  refining: "preview; refining …",
  waiting: "the server is busy; trying again soon …",
};

/// The picture and, in a line below it, how it was made and how wrong it may be.
@customElement("fstop-picture")
export class PicturePanel extends LitElement {
  @property({ attribute: false }) view: PictureView = kNoPicture;
  @property({ attribute: false }) description = "";
  /// Sentences about the whole request, where no control can show them.
  @property({ attribute: false }) messages: readonly string[] = [];
  /// Whether the picture is of older settings because the server refused the present ones.
  @property({ type: Boolean, reflect: true }) outdated = false;

  @state() private source_ = "";

  static override styles = [
    kBaseStyles,
    css`
      :host {
        display: block;
      }
      figure {
        margin: 0;
      }
      .frame {
        position: relative;
        aspect-ratio: ${kPictureSize.width} / ${kPictureSize.height};
        overflow: hidden;
        border-radius: var(--radius);
        background: var(--mat);
      }
      img {
        display: block;
        width: 100%;
        height: 100%;
      }
      @media (min-width: 56rem) {
        .frame {
          max-width: calc(1.5 * max(100vh - 8rem, 20rem));
        }
      }
      :host([outdated]) img {
        opacity: 0.4;
      }
      .empty {
        position: absolute;
        inset: 0;
        display: grid;
        place-items: center;
        color: var(--muted);
      }
      .busy::after {
        content: "";
        position: absolute;
        inset: auto 0 0;
        height: 3px;
        background: var(--accent);
        transform-origin: left;
        animation: sweep 1.6s ease-in-out infinite;
      }
      @keyframes sweep {
        from {
          transform: translateX(-100%);
        }
        to {
          transform: translateX(100%);
        }
      }
      @media (prefers-reduced-motion: reduce) {
        .busy::after {
          animation: none;
        }
      }
      figcaption {
        display: flex;
        flex-wrap: wrap;
        gap: 0.1rem 1.1rem;
        min-height: 1.9rem;
        padding-top: 0.4rem;
        font-size: 0.875rem;
        color: var(--muted);
      }
      figcaption b {
        font-weight: 600;
        color: var(--text);
      }
      .messages {
        flex-basis: 100%;
      }
      button {
        margin-left: 0.5rem;
        padding: 0.15rem 0.6rem;
        border: 1px solid var(--control);
        border-radius: var(--radius);
        background: var(--panel);
        color: var(--text);
        font: inherit;
        cursor: pointer;
      }
    `,
  ];

  override willUpdate(changed: PropertyValues<this>): void {
    const before = changed.get("view")?.image;
    if (!changed.has("view") || before === this.view.image) return;
    URL.revokeObjectURL(this.source_);
    this.source_ = this.view.image ? URL.createObjectURL(this.view.image.picture) : "";
  }

  override disconnectedCallback(): void {
    super.disconnectedCallback();
    URL.revokeObjectURL(this.source_);
    this.source_ = "";
  }

  override render(): TemplateResult {
    const { activity } = this.view;
    const busy = activity !== "idle";
    return html`<figure>
      <div class="frame ${busy ? "busy" : ""}" aria-busy=${busy ? "true" : "false"}>
        ${
          this.source_ === ""
            ? html`<div class="empty">${busy ? "Rendering …" : "No picture yet"}</div>`
            : html`<img src=${this.source_} alt=${this.description} />`
        }
      </div>
      <figcaption>
        ${this.facts_()}
        <span role="status">${kActivityText[activity]}</span>
        <div class="messages" role="alert">
          ${this.messages.map((message) => html`<p class="fault">${message}${this.retry_()}</p>`)}
        </div>
      </figcaption>
    </figure>`;
  }

  /// Method, error and time; the headers' word until the report has come.
  private facts_(): TemplateResult | typeof nothing {
    const { image } = this.view;
    if (image === undefined) return nothing;
    if (this.outdated) return html`<span>Picture of the last valid settings.</span>`;
    const report = this.view.report?.id === image.id ? this.view.report : undefined;
    const estimate = report?.error.estimate ?? image.error.get("estimate");
    const upper_95 = report?.error.upper_95 ?? image.error.get("upper_95");
    return html`
      <span>method <b>${report?.method ?? image.method}</b></span>
      ${
        estimate === undefined || upper_95 === undefined
          ? nothing
          : html`<span class="number">
              error <b>${error_size(estimate)}</b>, below <b>${bound_size(upper_95)}</b> at 95 %
              ${report === undefined ? nothing : excess_text(report)}
            </span>`
      }
      <span class="number">${time_text(image)}</span>
    `;
  }

  private retry_(): TemplateResult {
    return html`<button type="button" @click=${() => this.dispatchEvent(new Event("retry"))}>
      Try again
    </button>`;
  }
}

/// A picture that the server had already says nothing of rendering.
function time_text({ timings_ms, round_trip_ms }: RenderedImage): TemplateResult {
  const render_ms = timings_ms.get("render");
  const rendered =
    render_ms === undefined ? "already rendered" : html`rendered in <b>${duration(render_ms)}</b>`;
  return html`${rendered}, here in ${duration(round_trip_ms)}`;
}

/// Says so where the error asked for was not reached.
function excess_text({
  error: { upper_95, target },
}: RenderReport): TemplateResult | typeof nothing {
  if (upper_95 !== "infinity" && upper_95 <= target) return nothing;
  return html`<b>(more than the ${error_size(target)} asked for)</b>`;
}
