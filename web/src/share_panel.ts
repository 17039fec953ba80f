import { LitElement, css, html, nothing } from "lit";
import type { TemplateResult } from "lit";
import { customElement, property, state } from "lit/decorators.js";
import type { ApiClient } from "./api_client.ts";
import { kNoComplaint } from "./faults.ts";
import { save_text } from "./files.ts";
import { kept_picture, present_optics } from "./kept_picture.ts";
import { kNoOptics } from "./optics_updates.ts";
import type { OpticsView } from "./optics_updates.ts";
import { kDefaultPage, page_fragment } from "./page_state.ts";
import type { PageState } from "./page_state.ts";
import { kNoPicture, render_request } from "./picture_updates.ts";
import type { PictureView } from "./picture_updates.ts";
import { csv_of } from "./plot_spec.ts";
import { kBaseStyles } from "./shared_styles.ts";
import { curl_command, python_program } from "./snippets.ts";
import { kDefaultState } from "./state.ts";
import type { PlaygroundState } from "./state.ts";

const kFormats = ["png", "exr", "tiff", "jpeg", "webp"] as const;

/// The link to what is seen, its files, and the same request as commands.
@customElement("fstop-share")
export class SharePanel extends LitElement {
  @property({ attribute: false }) client: ApiClient | undefined;
  @property({ attribute: false }) state: PlaygroundState = kDefaultState;
  @property({ attribute: false }) page: PageState = kDefaultPage;
  @property({ attribute: false }) optics: OpticsView = kNoOptics;
  @property({ attribute: false }) view: PictureView = kNoPicture;
  @state() private said_ = "";

  static override styles = [
    kBaseStyles,
    css`
      :host {
        display: block;
      }
      h3 {
        margin: 0.9rem 0 0.3rem;
        font-size: 0.9375rem;
        font-weight: 600;
      }
      .row {
        display: flex;
        flex-wrap: wrap;
        gap: 0.5rem;
        align-items: center;
      }
      pre {
        overflow: auto;
        max-height: 16rem;
        margin: 0 0 0.4rem;
        padding: 0.6rem;
        border: 1px solid var(--line);
        border-radius: var(--radius);
        background: var(--mat);
        font-size: 0.8125rem;
      }
    `,
  ];

  override render(): TemplateResult {
    const request = render_request(this.state);
    const link = new URL(page_fragment(this.page), document.baseURI).href;
    const refused = this.view.complaint !== kNoComplaint;
    return html`<h2>Share and export</h2>
      <h3>Link</h3>
      <p>
        The address of this page is the request${this.page.b ? ": both requests" : ""}. Who opens it
        ${refused ? "is refused the same." : "sees the same picture, to the last bit."}
      </p>
      ${this.copied_("link", link)}
      <h3>Files</h3>
      ${this.files_()}
      ${
        refused
          ? html`<p class="muted waits">Commands come when the server takes the settings.</p>`
          : html`<h3>The same request as a command</h3>
              ${this.copied_("curl", curl_command(document.baseURI, request))}
              <h3>The same request in Python</h3>
              ${this.copied_("python", python_program(document.baseURI, request))}`
      }
      <p role="status" class="muted">${this.said_}</p>`;
  }

  private files_(): TemplateResult {
    const kept = kept_picture(this.view, this.state);
    const optics = present_optics(this.optics, this.state);
    return html`<div class="row">
      ${
        "id" in kept
          ? kFormats.map(
              (format) =>
                html`<a
                  class="button"
                  href=${this.client?.picture_address(kept.id, format) ?? ""}
                  download="fstop.${format}"
                  >${format.toUpperCase()}</a
                >`,
            )
          : html`<span class="muted waits">${kept.waits_for}</span>`
      }
      ${
        optics
          ? html`<button
              type="button"
              @click=${() => save_text("optics.csv", "text/csv", optics_csv(optics))}
            >
              CSV of the optics
            </button>`
          : nothing
      }
      <span class="muted">
        EXR has depth and blur of every pixel. Plots save themselves as SVG and CSV.
      </span>
    </div>`;
  }

  private copied_(name: string, text: string): TemplateResult {
    return html`<pre class=${name} tabindex="0" role="region" aria-label=${name}>${text}</pre>
      <button type="button" @click=${() => void this.copy_(name, text)}>Copy ${name}</button>`;
  }

  private async copy_(name: string, text: string): Promise<void> {
    try {
      await navigator.clipboard.writeText(text);
      this.said_ = `The ${name} is in the clipboard.`;
    } catch {
      this.said_ = "This browser does not let the page copy; mark the text and copy it yourself.";
    }
  }
}

function optics_csv({ at }: NonNullable<OpticsView["optics"]>): string {
  return csv_of({
    columns: ["object_distance_m", "image_distance_mm", "coc_mm", "coc_px"],
    rows: at.map((row) =>
      [row.object_distance_m, row.image_distance_mm, row.coc_mm, row.coc_px].map(String),
    ),
  });
}
