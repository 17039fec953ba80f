import { LitElement, html, nothing } from "lit";
import type { PropertyValues, TemplateResult } from "lit";
import { customElement, property, query, state } from "lit/decorators.js";
import { PickEvent } from "./changes.ts";
import type { Distance, ImageSize } from "./contract.ts";
import { value_at } from "./exr.ts";
import { quantity } from "./format.ts";
import { place_within, same_shape } from "./letterbox.ts";
import type { Comparison, PicturePoint } from "./page_state.ts";
import { kStageStyles } from "./picture_stage_styles.ts";
import type { HeldLayers } from "./picture_updates.ts";
import { blur_colours, difference_of, pixels_of } from "./pixels.ts";
import { kBaseStyles } from "./shared_styles.ts";

export const kDifferenceGain = 4;
const kNothingHeld: HeldLayers = { layers: undefined, blur_holds: false };
const kLoupe_px = 176;
const kReadRest_ms = 100;
const kStep = 0.01;
const kArrows: ReadonlyMap<string, readonly [number, number]> = new Map([
  ["ArrowLeft", [-1, 0]],
  ["ArrowRight", [1, 0]],
  ["ArrowUp", [0, -1]],
  ["ArrowDown", [0, 1]],
]);

/// How two pictures differ, for who shows them.
export class DifferenceEvent extends CustomEvent<{ mean: number; largest: number }> {
  constructor(mean: number, largest: number) {
    super("difference", { detail: { mean, largest } });
  }
}

/// The picture to point at: values under the pointer, a click or a key chooses a place; with a
/// second picture a wipe or the difference.
@customElement("fstop-stage")
export class PictureStage extends LitElement {
  @property({ attribute: false }) picture: Blob | undefined;
  @property({ attribute: false }) other: Blob | undefined;
  @property({ attribute: false }) comparison: Comparison = "wipe";
  @property({ attribute: false }) held: HeldLayers = kNothingHeld;
  @property({ attribute: false }) other_held: HeldLayers = kNothingHeld;
  @property({ attribute: false }) size: ImageSize = { width: 960, height: 640 };
  @property({ attribute: false }) other_size: ImageSize = { width: 960, height: 640 };
  @property({ attribute: false }) description = "";
  @property({ attribute: false }) other_description = "";
  @property({ attribute: false }) point: PicturePoint | undefined;
  @property({ attribute: false }) limit_share = 0; // of the picture's width, still sharp
  @property({ type: Boolean }) overlay = false;
  @property({ attribute: false }) zoom = 0; // of the loupe; 0: no loupe
  @property({ type: Boolean }) inspect = false; // a click looks and leaves the focus
  @property({ type: Boolean }) busy = false;
  @property({ type: Boolean }) is_soon = false; // what is busy takes but a moment
  @property({ type: Boolean, reflect: true }) outdated = false;
  @property({ type: Boolean, reflect: true }) other_outdated = false;

  @state() private source_ = "";
  @state() private other_source_ = "";
  @state() private wipe_ = 50; // per cent from the left
  @state() private cursor_: PicturePoint | undefined;
  @state() private by_key_ = false;
  @state() private pixels_: ImageData | undefined;
  private pixels_of_: Blob | undefined; // the picture that was read
  private other_pixels_: ImageData | undefined;
  private read_timer_: ReturnType<typeof setTimeout> | undefined;
  private reading_ = 0;

  @query(".overlay") private overlay_canvas_!: HTMLCanvasElement | null;
  @query(".difference") private difference_canvas_!: HTMLCanvasElement | null;
  @query(".loupe") private loupe_canvas_!: HTMLCanvasElement | null;

  static override styles = [kBaseStyles, kStageStyles];

  override willUpdate(changed: PropertyValues<this>): void {
    if (changed.has("picture")) this.source_ = address_of(this.picture, this.source_);
    if (changed.has("other")) this.other_source_ = address_of(this.other, this.other_source_);
    if (changed.has("picture") || changed.has("other")) this.read_soon_();
  }

  override disconnectedCallback(): void {
    super.disconnectedCallback();
    clearTimeout(this.read_timer_);
    this.source_ = address_of(undefined, this.source_);
    this.other_source_ = address_of(undefined, this.other_source_);
  }

  override render(): TemplateResult {
    const difference = this.other_source_ !== "" && this.comparison === "difference";
    const wipe = this.other_source_ !== "" && this.comparison === "wipe";
    this.style.setProperty("--ratio", String(this.size.width / this.size.height));
    this.style.setProperty("--wipe", `${this.wipe_}%`);
    return html`<div
        class="frame ${this.busy && !this.is_soon ? "busy" : ""}"
        aria-busy=${this.busy ? "true" : "false"}
      >
        ${
          this.source_ === ""
            ? html`<div class="empty">${this.busy ? "Rendering …" : "No picture yet"}</div>`
            : html`<img src=${this.source_} alt=${this.description} />`
        }
        ${
          wipe
            ? html`<img class="other" src=${this.other_source_} alt=${this.other_description} />
                <span class="tag" aria-hidden="true">A</span>
                <span class="tag right" aria-hidden="true">B</span>`
            : nothing
        }
        ${difference ? this.difference_() : nothing}
        ${this.overlay ? html`<canvas class="overlay" aria-hidden="true"></canvas>` : nothing}
        ${this.point ? place("point", this.point) : nothing}
        ${this.cursor_ && this.by_key_ ? place("cross", this.cursor_) : nothing}
        <div
          class="touch"
          role="application"
          tabindex="0"
          aria-label="Picture: arrow keys move a cross, Enter ${this.inspect ? "looks" : "focuses"} there"
          aria-describedby="reading"
          @pointermove=${(event: PointerEvent) => this.point_at_(event)}
          @pointerleave=${() => (this.cursor_ = undefined)}
          @click=${(event: MouseEvent) => this.click_(event)}
          @keydown=${(event: KeyboardEvent) => this.key_(event)}
          @blur=${() => (this.by_key_ = false)}
        ></div>
        ${
          this.zoom > 0 && this.cursor_
            ? html`<canvas
                class="loupe"
                width=${kLoupe_px}
                height=${kLoupe_px}
                aria-hidden="true"
              ></canvas>`
            : nothing
        }
        ${
          wipe
            ? html`<div class="divider" aria-hidden="true"></div>
                <input
                  class="wipe"
                  type="range"
                  min="0"
                  max="100"
                  aria-label="Wipe between A and B"
                  .value=${String(this.wipe_)}
                  @input=${(event: Event) =>
                    (this.wipe_ = Number((event.target as HTMLInputElement).value))}
                />`
            : nothing
        }
      </div>
      <p class="reading number" id="reading" aria-live=${this.by_key_ ? "polite" : "off"}>
        ${this.reading_text_()}
      </p>`;
  }

  override updated(changed: PropertyValues): void {
    this.draw_loupe_();
    const before = changed.get("held") as HeldLayers | undefined;
    const { layers, blur_holds } = this.held;
    const other_blur =
      before !== undefined && (before.layers !== layers || before.blur_holds !== blur_holds);
    if (this.overlay_canvas_ && (changed.has("overlay") || other_blur))
      this.draw_overlay_(this.overlay_canvas_);
    if (this.difference_canvas_ && (changed.has("comparison") || changed.has("pixels_")))
      this.draw_difference_(this.difference_canvas_);
  }

  private difference_(): TemplateResult {
    if (same_shape(this.size, this.other_size))
      return html`<canvas class="difference" aria-hidden="true"></canvas>`;
    const wide = ({ width, height }: ImageSize): string => quantity(width / height);
    return html`<div class="empty why">
      There is no difference to show: A is ${wide(this.size)} times as wide as high, B
      ${wide(this.other_size)} times. The wipe shows both.
    </div>`;
  }

  private reading_text_(): string {
    const shown_at = this.cursor_ ?? this.point;
    const is_other = shown_at !== undefined && this.is_other_(shown_at);
    const at = shown_at && this.place_in_picture_(shown_at);
    const { layers, blur_holds } = is_other ? this.other_held : this.held;
    if (!at || !layers) return "Point at the picture to read depth, blur and pixel values.";
    const { width, height } = is_other ? this.other_size : this.size;
    const depth = value_at(layers.depth_m, at.x, at.y);
    const { coc_px } = layers;
    const blur_px = (value_at(coc_px, at.x, at.y) * width) / coc_px.width;
    const x = Math.floor(at.x * width);
    const y = Math.floor(at.y * height);
    const side = Math.abs(blur_px) < 0.05 ? "" : blur_px < 0 ? " (near)" : " (far)";
    const rgb = this.rgb_at_(at, is_other);
    const blur = blur_holds ? `, blur ${quantity(Math.abs(blur_px), "px")}${side}` : "";
    const depth_text = quantity(distance(depth), "m");
    return `x ${x}, y ${y}: depth ${depth_text}${blur}${rgb === "" ? "" : `, sRGB ${rgb}`}`;
  }

  private rgb_at_(at: PicturePoint, is_other: boolean): string {
    const from = is_other ? this.other_pixels_ : this.pixels_;
    if (!from || this.pixels_of_ !== this.picture) return "";
    const place = (share: number, count: number): number =>
      Math.min(Math.floor(share * count), count - 1);
    const index = 4 * (place(at.y, from.height) * from.width + place(at.x, from.width));
    return [...from.data.slice(index, index + 3)].join(" ");
  }

  /// Pixels are read when the pictures rest: while a hand drags nobody points at them.
  private read_soon_(): void {
    ++this.reading_; // what is being read is of an older picture
    clearTimeout(this.read_timer_);
    const at_once = this.comparison === "difference" && this.other !== undefined;
    this.read_timer_ = setTimeout(() => void this.read_(), at_once ? 0 : kReadRest_ms);
  }

  private async read_(): Promise<void> {
    const reading = ++this.reading_;
    const { picture, other } = this;
    if (!picture) return;
    const pixels = await pixels_of(picture);
    // Of the same shape they are compared pixel by pixel.
    const size = same_shape(this.size, this.other_size) ? pixels : undefined;
    const others = other && (await pixels_of(other, size));
    if (reading !== this.reading_) return;
    this.other_pixels_ = others;
    this.pixels_ = pixels;
    this.pixels_of_ = picture;
  }

  private draw_overlay_(canvas: HTMLCanvasElement): void {
    const { layers, blur_holds } = this.held;
    canvas.width = 0; // an old map is no map
    if (!layers || !blur_holds) return;
    const { coc_px } = layers;
    canvas.width = coc_px.width;
    canvas.height = coc_px.height;
    const colours = blur_colours(coc_px, this.limit_share * coc_px.width);
    const image = new ImageData(colours, coc_px.width, coc_px.height);
    canvas.getContext("2d")?.putImageData(image, 0, 0);
  }

  private draw_difference_(canvas: HTMLCanvasElement): void {
    const [a, b] = [this.pixels_, this.other_pixels_];
    if (!a || !b) return;
    canvas.width = a.width;
    canvas.height = a.height;
    const { pixels, mean, largest } = difference_of(a.data, b.data, kDifferenceGain);
    canvas.getContext("2d")?.putImageData(new ImageData(pixels, a.width, a.height), 0, 0);
    this.dispatchEvent(new DifferenceEvent(mean, largest));
  }

  /// One pixel of the picture is `zoom` pixels of the page.
  private draw_loupe_(): void {
    const [canvas, at] = [this.loupe_canvas_, this.cursor_];
    const from = at && this.is_other_(at) ? this.other_pixels_ : this.pixels_;
    const place = at && this.place_in_picture_(at);
    const context = canvas?.getContext("2d");
    if (!canvas || !context || !at || !place || !from) return;
    const side = Math.ceil(kLoupe_px / this.zoom);
    const left = Math.round(place.x * from.width - side / 2);
    const top = Math.round(place.y * from.height - side / 2);
    const cut = new OffscreenCanvas(side, side);
    cut.getContext("2d")?.putImageData(from, -left, -top);
    context.imageSmoothingEnabled = false;
    context.clearRect(0, 0, kLoupe_px, kLoupe_px);
    context.drawImage(cut, 0, 0, side * this.zoom, side * this.zoom);
    canvas.style.setProperty("left", `${100 * at.x}%`);
    canvas.style.setProperty("top", `${100 * at.y}%`);
    canvas.classList.toggle("low", at.y < 0.5);
    canvas.classList.toggle("left", at.x > 0.5);
  }

  /// Whether the second picture is what is seen there.
  private is_other_(at: PicturePoint): boolean {
    return this.other !== undefined && this.comparison === "wipe" && 100 * at.x > this.wipe_;
  }

  /// Where in the picture that is seen there; undefined beside it.
  private place_in_picture_(at: PicturePoint): PicturePoint | undefined {
    return this.is_other_(at) ? place_within(at, this.size, this.other_size) : at;
  }

  private point_at_(event: PointerEvent): void {
    this.by_key_ = false;
    this.cursor_ = place_of(event);
  }

  private click_(event: MouseEvent): void {
    if (event.detail > 0) this.pick_(place_of(event));
  }

  private key_(event: KeyboardEvent): void {
    const arrow = kArrows.get(event.key);
    const at = this.cursor_ ?? this.point ?? { x: 0.5, y: 0.5 };
    if (arrow) {
      const step = event.shiftKey ? 10 * kStep : kStep;
      this.by_key_ = true;
      this.cursor_ = {
        x: rounded_share(at.x + step * arrow[0]),
        y: rounded_share(at.y + step * arrow[1]),
      };
    } else if (event.key === "Enter" || event.key === " ") this.pick_(at);
    else return;
    event.preventDefault();
  }

  private pick_(at: PicturePoint): void {
    const point = { x: rounded_share(at.x), y: rounded_share(at.y) };
    const side = this.is_other_(point) ? "b" : "a";
    const { layers } = side === "b" ? this.other_held : this.held;
    const place = this.place_in_picture_(point);
    if (!layers || !place) return;
    const depth_m = distance(value_at(layers.depth_m, place.x, place.y));
    this.dispatchEvent(new PickEvent(point, depth_m, !this.inspect, side));
  }
}

function place(name: string, { x, y }: PicturePoint): TemplateResult {
  return html`<svg class="mark ${name}" viewBox="0 0 1000 1000" preserveAspectRatio="none" aria-hidden="true">
    <path vector-effect="non-scaling-stroke"
      d="M${1000 * x} 0V1000M0 ${1000 * y}H1000" />
  </svg>`;
}

function place_of(event: MouseEvent): PicturePoint {
  const frame = (event.currentTarget as HTMLElement).getBoundingClientRect();
  return {
    x: rounded_share((event.clientX - frame.left) / frame.width),
    y: rounded_share((event.clientY - frame.top) / frame.height),
  };
}

function rounded_share(share: number): number {
  return Math.min(Math.max(Math.round(share * 1e4) / 1e4, 0), 1);
}

/// A depth as the contract writes it, to a tenth of a millimetre.
function distance(depth_m: number): Distance {
  return Number.isFinite(depth_m) ? Number(depth_m.toPrecision(5)) : "infinity";
}

function address_of(picture: Blob | undefined, old: string): string {
  URL.revokeObjectURL(old);
  return picture ? URL.createObjectURL(picture) : "";
}
