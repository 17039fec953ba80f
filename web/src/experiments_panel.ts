import { LitElement, css, html, nothing } from "lit";
import type { PropertyValues, TemplateResult } from "lit";
import { customElement, property, state } from "lit/decorators.js";
import type { ApiClient } from "./api_client.ts";
import { answer_of, measured, page_of_step, right_choice, worded } from "./experiment.ts";
import type { Experiment, Measured, Step } from "./experiment.ts";
import { kExperiments } from "./experiments/index.ts";
import { complaint_of, sentences_of } from "./faults.ts";
import { kDefaultPage } from "./page_state.ts";
import type { PageState } from "./page_state.ts";
import { patiently } from "./picture_updates.ts";
import type { Activity } from "./picture_updates.ts";
import { kBaseStyles, kControlStyles } from "./shared_styles.ts";

const kActivityText: Readonly<Record<Activity, string>> = {
  idle: "",
  preview: "Measuring …",
  refining: "Measuring …",
  waiting: "The server is busy; measuring goes on when it has room.",
  away: "The server does not answer; measuring goes on when it is back.",
};

/// From here on it says how long it takes already: a server may be there and still not answer.
const kSlow_s = 5;

/// A list of experiments, or the one that the page holds, step by step.
@customElement("fstop-experiments")
export class ExperimentsPanel extends LitElement {
  @property({ attribute: false }) client: ApiClient | undefined;
  @property({ attribute: false }) page: PageState = kDefaultPage;
  @property({ attribute: false }) on_show: (page: PageState) => void = () => undefined;

  @state() private guess_: number | undefined;
  @state() private numbers_: Measured | undefined;
  @state() private activity_: Activity = "idle";
  @state() private waited_s_ = 0;
  @state() private message_ = "";
  private abort_ = new AbortController();

  static override styles = [
    kBaseStyles,
    kControlStyles,
    css`
      :host {
        display: block;
      }
      .list {
        display: grid;
        grid-template-columns: repeat(auto-fill, minmax(min(17rem, 100%), 1fr));
        gap: 0.6rem;
        margin: 0;
        padding: 0;
        list-style: none;
      }
      .list button {
        display: grid;
        align-content: start;
        width: 100%;
        height: 100%;
        padding: 0.7rem;
        text-align: left;
      }
      .list b,
      .list span {
        display: block;
      }
      h3 {
        margin: 0 0 0.3rem;
        font-size: 1.0625rem;
      }
      .text {
        max-width: 44rem;
      }
      .choices {
        display: grid;
        gap: 0.35rem;
        margin: 0.5rem 0;
        max-width: 44rem;
      }
      .choices button {
        text-align: left;
      }
      .choices .right {
        border-color: var(--sharp-line);
        box-shadow: inset 4px 0 var(--sharp-line);
      }
      .choices .wrong {
        border-color: var(--fault);
        box-shadow: inset 4px 0 var(--fault);
      }
      table {
        margin: 0.6rem 0;
        border-collapse: collapse;
      }
      th,
      td {
        padding: 0.2rem 1rem 0.2rem 0;
        border-bottom: 1px solid var(--line);
        text-align: left;
        font-weight: 400;
      }
      td {
        font-variant-numeric: tabular-nums;
      }
      nav {
        display: flex;
        flex-wrap: wrap;
        gap: 0.5rem;
        margin-top: 0.8rem;
      }
    `,
  ];

  override disconnectedCallback(): void {
    super.disconnectedCallback();
    this.abort_.abort();
  }

  override willUpdate(changed: PropertyValues<this>): void {
    const before = changed.get("page");
    const { experiment, step } = this.page;
    if (before && (before.experiment !== experiment || before.step !== step)) this.begin_();
  }

  override render(): TemplateResult {
    const name = this.page.experiment;
    const experiment = kExperiments.get(name);
    return html`<h2>Experiments</h2>
      ${
        name !== "" && !experiment
          ? html`<p class="fault">The link names an experiment that is not here: ${name}.</p>`
          : nothing
      }
      ${experiment ? this.open_(experiment) : this.list_()}`;
  }

  private list_(): TemplateResult {
    return html`<ul class="list">
      ${[...kExperiments].map(
        ([name, { title, summary }]) =>
          html`<li>
            <button type="button" @click=${() => this.show_step_(name, 0)}>
              <b>${title}</b><span class="muted">${summary}</span>
            </button>
          </li>`,
      )}
    </ul>`;
  }

  private open_(experiment: Experiment): TemplateResult {
    const at = Math.min(this.page.step, experiment.steps.length - 1);
    const step = experiment.steps[at];
    const last = at === experiment.steps.length - 1;
    const name = this.page.experiment;
    if (step === undefined) return html``;
    return html`<h3>${experiment.title}</h3>
      <p class="muted">Step ${at + 1} of ${experiment.steps.length}</p>
      <p class="text">${step.text}</p>
      <p class="text"><b>${step.question}</b></p>
      <div class="choices" role="group" aria-label="Answers">
        ${step.choices.map((choice, i) => this.choice_(step, choice, i))}
      </div>
      <div aria-live="polite" aria-busy=${this.activity_ === "idle" ? "false" : "true"}>
        ${
          this.activity_ === "idle"
            ? nothing
            : html`<p class="muted activity">
                ${kActivityText[this.activity_]}${
                  this.waited_s_ < kSlow_s
                    ? nothing
                    : html`<span aria-hidden="true"> ${this.waited_s_} s</span>`
                }
              </p>`
        }
        ${this.message_ === "" ? nothing : html`<p class="fault">${this.message_}</p>`}
        ${this.numbers_ ? this.answer_(step, this.numbers_) : nothing}
      </div>
      <nav aria-label="Steps">
        <button type="button" @click=${() => this.show_step_(name, at)}>
          Show this step's settings
        </button>
        <button
          type="button"
          ?disabled=${at === 0}
          @click=${() => this.show_step_(name, at - 1)}
        >
          Back
        </button>
        <button
          type="button"
          ?disabled=${last}
          @click=${() => this.show_step_(name, at + 1)}
        >
          Next step
        </button>
        <button type="button" @click=${() => this.on_show({ ...this.page, experiment: "" })}>
          All experiments
        </button>
      </nav>`;
  }

  private choice_(step: Step, choice: string, i: number): TemplateResult {
    const right = this.numbers_ && right_choice(step.right, this.numbers_) === i;
    const wrong = this.numbers_ && !right && this.guess_ === i;
    return html`<button
      type="button"
      class=${right ? "right" : wrong ? "wrong" : ""}
      aria-pressed=${this.guess_ === i ? "true" : "false"}
      ?disabled=${this.activity_ !== "idle"}
      @click=${() => void this.guess_at_(step, i)}
    >
      ${choice}
    </button>`;
  }

  private answer_(step: Step, numbers: Measured): TemplateResult {
    const right = right_choice(step.right, numbers);
    return html`<p class="text">
        <b>${this.guess_ === right ? "Right." : `No: ${step.choices[right] ?? ""}.`}</b>
        ${answer_of(step, numbers)}
      </p>
      <table>
        <caption class="muted">Measured by the server just now</caption>
        <tbody>
          ${step.measure.map(
            ({ name, label, unit }) =>
              html`<tr>
                <th scope="row">${label}</th>
                <td data-name=${name}>${worded(numbers.get(name), unit)}</td>
              </tr>`,
          )}
        </tbody>
      </table>`;
  }

  private show_step_(name: string, at: number): void {
    const step = kExperiments.get(name)?.steps[at];
    if (step === undefined) return;
    this.begin_();
    this.on_show(page_of_step(step, name, at));
  }

  private begin_(): void {
    this.abort_.abort();
    this.guess_ = undefined;
    this.numbers_ = undefined;
    this.message_ = "";
    this.activity_ = "idle";
  }

  private async guess_at_(step: Step, choice: number): Promise<void> {
    const { client } = this;
    this.guess_ = choice;
    if (client === undefined || this.numbers_) return;
    this.abort_.abort();
    this.abort_ = new AbortController();
    const { signal } = this.abort_;
    const begun_ms = performance.now();
    const timer = setInterval(() => {
      this.waited_s_ = Math.round((performance.now() - begun_ms) / 1000);
    }, 1000);
    this.waited_s_ = 0;
    this.message_ = "";
    try {
      const attempts = patiently("refining", (s) => measured(client, step, s), signal);
      for (;;) {
        const { done, value } = await attempts.next();
        if (signal.aborted) return;
        if (done) {
          this.numbers_ = value;
          break;
        }
        this.activity_ = value.activity ?? this.activity_;
      }
    } catch (error) {
      if (!signal.aborted) this.message_ = sentences_of(complaint_of(error)).join(" ");
    } finally {
      clearInterval(timer);
      if (!signal.aborted) this.activity_ = "idle";
    }
  }
}
