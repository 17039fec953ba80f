import { LitElement, html, nothing } from "lit";
import type { TemplateResult } from "lit";
import { customElement, state } from "lit/decorators.js";
import { Address } from "./address.ts";
import { ApiClient } from "./api_client.ts";
import { kAppStyles } from "./app_styles.ts";
import "./camera_controls.ts";
import type { PickEvent, StateChangeEvent, SubjectMoveEvent } from "./changes.ts";
import type { SceneSummary } from "./contract.ts";
import { complaint_of, kNoComplaint, sentences_of, sorted_faults } from "./faults.ts";
import type { Complaint } from "./faults.ts";
import { segments } from "./fields.ts";
import { LatestTask } from "./latest_task.ts";
import type { Urgency } from "./latest_task.ts";
import { kNoOptics, kNumbersPace, optics_update } from "./optics_updates.ts";
import type { OpticsQuestion, OpticsView } from "./optics_updates.ts";
import { page_fragment } from "./page_state.ts";
import type { PageState } from "./page_state.ts";
import { kTabs, tab_body, tab_row } from "./page_tabs.ts";
import type { Tab } from "./page_tabs.ts";
import "./picture_panel.ts";
import type { Message } from "./picture_panel.ts";
import { PictureSide } from "./picture_side.ts";
import { patiently, pause } from "./picture_updates.ts";
import { PreviewPace } from "./preview_pace.ts";
import { kBaseStyles, kControlStyles } from "./shared_styles.ts";
import "./side_view_panel.ts";
import { fragment_of, rounded, with_consequences } from "./state.ts";
import type { PlaygroundState } from "./state.ts";
import { description_of, summary_of } from "./words.ts";

type Side = "a" | "b";

const kAskAgainMs = 1000;

/// The playground: keeps the state, asks the server for its pictures and its numbers.
@customElement("fstop-app")
export class FstopApp extends LitElement {
  private readonly address_ = new Address(window);
  private readonly client_ = new ApiClient(document.baseURI);

  @state() private page_: PageState = this.address_.page();
  @state() private editing_: Side = "a";
  @state() private scenes_: readonly SceneSummary[] = [];
  @state() private scenes_complaint_: Complaint = kNoComplaint;
  /// What the link says that is no setting of the page.
  @state() private misread_: readonly string[] = this.address_.misread();
  @state() private optics_: OpticsView = kNoOptics;
  private wanted_: Tab = "optics"; // the tab that was asked for last
  @state() private tab_: Tab = this.page_.experiment === "" ? "optics" : "experiments";

  private readonly pace_ = new PreviewPace();
  @state() private sides_: Readonly<Record<Side, PictureSide>> = {
    a: this.picture_side_(),
    b: this.picture_side_(),
  };
  private readonly optics_task_ = new LatestTask<OpticsQuestion>(async (wanted, signal) => {
    this.optics_ = { ...this.optics_, ...(await optics_update(this.client_, wanted, signal)) };
  }, kNumbersPace);
  private optics_asked_ = "";
  private leaving_ = new AbortController();

  static override styles = [kBaseStyles, kControlStyles, kAppStyles];

  private picture_side_(): PictureSide {
    return new PictureSide(this.client_, this.pace_, () => this.requestUpdate());
  }

  override connectedCallback(): void {
    super.connectedCallback();
    this.leaving_ = new AbortController();
    this.address_.watch((found) => {
      this.misread_ = this.address_.misread();
      this.show_(found);
    }, this.leaving_.signal);
    void this.load_scenes_();
  }

  override disconnectedCallback(): void {
    super.disconnectedCallback();
    this.leaving_.abort();
    for (const task of [this.sides_.a, this.sides_.b, this.optics_task_]) task.stop();
  }

  override render(): TemplateResult {
    const edited = this.edited_();
    const { a, b } = this.sides_;
    const { view } = this.sides_[this.editing_];
    const { at, elsewhere } = sorted_faults(
      [view, this.optics_].flatMap(({ complaint }) => complaint.faults),
    );
    const { page_: page } = this;
    return html`
      <header>
        <h1>fstop</h1>
        <p class="muted">what a camera's optics do to light</p>
      </header>
      <main
        @state-change=${(event: StateChangeEvent) => this.change_(event)}
        @subject-move=${(event: SubjectMoveEvent) => this.move_subject_(event)}
        @pick=${(event: PickEvent) => this.pick_(event)}
      >
        <section class="picture" aria-label="Picture">
          ${this.compare_()}
          <fstop-picture
            .view=${a.view}
            .other=${page.b ? b.view : undefined}
            .comparison=${page.comparison}
            .description=${description_of(a.view.shown, this.scenes_)}
            .other_description=${description_of(b.view.shown, this.scenes_)}
            .point=${page.point}
            .coc_limit_mm=${this.optics_.optics?.coc_limit_mm ?? 0}
            .messages=${this.messages_(elsewhere)}
            @retry=${() => this.retry_()}
          ></fstop-picture>
          <p class="summary number" role="status">${this.summary_()}</p>
        </section>
        <section class="panel controls" aria-label="Settings">
          <fstop-camera-controls
            .state=${edited}
            .scenes=${this.scenes_}
            .faults=${at}
            .optimal_diameter_mm=${this.optics_.optics?.pinhole.diameter_mm ?? 0.35}
          ></fstop-camera-controls>
        </section>
        <section class="panel side" aria-label="Side view">
          <fstop-side-view
            .state=${edited}
            .optics=${this.optics_.optics}
            .numbers_of=${this.optics_.of}
            .subject_m=${this.optics_.subject_m ?? page.subject_m}
          ></fstop-side-view>
        </section>
        <section class="below" aria-label="More">
          ${tab_row(this.tab_, (tab) => void this.open_(tab))}
          <div class="panel" role="tabpanel" id="tab-panel" aria-labelledby="tab-${this.tab_}">
            ${tab_body(this.tab_, {
              client: this.client_,
              scenes: this.scenes_,
              state: edited,
              page,
              optics: this.optics_,
              view,
              on_show: (wanted) => this.settle_(wanted),
            })}
          </div>
        </section>
      </main>
    `;
  }

  /// Two requests side by side: which one the controls are for, and how they are compared.
  private compare_(): TemplateResult {
    const { b, comparison } = this.page_;
    if (b === undefined)
      return html`<div class="compare">
        <button type="button" @click=${() => this.compare_with_copy_()}>Compare A and B</button>
        <span class="muted">keeps this picture as A and lets you change B</span>
      </div>`;
    return html`<div class="compare">
      ${segments(
        "editing",
        "Settings of",
        [
          { value: "a", caption: "A" },
          { value: "b", caption: "B" },
        ],
        this.editing_,
        (side) => this.edit_(side as Side),
      )}
      ${segments(
        "comparison",
        "as",
        [
          { value: "wipe", caption: "wipe" },
          { value: "difference", caption: "difference" },
        ],
        comparison,
        (wanted) => this.settle_({ ...this.page_, comparison: wanted as PageState["comparison"] }),
      )}
      <button type="button" @click=${() => this.swap_()}>
        Swap
      </button>
      <button type="button" @click=${() => this.end_comparison_()}>Keep only A</button>
    </div>`;
  }

  /// What no control shows, each once: of the request that is edited what is left, of the other all.
  private messages_(elsewhere: readonly string[]): Message[] {
    const messages = new Map(elsewhere.map((text) => [text, false]));
    const { scenes_complaint_: scenes, optics_: optics, sides_: sides } = this;
    for (const { message, may_pass } of [scenes, sides[this.editing_].view.complaint, optics.complaint])
      if (message !== "") messages.set(message, may_pass);
    if (this.page_.b) {
      const other = this.editing_ === "a" ? "b" : "a";
      const { complaint } = sides[other].view;
      for (const sentence of sentences_of(complaint))
        messages.set(`${other.toUpperCase()}: ${sentence}`, complaint.may_pass);
    }
    if (this.misread_.length > 0) messages.set(misread_text(this.misread_), false);
    return [...messages].map(([text, may_pass]) => ({ text, may_pass }));
  }

  private summary_(): TemplateResult | typeof nothing {
    const { optics, of, subject_m } = this.optics_;
    if (!optics || !of || subject_m === undefined) return nothing;
    return html`${summary_of(of, optics, subject_m)}`;
  }

  private edited_(): PlaygroundState {
    return (this.editing_ === "b" ? this.page_.b : undefined) ?? this.page_.a;
  }

  private compare_with_copy_(): void {
    this.sides_.b.begin_with(this.sides_.a.view);
    this.editing_ = "b";
    this.settle_({ ...this.page_, b: this.page_.a });
  }

  private end_comparison_(): void {
    this.editing_ = "a";
    this.settle_({ ...this.page_, b: undefined });
  }

  /// Pictures, progress and refusals go with their requests.
  private swap_(): void {
    const { a, b } = this.page_;
    if (b === undefined) return;
    this.sides_ = { a: this.sides_.b, b: this.sides_.a };
    this.leave_refusal_();
    this.settle_({ ...this.page_, a: b, b: a });
  }

  private edit_(side: Side): void {
    this.editing_ = side;
    this.leave_refusal_();
    this.show_(this.page_);
  }

  /// What the server said of one request's optics is nothing about the other's.
  private leave_refusal_(): void {
    this.optics_ = { ...this.optics_, complaint: kNoComplaint };
  }

  private async open_(tab: Tab): Promise<void> {
    this.wanted_ = tab;
    // The server may be away: its page is asked for again until it comes, or another is wanted.
    for (;;) {
      try {
        await kTabs[tab].load();
        break;
      } catch {
        await pause(kAskAgainMs, this.leaving_.signal).catch(() => undefined);
      }
      if (this.wanted_ !== tab || this.leaving_.signal.aborted) return;
    }
    if (this.wanted_ !== tab) return;
    this.tab_ = tab;
    if (tab !== "experiments" && this.page_.experiment !== "")
      this.settle_({ ...this.page_, experiment: "" });
  }

  private async load_scenes_(): Promise<void> {
    const { signal } = this.leaving_;
    void kTabs[this.tab_].load().then(() => this.requestUpdate());
    try {
      const attempts = patiently("refining", (s) => this.client_.scenes(s), signal);
      for (;;) {
        const { done, value } = await attempts.next();
        if (done) {
          this.scenes_ = value;
          break;
        }
        this.sides_.a.take(value);
      }
      this.scenes_complaint_ = kNoComplaint;
      this.show_(this.page_);
    } catch (error) {
      if (!signal.aborted) this.scenes_complaint_ = complaint_of(error);
    }
  }

  private retry_(): void {
    this.optics_asked_ = "";
    for (const side of Object.values(this.sides_)) side.forget();
    void this.load_scenes_();
  }

  private change_({ detail: { change, settled } }: StateChangeEvent): void {
    const before = this.edited_();
    const wanted = with_consequences(before, change);
    const page = this.page_with_(wanted);
    if (fragment_of(wanted) !== fragment_of(before)) {
      this.show_(page, settled ? "urgent" : "patient");
    } else if (settled) {
      // A slider let go repeats its last value; what is under way for it goes on.
      for (const task of [this.sides_.a, this.sides_.b, this.optics_task_]) task.hurry();
    }
    if (settled) this.write_(page);
  }

  /// The subject stays where it is in the scene: the camera goes nearer or farther.
  private move_subject_({ detail: { subject_m, settled } }: SubjectMoveEvent): void {
    const from_m = this.page_.subject_m;
    const by_m = from_m === "infinity" || subject_m === "infinity" ? 0 : subject_m - from_m;
    const state = this.edited_();
    const moved = { ...state, camera_z_m: rounded(state.camera_z_m + by_m) };
    const page = { ...this.page_with_(moved), subject_m, point: undefined };
    this.show_(page, settled ? "urgent" : "patient");
    if (settled) this.write_(page);
  }

  private pick_({ detail: { point, distance_m, focus, side } }: PickEvent): void {
    if (this.page_.b && this.page_.comparison === "wipe") this.editing_ = side;
    const state = this.edited_();
    const focused = focus && state.camera === "lens";
    const wanted = focused ? { ...state, focus_distance_m: distance_m } : state;
    this.settle_({ ...this.page_with_(wanted), point, subject_m: distance_m });
  }

  private page_with_(wanted: PlaygroundState): PageState {
    return this.editing_ === "b" && this.page_.b
      ? { ...this.page_, b: wanted }
      : { ...this.page_, a: wanted };
  }

  private settle_(page: PageState): void {
    this.show_(page);
    this.write_(this.page_);
  }

  /// The link is now the page's own, and has nothing in it that is not understood.
  private write_(page: PageState): void {
    this.address_.write(page);
    this.misread_ = [];
  }

  /// Makes a state the present one and asks for what is new in it.
  private show_(wanted: PageState, urgency: Urgency = "urgent"): void {
    const named = (state: PlaygroundState): PlaygroundState =>
      state.scene === "" ? { ...state, scene: first_scene(this.scenes_) } : state;
    const page = { ...wanted, a: named(wanted.a), b: wanted.b && named(wanted.b) };
    this.page_ = page;
    if (!page.b) {
      this.editing_ = "a";
      this.sides_.b.stop();
    }
    if (page.a.scene === "") return;
    const { b, subject_m } = page;
    const edited = this.edited_();
    this.sides_.a.ask(page.a, urgency);
    if (b) this.sides_.b.ask(b, urgency);
    const question = page_fragment({ ...page, a: edited, b: undefined, point: undefined });
    if (this.optics_asked_ === question) return;
    this.optics_asked_ = question;
    this.optics_task_.submit({ state: edited, subject_m }, urgency);
  }
}

function misread_text(parts: readonly string[]): string {
  return `The link says what this page does not understand and leaves out: ${parts.join(", ")}.`;
}

/// What a visitor sees first: the still life, or the first of other scenes.
function first_scene(scenes: readonly SceneSummary[]): string {
  return (scenes.find(({ name }) => name === "still-life") ?? scenes[0])?.name ?? "";
}
