import { LitElement, css, html, nothing } from "lit";
import type { TemplateResult } from "lit";
import { customElement, property, state } from "lit/decorators.js";
import type { RenderedImage } from "./api_client.ts";
import type { RenderReport } from "./contract.ts";
import { segments, tick_box } from "./fields.ts";
import { bound_size, duration, error_size } from "./format.ts";
import type { Comparison, PicturePoint } from "./page_state.ts";
import "./picture_stage.ts";
import { kDifferenceGain } from "./picture_stage.ts";
import type { DifferenceEvent } from "./picture_stage.ts";
import { held_layers, kNoPicture, size_of } from "./picture_updates.ts";
import type { Activity, PictureView } from "./picture_updates.ts";
import { sensor_format } from "./sensor_formats.ts";
import { kBaseStyles, kControlStyles } from "./shared_styles.ts";
import { kDefaultState } from "./state.ts";

const kActivityText: Readonly<Record<Activity, string>> = {
  idle: "",
  preview: "rendering a preview …",
  refining: "preview; refining …",
  waiting: "the server is busy; trying again soon …",
  away: "the server does not answer; trying again. Your settings are kept.",
};
/// From here on it says how long it takes already.
const kSlow_ms = 3000;

/// The picture, what to do with it, and how it was made and how wrong it may be.
@customElement("fstop-picture")
export class PicturePanel extends LitElement {
  @property({ attribute: false }) view: PictureView = kNoPicture;
  /// The second request's, to compare with.
  @property({ attribute: false }) other: PictureView | undefined;
  @property({ attribute: false }) comparison: Comparison = "wipe";
  @property({ attribute: false }) description = "";
  @property({ attribute: false }) other_description = "";
  @property({ attribute: false }) point: PicturePoint | undefined;
  /// The largest blur that counts as sharp; 0 where it is not known yet.
  @property({ attribute: false }) coc_limit_mm = 0;
  /// Sentences about the whole request, where no control can show them.
  @property({ attribute: false, hasChanged: are_others }) messages: readonly string[] = [];
  /// Whether the picture is of older settings because the server refused the present ones.
  @property({ type: Boolean, reflect: true }) outdated = false;

  @state() private inspect_ = false;
  @state() private overlay_ = false;
  @state() private zoom_ = 0;
  @state() private waited_ms_ = 0;
  @state() private difference_ = "";
  private timer_: ReturnType<typeof setInterval> | undefined;

  static override styles = [
    kBaseStyles,
    kControlStyles,
    css`
      :host {
        display: block;
      }
      figure {
        margin: 0;
      }
      @media (min-width: 56rem) {
        fstop-stage {
          max-width: calc(1.5 * max(100vh - 22rem, 20rem));
        }
      }
      @media (min-width: 130rem) {
        fstop-stage {
          max-width: none;
        }
      }
      @media (max-width: 55.99rem) and (min-height: 34rem) {
        :host,
        figure {
          display: contents;
        }
        fstop-stage {
          position: sticky;
          top: 0;
          z-index: 2;
          background: var(--surface);
        }
      }
      .tools {
        display: flex;
        flex-wrap: wrap;
        align-items: center;
        gap: 0.2rem 1.2rem;
        margin-top: 0.2rem;
        font-size: 0.875rem;
      }
      .tools fieldset {
        display: flex;
        align-items: center;
        gap: 0.5rem;
        margin: 0;
      }
      .tools legend {
        float: left;
        width: auto;
        margin: 0;
      }
      .tools .segments {
        grid-auto-columns: auto;
        grid-auto-flow: column;
        grid-template-columns: none;
      }
      .tools .segments label {
        padding: 0.2rem 0.6rem;
      }
      figcaption {
        display: flex;
        flex-wrap: wrap;
        gap: 0.1rem 1.1rem;
        min-height: 1.9rem;
        padding-top: 0.2rem;
        font-size: 0.875rem;
        color: var(--muted);
      }
      figcaption b {
        font-weight: 600;
        color: var(--text);
      }
      progress {
        width: 6rem;
        accent-color: var(--accent);
      }
      .messages,
      .legend {
        flex-basis: 100%;
      }
      .key {
        display: inline-block;
        width: 0.8em;
        height: 0.8em;
        margin: 0 0.3em 0 0.8em;
        border-radius: 2px;
      }
      .key.near {
        background: rgb(226 110 20);
      }
      .key.sharp {
        background: rgb(30 170 90);
      }
      .key.far {
        background: rgb(40 105 225);
      }
      @media (max-width: 55.99rem) {
        .tools {
          gap: 0 0.8rem;
        }
      }
    `,
  ];

  override connectedCallback(): void {
    super.connectedCallback();
    this.timer_ = setInterval(() => {
      const { activity, since_ms } = this.view;
      this.waited_ms_ = activity === "idle" ? 0 : performance.now() - since_ms;
    }, 1000);
  }

  override disconnectedCallback(): void {
    super.disconnectedCallback();
    clearInterval(this.timer_);
  }

  override render(): TemplateResult {
    const { activity, image, shown } = this.view;
    const busy = activity !== "idle" || (this.other?.activity ?? "idle") !== "idle";
    const state = shown ?? kDefaultState;
    return html`<figure>
      <fstop-stage
        .picture=${image?.picture}
        .other=${this.other?.image?.picture}
        .comparison=${this.comparison}
        .held=${held_layers(this.view)}
        .other_held=${held_layers(this.other ?? kNoPicture)}
        .size=${size_of(state)}
        .description=${this.description}
        .other_description=${this.other_description}
        .point=${this.point}
        .limit_share=${this.coc_limit_mm / sensor_format(state.sensor).sensor_mm[0]}
        .overlay=${this.overlay_}
        .zoom=${this.zoom_}
        .inspect=${this.inspect_}
        .busy=${busy}
        ?outdated=${this.outdated}
        @difference=${({ detail: { mean, largest } }: DifferenceEvent) =>
          (this.difference_ = `B less A, ${kDifferenceGain} times: mean ${mean.toFixed(2)}, largest ${largest} of 255`)}
      ></fstop-stage>
      ${this.tools_()}
      <figcaption>
        ${this.facts_(this.view, this.other ? "A" : "")}
        ${this.other ? this.facts_(this.other, "B") : nothing}
        ${this.other && this.comparison === "difference" ? html`<span>${this.difference_}</span>` : nothing}
        <span role="status">${kActivityText[activity]}</span>
        ${this.progress_()}
        ${
          activity !== "idle" && this.waited_ms_ > kSlow_ms
            ? html`<span class="number" aria-hidden="true">${Math.round(this.waited_ms_ / 1000)} s</span>`
            : nothing
        }
        ${this.overlay_ ? legend() : nothing}
        <div class="messages" role="alert">
          ${this.messages.map((message) => html`<p class="fault">${message}${this.retry_()}</p>`)}
        </div>
      </figcaption>
    </figure>`;
  }

  private tools_(): TemplateResult {
    return html`<div class="tools">
      ${segments(
        "click",
        "A click",
        [
          { value: 0, caption: "focuses" },
          { value: 1, caption: "looks" },
        ],
        this.inspect_ ? 1 : 0,
        (inspect) => (this.inspect_ = inspect === 1),
      )}
      ${segments(
        "loupe",
        "Loupe",
        [
          { value: 0, caption: "off" },
          { value: 1, caption: "1:1" },
          { value: 4, caption: "4:1" },
        ],
        this.zoom_,
        (zoom) => (this.zoom_ = zoom),
      )}
      ${tick_box("Blur map", this.overlay_, (overlay) => (this.overlay_ = overlay))}
    </div>`;
  }

  /// Method, error and time; the headers' word until the report has come.
  private facts_(view: PictureView, name: string): TemplateResult | typeof nothing {
    const { image } = view;
    if (image === undefined) return nothing;
    if (image.method === "") return html`<span>a preview of the render under way</span>`;
    if (this.outdated) return html`<span>Picture of the last valid settings.</span>`;
    const report = view.report?.id === image.id ? view.report : undefined;
    const estimate = report?.error.estimate ?? image.error.get("estimate");
    const upper_95 = report?.error.upper_95 ?? image.error.get("upper_95");
    return html`
      ${name === "" ? nothing : html`<b>${name}</b>`}
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

  /// How far the picture is, in the server's words.
  private progress_(): TemplateResult | typeof nothing {
    const { progress } = this.view;
    if (progress === undefined) return nothing;
    const { fraction, upper_95, remaining_ms, queue_place } = progress;
    return html`<span class="number">
      <progress max="1" .value=${fraction} aria-label="Share of the picture that is done"></progress>
      ${Math.floor(100 * fraction)} %
      ${queue_place === undefined ? nothing : html`; place ${queue_place} in the queue`}
      ${upper_95 === undefined ? nothing : html`; error below ${bound_size(upper_95)}`}
      ${remaining_ms === undefined ? nothing : html`; ${duration(remaining_ms)} to go`}
    </span>`;
  }

  private retry_(): TemplateResult {
    return html`<button type="button" @click=${() => this.dispatchEvent(new Event("retry"))}>
      Try again
    </button>`;
  }
}

function are_others(texts: readonly string[], before: readonly string[] | undefined): boolean {
  return texts.join("\n") !== before?.join("\n");
}

function legend(): TemplateResult {
  return html`<span class="legend"
    ><span class="key near"></span>blurred, near <span class="key sharp"></span>sharp
    <span class="key far"></span>blurred, far</span
  >`;
}

/// A picture that the server had already says nothing of rendering.
function time_text({ timings_ms, round_trip_ms, was_job }: RenderedImage): TemplateResult {
  if (was_job) return html`rendered as a job, here in <b>${duration(round_trip_ms)}</b>`;
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
