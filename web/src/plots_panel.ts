import { LitElement, css, html, nothing } from "lit";
import type { PropertyValues, TemplateResult } from "lit";
import { customElement, property, state } from "lit/decorators.js";
import type { ApiClient } from "./api_client.ts";
import { StateChangeEvent } from "./changes.ts";
import type { ChartReport, Distance } from "./contract.ts";
import { complaint_of, sentences_of } from "./faults.ts";
import { segments } from "./fields.ts";
import { error_size } from "./format.ts";
import { LatestTask } from "./latest_task.ts";
import { measured_blur, measured_words, with_measured } from "./measured_blur.ts";
import type { MeasuredBlur } from "./measured_blur.ts";
import { patiently, pause } from "./picture_updates.ts";
import "./pinhole_row.ts";
import "./plot.ts";
import { blur_plot, chart_request, contrast_plot, pinhole_plot, speed_plot } from "./plot_data.ts";
import type { PlotSpec } from "./plot_spec.ts";
import { kBaseStyles, kControlStyles } from "./shared_styles.ts";
import { fragment_of, kDefaultState } from "./state.ts";
import type { PlaygroundState } from "./state.ts";

type Kind = "blur" | "contrast" | "pinhole" | "speed";
const kWavelengths_nm = [450, 550, 650];
/// The picture goes first: blur is measured once the settings rest.
const kBeforeMeasuring_ms = 500;
const kPace = { rest_ms: 150, patience_ms: 600, held_ms: 0 };

interface Question {
  kind: Kind;
  state: PlaygroundState;
  subject_m: Distance;
}

/// Plots of the present camera, made anew when it changes; the slow one only when asked for.
@customElement("fstop-plots")
export class PlotsPanel extends LitElement {
  @property({ attribute: false }) client: ApiClient | undefined;
  @property({ attribute: false }) state: PlaygroundState = kDefaultState;
  @property({ attribute: false }) subject_m: Distance = 1;

  @state() private kind_: Kind = "blur";
  @state() private plot_: { kind: Kind; of: string; spec: PlotSpec } | undefined;
  @state() private optimal_mm_ = 0;
  /// Slow to make: it stays, marked where it is of other settings.
  @state() private chart_: { of: string; report: ChartReport } | undefined;
  @state() private share_: number | undefined;
  @state() private message_ = "";
  @state() private measuring_ = "";
  @state() private asked_ = "";

  private readonly task_ = new LatestTask<Question>(async (question, signal) => {
    await this.ask_(question, signal);
  }, kPace);

  static override styles = [
    kBaseStyles,
    kControlStyles,
    css`
      :host {
        display: block;
      }
      progress {
        width: min(20rem, 100%);
        accent-color: var(--accent);
      }
      div.dim {
        padding-left: 0.6rem;
        border-left: 3px dotted var(--control);
      }
      li {
        margin-bottom: 0.3rem;
      }
    `,
  ];

  override disconnectedCallback(): void {
    super.disconnectedCallback();
    this.task_.stop();
    this.asked_ = "";
  }

  override updated(changed: PropertyValues): void {
    if (changed.has("state") || changed.has("subject_m") || changed.has("kind_")) this.follow_();
  }

  override render(): TemplateResult {
    const shown = this.shown_();
    const is_old = shown !== undefined && shown.of !== this.key_();
    return html`<h2>Plots</h2>
      ${segments(
        "plot",
        "",
        [
          { value: "blur", caption: "Blur by distance" },
          { value: "contrast", caption: "Contrast (MTF)" },
          { value: "pinhole", caption: "Pinhole size" },
          { value: "speed", caption: "Speed and accuracy" },
        ],
        this.kind_,
        (kind) => (this.kind_ = kind as Kind),
      )}
      ${this.kind_ === "pinhole" || this.kind_ === "contrast" ? this.wavelength_() : nothing}
      ${this.kind_ === "speed" ? this.speed_controls_() : nothing}
      <p class="fault" role="alert">${this.message_}</p>
      ${
        shown
          ? html`<div class=${is_old ? "dim" : ""}>
              ${
                is_old && this.kind_ === "speed"
                  ? html`<p class="stale">Of the settings before. Render again for the present ones.</p>`
                  : nothing
              }
              <fstop-plot class=${is_old ? "dim" : ""} .spec=${shown.spec}></fstop-plot>
              ${this.kind_ === "speed" && this.chart_ ? reasons(this.chart_.report) : nothing}
            </div>`
          : this.kind_ === "speed"
            ? nothing
            : html`<p class="muted">Asking the server …</p>`
      }
      ${
        this.kind_ === "pinhole" && this.optimal_mm_ > 0
          ? html`<fstop-pinhole-row
              .client=${this.client}
              .state=${this.state}
              .optimal_mm=${this.optimal_mm_}
            ></fstop-pinhole-row>`
          : nothing
      }
      ${this.kind_ === "blur" ? html`<p class="muted" role="status">${this.measuring_}</p>` : nothing}`;
  }

  private shown_(): { of: string; spec: PlotSpec } | undefined {
    if (this.kind_ !== "speed") return this.plot_?.kind === this.kind_ ? this.plot_ : undefined;
    return this.chart_ && { of: this.chart_.of, spec: speed_plot(this.chart_.report) };
  }

  private wavelength_(): TemplateResult {
    return segments(
      "wavelength",
      "Wavelength, nm",
      kWavelengths_nm.map((value) => ({ value, caption: String(value) })),
      this.state.wavelength_nm,
      (wavelength_nm) => this.dispatchEvent(new StateChangeEvent({ wavelength_nm }, true)),
    );
  }

  private speed_controls_(): TemplateResult {
    const busy = this.share_ !== undefined;
    return html`<p>
      <button type="button" ?disabled=${busy} @click=${() => this.submit_()}>
        Render by every method
      </button>
      ${
        busy
          ? html`<progress
                max="1"
                .value=${this.share_ ?? 0}
                aria-label="Share of the renders that is done"
              ></progress>
              <button type="button" @click=${() => this.stop_()}>Stop</button>`
          : html`<span class="muted">takes some seconds</span>`
      }
    </p>`;
  }

  private follow_(): void {
    const key = this.key_();
    if (key === this.asked_) return;
    this.asked_ = key;
    this.message_ = "";
    if (this.kind_ === "speed") this.stop_();
    else this.submit_();
  }

  private key_(): string {
    return key_of({ kind: this.kind_, state: this.state, subject_m: this.subject_m });
  }

  private submit_(): void {
    if (this.kind_ === "speed") this.share_ = 0;
    this.task_.submit({ kind: this.kind_, state: this.state, subject_m: this.subject_m });
  }

  private stop_(): void {
    this.task_.stop();
    this.share_ = undefined;
  }

  private async ask_(question: Question, signal: AbortSignal): Promise<void> {
    const { client } = this;
    if (client === undefined) return;
    try {
      const attempts = patiently("refining", (s) => this.answer_(client, question, s), signal);
      for (;;) {
        const { done, value } = await attempts.next();
        if (done) {
          this.message_ = "";
          break;
        }
        if (value.activity === "away") this.message_ = "The server does not answer; trying again.";
      }
    } catch (error) {
      this.measuring_ = "";
      if (!signal.aborted) this.message_ = sentences_of(complaint_of(error)).join(" ");
    } finally {
      this.share_ = undefined;
    }
  }

  /// The theory at once, then what pictures say of it.
  private async blur_(client: ApiClient, question: Question, signal: AbortSignal): Promise<void> {
    const { state } = question;
    this.measuring_ = "";
    const { plot, optics } = await blur_plot(client, state, signal);
    const points: MeasuredBlur[] = [];
    this.show_(question, with_measured(plot, points));
    await pause(kBeforeMeasuring_ms, signal);
    this.measuring_ = "Measuring blur in rendered pictures …";
    for await (const point of measured_blur(client, state, optics, signal)) {
      points.push(point);
      this.show_(question, with_measured(plot, points));
    }
    this.measuring_ = measured_words(points);
  }

  private show_(question: Question, spec: PlotSpec): void {
    this.plot_ = { kind: question.kind, of: key_of(question), spec };
  }

  private async answer_(client: ApiClient, question: Question, signal: AbortSignal): Promise<void> {
    const { kind, state, subject_m } = question;
    if (kind === "blur") return this.blur_(client, question, signal);
    if (kind === "contrast")
      return this.show_(question, await contrast_plot(client, state, subject_m, signal));
    if (kind === "speed") {
      const on_progress = (share: number): void => void (this.share_ = share);
      const report = await client.chart(chart_request(state), on_progress, signal);
      this.chart_ = { of: key_of(question), report };
      return;
    }
    const { plot, optimal_mm } = await pinhole_plot(client, state, subject_m, signal);
    this.optimal_mm_ = optimal_mm;
    this.show_(question, plot);
  }
}

/// What the plot is of.
function key_of({ kind, state, subject_m }: Question): string {
  if (kind === "speed") return `${kind} ${JSON.stringify(chart_request(state))}`;
  return `${kind} ${fragment_of(state)} ${subject_m}`;
}

/// Why the planner chose what it chose.
function reasons({ picks, refused }: ChartReport): TemplateResult {
  return html`<div class="reasons">
    ${picks.map(
      ({ max_error, method, passed_over, true_error, meets_target }) =>
        html`<h3>For an error of ${max_error}: ${method}</h3>
          <p>
            True error ${error_size(true_error.rmse_at_most)}:
            ${meets_target ? "within what was asked for." : "more than was asked for."}
          </p>
          <ul>
            ${passed_over.map((other) => html`<li><b>${other.method}</b>: ${other.why}</li>`)}
          </ul>`,
    )}
    ${refused.map(({ method, why }) => html`<p class="muted">${method} refuses: ${why}</p>`)}
  </div>`;
}
