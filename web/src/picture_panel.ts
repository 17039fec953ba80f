import { LitElement, css, html, nothing } from "lit";
import type { TemplateResult } from "lit";
import { customElement, property, state } from "lit/decorators.js";
import type { RenderedImage } from "./api_client.ts";
import type { RenderReport } from "./contract.ts";
import { kNoComplaint } from "./faults.ts";
import { segments, tick_box } from "./fields.ts";
import { bound_size, duration, error_size } from "./format.ts";
import { same_shape } from "./letterbox.ts";
import type { Comparison, PicturePoint } from "./page_state.ts";
import "./picture_stage.ts";
import { kDifferenceGain } from "./picture_stage.ts";
import type { DifferenceEvent } from "./picture_stage.ts";
import { held_layers, is_outdated, kNoPicture, size_of } from "./picture_updates.ts";
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

/// A sentence about a whole request; where it may pass, the reader can try again.
export interface Message {
  text: string;
  may_pass: boolean;
}

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
  /// Where no control can show them.
  @property({ attribute: false, hasChanged: are_others }) messages: readonly Message[] = [];

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
      .facts {
        display: flex;
        flex-wrap: wrap;
        gap: 0.1rem 1.1rem;
      }
      .facts + .facts,
      .facts:has(+ .facts),
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
      const begun_ms = this.named_views_()
        .filter(([, { activity }]) => activity !== "idle")
        .map(([, { since_ms }]) => since_ms);
      this.waited_ms_ = begun_ms.length === 0 ? 0 : performance.now() - Math.min(...begun_ms);
    }, 1000);
  }

  override disconnectedCallback(): void {
    super.disconnectedCallback();
    clearInterval(this.timer_);
  }

  override render(): TemplateResult {
    const { image, shown } = this.view;
    const views = this.named_views_();
    const busy = views.some(([, { activity }]) => activity !== "idle");
    const state = shown ?? kDefaultState;
    return html`<figure>
      <fstop-stage
        .picture=${image?.picture}
        .other=${this.other?.image?.picture}
        .comparison=${this.comparison}
        .held=${held_layers(this.view)}
        .other_held=${held_layers(this.other ?? kNoPicture)}
        .size=${size_of(state)}
        .other_size=${size_of(this.other?.shown ?? state)}
        .description=${this.description}
        .other_description=${this.other_description}
        .point=${this.point}
        .limit_share=${this.coc_limit_mm / sensor_format(state.sensor).sensor_mm[0]}
        .overlay=${this.overlay_}
        .zoom=${this.zoom_}
        .inspect=${this.inspect_}
        .busy=${busy}
        .is_soon=${views.some(([, { activity }]) => activity === "preview")}
        ?outdated=${is_outdated(this.view)}
        ?other_outdated=${is_outdated(this.other ?? kNoPicture)}
        @difference=${({ detail: { mean, largest } }: DifferenceEvent) =>
          (this.difference_ = `B less A, ${kDifferenceGain} times: mean ${mean.toFixed(2)}, largest ${largest} of 255`)}
      ></fstop-stage>
      ${this.tools_()}
      <figcaption>
        ${views.map(([name, view]) => html`<div class="facts">${facts(view, name)}</div>`)}
        ${
          this.other && this.comparison === "difference" && this.has_difference_()
            ? html`<span>${this.difference_}</span>`
            : nothing
        }
        <span role="status">${views.map(([name, view]) => activity_text(view, name))}</span>
        ${views.map(([name, view]) => progress(view, name))}
        ${
          busy && this.waited_ms_ > kSlow_ms
            ? html`<span class="number" aria-hidden="true">${Math.round(this.waited_ms_ / 1000)} s</span>`
            : nothing
        }
        ${this.overlay_ ? legend() : nothing}
        <div class="messages" role="alert">
          ${this.messages.map(
            ({ text, may_pass }) =>
              html`<p class="fault">${text} ${may_pass ? this.retry_() : nothing}</p>`,
          )}
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

  /// The picture, or both by their letters.
  private named_views_(): [string, PictureView][] {
    return this.other === undefined
      ? [["", this.view]]
      : [
          ["A", this.view],
          ["B", this.other],
        ];
  }

  private has_difference_(): boolean {
    const [a, b] = [this.view.shown, this.other?.shown];
    return a !== undefined && b !== undefined && same_shape(size_of(a), size_of(b));
  }

  private retry_(): TemplateResult {
    return html`<button type="button" @click=${() => this.dispatchEvent(new Event("retry"))}>
      Try again
    </button>`;
  }
}

function are_others(messages: readonly Message[], before: readonly Message[] | undefined): boolean {
  return JSON.stringify(messages) !== JSON.stringify(before);
}

/// Method, error and time; the headers' word until the report has come.
function facts(view: PictureView, name: string): TemplateResult | typeof nothing {
  const { image } = view;
  if (image === undefined) return nothing;
  const letter = name === "" ? nothing : html`<b>${name}</b>`;
  if (is_outdated(view)) return html`${letter}<span>Picture of the last valid settings.</span>`;
  if (view.complaint !== kNoComplaint)
    return html`${letter}<span>A preview; the picture itself is refused.</span>`;
  if (image.method === "") return html`${letter}<span>a preview of the render under way</span>`;
  const report = view.report?.id === image.id ? view.report : undefined;
  const estimate = report?.error.estimate ?? image.error.get("estimate");
  const upper_95 = report?.error.upper_95 ?? image.error.get("upper_95");
  return html`
    ${letter}
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

/// What is under way; in a comparison also that nothing is to come.
function activity_text({ activity, complaint }: PictureView, name: string): string {
  const is_refused = name !== "" && activity === "idle" && complaint !== kNoComplaint;
  const text = is_refused ? "refused by the server" : kActivityText[activity];
  return text === "" || name === "" ? text : `${name}: ${text} `;
}

/// How far the picture is, in the server's words.
function progress({ progress: told }: PictureView, name: string): TemplateResult | typeof nothing {
  if (told === undefined) return nothing;
  const { fraction, upper_95, remaining_ms, queue_place } = told;
  const of = name === "" ? "" : ` ${name}`;
  return html`<span class="number">
    ${name} <progress max="1" .value=${fraction} aria-label="Share of the picture${of} that is done"></progress>
    ${Math.floor(100 * fraction)} %
    ${queue_place === undefined ? nothing : html`; place ${queue_place} in the queue`}
    ${upper_95 === undefined ? nothing : html`; error below ${bound_size(upper_95)}`}
    ${remaining_ms === undefined ? nothing : html`; ${duration(remaining_ms)} to go`}
  </span>`;
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
