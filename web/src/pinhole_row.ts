import { LitElement, css, html, nothing } from "lit";
import type { TemplateResult } from "lit";
import { customElement, property, state } from "lit/decorators.js";
import type { ApiClient } from "./api_client.ts";
import { complaint_of, sentences_of } from "./faults.ts";
import { quantity } from "./format.ts";
import { kBaseStyles } from "./shared_styles.ts";
import { sensor_format } from "./sensor_formats.ts";
import { camera_of, kDefaultState } from "./state.ts";
import type { PlaygroundState } from "./state.ts";

/// Of the brightest hole's diameter, from too large to too small.
const kTimes = [6, 3, 1, 0.4, 0.2];

/// The present scene through a row of holes.
@customElement("fstop-pinhole-row")
export class PinholeRow extends LitElement {
  @property({ attribute: false }) client: ApiClient | undefined;
  @property({ attribute: false }) state: PlaygroundState = kDefaultState;
  @property({ attribute: false }) optimal_mm = 0;
  @state() private pictures_: readonly { address: string; diameter_mm: number }[] = [];
  @state() private busy_ = false;
  @state() private message_ = "";
  private abort_ = new AbortController();

  static override styles = [
    kBaseStyles,
    css`
      :host {
        display: block;
        margin-top: 0.8rem;
      }
      .row {
        display: grid;
        grid-template-columns: repeat(auto-fit, minmax(8rem, 1fr));
        gap: 0.5rem;
        margin-top: 0.5rem;
      }
      figure {
        margin: 0;
        font-size: 0.8125rem;
      }
      img {
        display: block;
        width: 100%;
        border-radius: 3px;
      }
    `,
  ];

  override disconnectedCallback(): void {
    super.disconnectedCallback();
    this.abort_.abort();
    this.clear_();
  }

  override render(): TemplateResult {
    return html`<button type="button" ?disabled=${this.busy_} @click=${() => void this.make_()}>
        Photograph this scene through a row of holes
      </button>
      ${this.message_ === "" ? nothing : html`<p class="fault" role="alert">${this.message_}</p>`}
      <div class="row" aria-busy=${this.busy_ ? "true" : "false"}>
        ${this.pictures_.map(
          ({ address, diameter_mm }) =>
            html`<figure>
              <img src=${address} alt="Through a hole of ${diameter_mm} mm" />
              <figcaption>${quantity(diameter_mm, "mm")}</figcaption>
            </figure>`,
        )}
      </div>`;
  }

  private async make_(): Promise<void> {
    const { client, state } = this;
    if (client === undefined) return;
    this.clear_();
    this.abort_ = new AbortController();
    this.busy_ = true;
    this.message_ = "";
    try {
      for (const times of kTimes) {
        const diameter_mm = Number((times * this.optimal_mm).toPrecision(3));
        const camera = camera_of({ ...state, camera: "pinhole", diameter_mm });
        const image = { ...sensor_format(state.sensor).previews[0], format: "png" as const };
        const quality = { max_error: 0.02 };
        const request = { scene: state.scene, camera, image, quality };
        const { picture } = await client.render(request, this.abort_.signal);
        const address = URL.createObjectURL(picture);
        this.pictures_ = [...this.pictures_, { address, diameter_mm }];
      }
    } catch (error) {
      if (!this.abort_.signal.aborted) this.message_ = sentences_of(complaint_of(error)).join(" ");
    } finally {
      this.busy_ = false;
    }
  }

  private clear_(): void {
    for (const { address } of this.pictures_) URL.revokeObjectURL(address);
    this.pictures_ = [];
  }
}
