import { LitElement, css, html, nothing } from "lit";
import type { PropertyValues, TemplateResult } from "lit";
import { customElement, property, state } from "lit/decorators.js";
import type { ApiClient } from "./api_client.ts";
import type { SceneSummary } from "./contract.ts";
import { complaint_of, sentences_of } from "./faults.ts";
import kLooks from "./gallery.json";
import { kDefaultPage, page_of } from "./page_state.ts";
import type { PageState } from "./page_state.ts";
import { patiently, thumbnail_request } from "./picture_updates.ts";
import { learn_scene } from "./scene_looks.ts";
import { kBaseStyles, kControlStyles } from "./shared_styles.ts";
import { kDefaultState } from "./state.ts";
import type { PlaygroundState } from "./state.ts";

interface Entry {
  title: string;
  note: string;
  state: PlaygroundState;
}

/// All scenes and some ways to photograph them, as small pictures that the server renders one after
/// the other while the panel is open.
@customElement("fstop-gallery")
export class GalleryPanel extends LitElement {
  @property({ attribute: false }) client: ApiClient | undefined;
  @property({ attribute: false }) scenes: readonly SceneSummary[] = [];
  @property({ attribute: false }) on_show: (page: PageState) => void = () => undefined;

  @state() private pictures_: ReadonlyMap<string, string> = new Map(); // addresses, by title
  @state() private message_ = "";
  private abort_ = new AbortController();

  static override styles = [
    kBaseStyles,
    kControlStyles,
    css`
      :host {
        display: block;
      }
      h3 {
        margin: 0.9rem 0 0.4rem;
        font-size: 0.9375rem;
        font-weight: 600;
      }
      ul {
        display: grid;
        grid-template-columns: repeat(auto-fill, minmax(min(15rem, 100%), 1fr));
        gap: 0.6rem;
        margin: 0;
        padding: 0;
        list-style: none;
      }
      button {
        display: grid;
        align-content: start;
        gap: 0.2rem;
        width: 100%;
        height: 100%;
        padding: 0.5rem;
        text-align: left;
      }
      .frame {
        aspect-ratio: 3 / 2;
        background: var(--mat);
      }
      img {
        display: block;
        width: 100%;
        height: 100%;
        object-fit: cover;
      }
    `,
  ];

  override disconnectedCallback(): void {
    super.disconnectedCallback();
    this.abort_.abort();
    for (const address of this.pictures_.values()) URL.revokeObjectURL(address);
    this.pictures_ = new Map();
  }

  override updated(changed: PropertyValues<this>): void {
    if (changed.has("scenes") || changed.has("client")) void this.load_();
  }

  override render(): TemplateResult {
    return html`<h2>Gallery</h2>
      <h3>Scenes</h3>
      ${this.list_(this.of_scenes_())}
      <h3>Light and pictures</h3>
      ${this.list_(of_looks())}
      <p role="status" class="fault">${this.message_}</p>`;
  }

  private list_(entries: readonly Entry[]): TemplateResult {
    return html`<ul>
      ${entries.map(({ title, note, state: shown }) => {
        const address = this.pictures_.get(title);
        return html`<li>
          <button type="button" @click=${() => this.on_show({ ...kDefaultPage, a: shown })}>
            <span class="frame"
              >${address === undefined ? nothing : html`<img src=${address} alt="" />`}</span
            >
            <b>${title}</b><span class="muted">${note}</span>
          </button>
        </li>`;
      })}
    </ul>`;
  }

  private of_scenes_(): Entry[] {
    return this.scenes.map(({ name, title, description }) => ({
      title,
      note: description ?? "",
      state: { ...kDefaultState, scene: name, f_stop: 9 },
    }));
  }

  private async load_(): Promise<void> {
    const { client } = this;
    this.abort_.abort();
    this.abort_ = new AbortController();
    const { signal } = this.abort_;
    if (client === undefined) return;
    this.message_ = "";
    try {
      for (const { title, state: shown } of [...this.of_scenes_(), ...of_looks()]) {
        if (this.pictures_.has(title)) continue;
        const attempts = patiently(
          "refining",
          async (s) => {
            await learn_scene(client, shown, s);
            return client.render(thumbnail_request(shown), s);
          },
          signal,
        );
        for (;;) {
          const { done, value } = await attempts.next();
          if (!done) continue;
          const address = URL.createObjectURL(value.picture);
          this.pictures_ = new Map(this.pictures_).set(title, address);
          break;
        }
      }
    } catch (error) {
      if (!signal.aborted) this.message_ = sentences_of(complaint_of(error)).join(" ");
    }
  }
}

function of_looks(): Entry[] {
  return kLooks.map(({ title, note, show }) => ({ title, note, state: page_of(show).a }));
}
