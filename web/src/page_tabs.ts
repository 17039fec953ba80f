/// What lies below the picture, one part at a time. Parts are loaded when they are first opened.
import { html } from "lit";
import type { TemplateResult } from "lit";
import type { ApiClient } from "./api_client.ts";
import type { SceneSummary } from "./contract.ts";
import { kNoComplaint } from "./faults.ts";
import "./optics_panel.ts";
import type { OpticsView } from "./optics_updates.ts";
import type { PageState } from "./page_state.ts";
import type { PictureView } from "./picture_updates.ts";
import "./report_panel.ts";
import type { PlaygroundState } from "./state.ts";

export type Tab = "gallery" | "optics" | "plots" | "experiments" | "report" | "share";

const kThere = (): Promise<unknown> => Promise.resolve();
export const kTabs: Readonly<Record<Tab, { caption: string; load: () => Promise<unknown> }>> = {
  optics: { caption: "Optics", load: kThere },
  gallery: { caption: "Gallery", load: () => import("./gallery_panel.ts") },
  plots: { caption: "Plots", load: () => import("./plots_panel.ts") },
  experiments: { caption: "Experiments", load: () => import("./experiments_panel.ts") },
  report: { caption: "How it was made", load: kThere },
  share: { caption: "Share and export", load: () => import("./share_panel.ts") },
};
const kNames = Object.keys(kTabs) as Tab[];

/// What the parts show.
export interface TabContent {
  client: ApiClient;
  scenes: readonly SceneSummary[];
  state: PlaygroundState;
  page: PageState;
  optics: OpticsView;
  view: PictureView;
  on_show: (page: PageState) => void;
}

export function tab_row(chosen: Tab, on_choice: (tab: Tab) => void): TemplateResult {
  const move = (event: KeyboardEvent): void => {
    const by = event.key === "ArrowRight" ? 1 : event.key === "ArrowLeft" ? -1 : 0;
    // From where the keys are: what is chosen shows once its part is loaded.
    const from = kNames.indexOf((event.target as HTMLElement).id.replace("tab-", "") as Tab);
    const next = kNames[(from + by + kNames.length) % kNames.length];
    if (by === 0 || next === undefined) return;
    event.preventDefault();
    const row = event.currentTarget as HTMLElement;
    row.querySelector<HTMLElement>(`#tab-${next}`)?.focus();
    on_choice(next);
  };
  return html`<div class="tabs" role="tablist" aria-label="More about this picture" @keydown=${move}>
    ${kNames.map(
      (name) =>
        html`<button
          type="button"
          role="tab"
          id="tab-${name}"
          aria-selected=${name === chosen ? "true" : "false"}
          aria-controls="tab-panel"
          tabindex=${name === chosen ? 0 : -1}
          @click=${() => on_choice(name)}
        >
          ${kTabs[name].caption}
        </button>`,
    )}
  </div>`;
}

export function tab_body(tab: Tab, content: TabContent): TemplateResult {
  const { client, scenes, state, page, optics, view, on_show } = content;
  switch (tab) {
    case "optics":
      return html`<fstop-optics
        .optics=${optics.optics}
        .focus_distance_m=${optics.of?.camera === "pinhole" ? undefined : optics.of?.focus_distance_m}
        .outdated=${optics.complaint !== kNoComplaint}
      ></fstop-optics>`;
    case "gallery":
      return html`<fstop-gallery
        .client=${client}
        .scenes=${scenes}
        .on_show=${on_show}
      ></fstop-gallery>`;
    case "plots":
      return html`<fstop-plots
        .client=${client}
        .state=${state}
        .subject_m=${page.subject_m}
      ></fstop-plots>`;
    case "experiments":
      return html`<fstop-experiments
        .client=${client}
        .page=${page}
        .on_show=${on_show}
      ></fstop-experiments>`;
    case "report":
      return html`<fstop-report
        .report=${view.report}
        .outdated=${view.report?.id !== view.image?.id}
      ></fstop-report>`;
    case "share":
      return html`<fstop-share
        .client=${client}
        .state=${state}
        .page=${page}
        .optics=${optics}
        .view=${view}
      ></fstop-share>`;
  }
}
