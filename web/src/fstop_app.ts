import { LitElement, css, html } from "lit";
import type { TemplateResult } from "lit";
import { customElement, state } from "lit/decorators.js";
import { Address } from "./address.ts";
import { ApiClient } from "./api_client.ts";
import "./camera_controls.ts";
import type { StateChangeEvent } from "./camera_controls.ts";
import type { SceneSummary } from "./contract.ts";
import { complaint_of, kNoComplaint, sorted_faults } from "./faults.ts";
import type { Complaint } from "./faults.ts";
import { LatestTask } from "./latest_task.ts";
import type { Urgency } from "./latest_task.ts";
import "./optics_panel.ts";
import { kNoOptics, optics_update } from "./optics_updates.ts";
import type { OpticsView } from "./optics_updates.ts";
import "./picture_panel.ts";
import { kNoPicture, picture_updates } from "./picture_updates.ts";
import type { PictureView } from "./picture_updates.ts";
import "./report_panel.ts";
import { kBaseStyles } from "./shared_styles.ts";
import { fragment_of } from "./state.ts";
import type { PlaygroundState } from "./state.ts";
import { nominal_label } from "./third_stops.ts";

/// The playground: keeps the state, asks the server for its picture and its numbers.
@customElement("fstop-app")
export class FstopApp extends LitElement {
  private readonly address_ = new Address(window);
  private readonly client_ = new ApiClient(document.baseURI);

  @state() private state_: PlaygroundState = this.address_.state();
  @state() private scenes_: readonly SceneSummary[] = [];
  @state() private scenes_complaint_: Complaint = kNoComplaint;
  @state() private picture_: PictureView = kNoPicture;
  @state() private optics_: OpticsView = kNoOptics;

  private readonly picture_task_ = new LatestTask<PlaygroundState>(
    async (wanted, signal, has_result) => {
      for await (const update of picture_updates(this.client_, wanted, signal)) {
        this.picture_ = { ...this.picture_, ...update };
        if (update.image) has_result();
      }
    },
  );
  private readonly optics_task_ = new LatestTask<PlaygroundState>(async (wanted, signal) => {
    this.optics_ = { ...this.optics_, ...(await optics_update(this.client_, wanted, signal)) };
  });
  private leaving_ = new AbortController();

  static override styles = [
    kBaseStyles,
    css`
      :host {
        display: block;
        max-width: 100rem;
        margin: 0 auto;
        padding: 0 clamp(0.75rem, 2vw, 2rem) 2rem;
      }
      header {
        display: flex;
        flex-wrap: wrap;
        align-items: baseline;
        gap: 0 0.9rem;
        padding: 0.8rem 0 0.7rem;
      }
      h1 {
        margin: 0;
        font-size: 1.25rem;
        font-weight: 600;
        letter-spacing: -0.01em;
      }
      header p {
        margin: 0;
      }
      main {
        display: grid;
        grid-template-columns: minmax(0, 1fr);
        gap: var(--gap);
      }
      .panel {
        padding: 1rem;
        border: 1px solid var(--line);
        border-radius: var(--radius);
        background: var(--panel);
      }
      @media (max-width: 55.99rem) and (min-height: 34rem) {
        fstop-picture {
          position: sticky;
          top: 0;
          z-index: 2;
          margin: 0 calc(-1 * clamp(0.75rem, 2vw, 2rem));
          padding: 0 clamp(0.75rem, 2vw, 2rem);
          background: var(--surface);
        }
      }
      @media (min-width: 56rem) {
        main {
          grid-template-columns: minmax(0, 1fr) 20rem;
          gap: 1.25rem;
          align-items: start;
        }
        .controls {
          grid-column: 2;
          grid-row: 1 / span 2;
        }
        .below {
          grid-column: 1;
        }
      }
      .below {
        display: grid;
        grid-template-columns: repeat(auto-fit, minmax(min(20rem, 100%), 1fr));
        gap: var(--gap);
        align-items: start;
      }
    `,
  ];

  override connectedCallback(): void {
    super.connectedCallback();
    this.leaving_ = new AbortController();
    this.address_.watch((found) => this.show_(found), this.leaving_.signal);
    void this.load_scenes_();
  }

  override disconnectedCallback(): void {
    super.disconnectedCallback();
    this.leaving_.abort();
    this.picture_task_.stop();
    this.optics_task_.stop();
  }

  override render(): TemplateResult {
    const complaints = [this.scenes_complaint_, this.picture_.complaint, this.optics_.complaint];
    const { at, elsewhere } = sorted_faults(complaints.flatMap(({ faults }) => faults));
    const messages = complaints.map(({ message }) => message).filter((message) => message !== "");
    const lens = this.state_.camera === "lens";
    return html`
      <header>
        <h1>fstop</h1>
        <p class="muted">what a camera's optics do to light</p>
      </header>
      <main>
        <fstop-picture
          .view=${this.picture_}
          .description=${this.description_()}
          .messages=${[...new Set([...messages, ...elsewhere])]}
          .outdated=${this.picture_.complaint !== kNoComplaint}
          @retry=${() => void this.load_scenes_()}
        ></fstop-picture>
        <section class="panel controls" aria-label="Settings">
          <fstop-camera-controls
            .state=${this.state_}
            .scenes=${this.scenes_}
            .faults=${at}
            .optimal_diameter_mm=${this.optics_.optics?.pinhole?.optimal_diameter_mm ?? 0.35}
            @state-change=${(event: StateChangeEvent) => this.change_(event)}
          ></fstop-camera-controls>
        </section>
        <div class="below">
          <section class="panel" aria-label="Optics">
            <fstop-optics
              .optics=${this.optics_.optics}
              .focus_distance_m=${lens ? this.state_.focus_distance_m : undefined}
              .outdated=${this.optics_.complaint !== kNoComplaint}
            ></fstop-optics>
          </section>
          <section class="panel" aria-label="How the picture was made">
            <fstop-report
              .report=${this.picture_.report}
              .outdated=${this.picture_.report?.id !== this.picture_.image?.id}
            ></fstop-report>
          </section>
        </div>
      </main>
    `;
  }

  private description_(): string {
    const { shown } = this.picture_;
    if (shown === undefined) return "";
    const title = this.scenes_.find(({ name }) => name === shown.scene)?.title ?? shown.scene;
    if (shown.camera === "pinhole") return `${title} through a pinhole`;
    const { focal_length_mm, f_stop, focus_distance_m } = shown;
    const focus = focus_distance_m === "infinity" ? "infinity" : `${focus_distance_m} m`;
    const lens = `${focal_length_mm} mm lens at f/${nominal_label(f_stop)}`;
    return `${title} through a ${lens}, focused at ${focus}`;
  }

  private async load_scenes_(): Promise<void> {
    try {
      this.scenes_ = await this.client_.scenes(this.leaving_.signal);
      this.scenes_complaint_ = kNoComplaint;
      this.show_(this.state_);
    } catch (error) {
      if (!this.leaving_.signal.aborted) this.scenes_complaint_ = complaint_of(error);
    }
  }

  private change_({ detail: { change, settled } }: StateChangeEvent): void {
    const wanted = { ...this.state_, ...change };
    if (fragment_of(wanted) !== fragment_of(this.state_)) {
      this.show_(wanted, settled ? "urgent" : "patient");
    } else if (settled) {
      // A slider let go repeats its last value; what is under way for it goes on.
      this.picture_task_.hurry();
      this.optics_task_.hurry();
    }
    if (settled) this.address_.write(wanted);
  }

  /// Makes a state the present one and asks for its picture and numbers.
  private show_(wanted: PlaygroundState, urgency: Urgency = "urgent"): void {
    const scene = wanted.scene === "" ? first_scene(this.scenes_) : wanted.scene;
    this.state_ = { ...wanted, scene };
    if (scene === "") return;
    this.picture_task_.submit(this.state_, urgency);
    this.optics_task_.submit(this.state_, urgency);
  }
}

/// What a visitor sees first: the still life, or the first of other scenes.
function first_scene(scenes: readonly SceneSummary[]): string {
  return (scenes.find(({ name }) => name === "still-life") ?? scenes[0])?.name ?? "";
}
