import { LitElement, html, nothing, svg } from "lit";
import type { TemplateResult } from "lit";
import { customElement, property, state } from "lit/decorators.js";
import "./blur_on_sensor.ts";
import { StateChangeEvent, SubjectMoveEvent } from "./changes.ts";
import type { Distance, OpticsReport } from "./contract.ts";
import { distance_at, kInfinityPosition, position_of } from "./focus_scale.ts";
import { quantity } from "./format.ts";
import { kBaseStyles } from "./shared_styles.ts";
import { kCssPxPerMm, kTicks_m, row_at, side_view } from "./side_view_layout.ts";
import type { SideView } from "./side_view_layout.ts";
import { kSideViewStyles } from "./side_view_styles.ts";
import { kDefaultState } from "./state.ts";
import type { PlaygroundState } from "./state.ts";
import { kLastThirdStop, nearest_step, nominal_label } from "./third_stops.ts";

type Part = "focus" | "aperture" | "subject";

/// The camera from the side: focused plane, aperture and subject can be dragged, or moved by keys.
@customElement("fstop-side-view")
export class SideViewPanel extends LitElement {
  @property({ attribute: false }) state: PlaygroundState = kDefaultState;
  /// The numbers of `numbers_of`; the drawing is of these, so that it always fits together.
  @property({ attribute: false }) optics: OpticsReport | undefined;
  @property({ attribute: false }) numbers_of: PlaygroundState | undefined;
  @property({ attribute: false }) subject_m: Distance = 1;

  @state() private width_ = 640;
  @state() private held_: Part | undefined;
  private readonly observer_ = new ResizeObserver(([entry]) => {
    if (entry) this.width_ = Math.max(Math.floor(entry.contentRect.width), 260);
  });

  static override styles = [kBaseStyles, kSideViewStyles];

  override firstUpdated(): void {
    const bench = this.renderRoot.querySelector(".bench");
    if (bench) this.observer_.observe(bench);
  }

  override disconnectedCallback(): void {
    super.disconnectedCallback();
    this.observer_.disconnect();
  }

  override render(): TemplateResult {
    return html`<h2>Side view</h2>
      <div class="views">
        <div class="bench">${this.bench_()}</div>
        <fstop-blur-on-sensor
          .state=${this.numbers_of ?? this.state}
          .optics=${this.optics}
          .subject_m=${this.subject_m}
        ></fstop-blur-on-sensor>
      </div>`;
  }

  private bench_(): TemplateResult | typeof nothing {
    const { optics, numbers_of } = this;
    if (optics === undefined || numbers_of === undefined) return nothing;
    const lens = numbers_of.camera === "lens";
    const zoom = zoom_of_page();
    const view = side_view(numbers_of, optics, this.subject_m, this.width_ / zoom);
    const { width, height, axis_y, lens_x, sensor_x } = view;
    return html`<svg
        width=${width * zoom}
        height=${height * zoom}
        viewBox="0 0 ${width} ${height}"
        role="group"
        aria-label="Side view of the camera: the scene to the left, the sensor to the right"
      >
        ${lens ? this.sharp_band_(view, optics) : nothing} ${scale_of(view)}
        <line class="axis" x1="0" y1=${axis_y} x2=${width} y2=${axis_y} />
        ${view.rays.map((path) => svg`<path class="ray" d=${path} />`)}
        ${view.beyond.map((path) => svg`<path class="ray beyond" d=${path} />`)}
        ${lens ? lens_glass(view) : nothing} ${stops(view)}
        <line
          class="sensor"
          x1=${sensor_x}
          x2=${sensor_x}
          y1=${axis_y - view.half_sensor_px}
          y2=${axis_y + view.half_sensor_px}
        />
        <line
          class="blur"
          x1=${sensor_x}
          x2=${sensor_x}
          y1=${axis_y - Math.max(view.blur_half_px, 1)}
          y2=${axis_y + Math.max(view.blur_half_px, 1)}
        />
        ${lens ? this.focus_(view) : nothing} ${this.subject_(view)}
        ${lens ? this.aperture_(view) : nothing}
        <text class="name" x=${lens_x} y="12" text-anchor="middle">${lens ? "lens" : "pinhole"}</text>
        <text class="name" x=${sensor_x} y=${height - 22} text-anchor="middle">sensor</text>
      </svg>
      <p class="muted note">
        Behind the ${lens ? "lens" : "hole"} ${quantity((zoom * view.px_per_mm) / kCssPxPerMm)} : 1; before it
        the distance in metres, logarithmic. ${this.words_(optics)}
        <button type="button" @click=${() => void this.save_()}>SVG</button>
      </p>`;
  }

  private async save_(): Promise<void> {
    const drawing = this.renderRoot.querySelector("svg");
    const { save_text, standalone_svg } = await import("./files.ts");
    if (drawing) save_text("side-view.svg", "image/svg+xml", standalone_svg(drawing));
  }

  private words_(optics: OpticsReport): string {
    const row = row_at(optics, this.subject_m);
    const at = `The subject at ${quantity(this.subject_m, "m")}`;
    if (row === undefined) return "";
    const side = row.coc_mm < 0 ? "nearer than" : row.coc_mm > 0 ? "beyond" : "in";
    const plane = this.state.camera === "lens" ? `, ${side} the focused plane,` : "";
    return `${at}${plane} is a disc of ${quantity(Math.abs(row.coc_mm), "mm")} on the sensor.`;
  }

  private sharp_band_(view: SideView, { near_m, far_m }: OpticsReport): TemplateResult {
    const far_x = view.x_of(far_m);
    const near_x = view.x_of(near_m);
    return svg`<rect class="sharp" x=${far_x} y="20" width=${Math.max(near_x - far_x, 1)}
        height=${view.height - 56}>
        <title>Sharp from ${quantity(near_m, "m")} to ${quantity(far_m, "m")}</title>
      </rect>` as TemplateResult;
  }

  private focus_(view: SideView): TemplateResult {
    const { focus_distance_m } = this.state;
    const x = view.x_of(focus_distance_m);
    return this.handle_(
      "focus",
      "Focused plane",
      { now: position_of(focus_distance_m), last: kInfinityPosition },
      quantity(focus_distance_m, "m"),
      svg`<line class="plane" x1=${x} x2=${x} y1="20" y2=${view.height - 36} />
        <path class="knob" d="M${x} 14l8 9l-8 9l-8 -9z" />
        <rect class="hit" x=${x - 14} y="6" width="28" height=${view.height - 42} />` as TemplateResult,
    );
  }

  private subject_(view: SideView): TemplateResult {
    const x = view.x_of(this.subject_m);
    return this.handle_(
      "subject",
      "Subject; moving it moves the camera",
      { now: position_of(this.subject_m), last: kInfinityPosition },
      quantity(this.subject_m, "m"),
      svg`<circle class="knob" cx=${x} cy=${view.axis_y} r="8" />
        <circle class="hit" cx=${x} cy=${view.axis_y} r="16" />` as TemplateResult,
    );
  }

  private aperture_(view: SideView): TemplateResult {
    const y = view.axis_y - view.half_aperture_px;
    const { f_stop } = this.state;
    return this.handle_(
      "aperture",
      "Edge of the aperture",
      { now: kLastThirdStop - f_stop, last: kLastThirdStop },
      `f/${nominal_label(f_stop)}`,
      svg`<path class="knob" d="M${view.lens_x} ${y + 3}l-7 -11h14z" />
        <rect class="hit" x=${view.lens_x - 14} y=${y - 22} width="28" height="30" />` as TemplateResult,
    );
  }

  private handle_(
    part: Part,
    caption: string,
    { now, last }: { now: number; last: number },
    spoken: string,
    shape: TemplateResult,
  ): TemplateResult {
    return svg`<g
      class="handle ${part} ${this.held_ === part ? "held" : ""}"
      role="slider"
      tabindex="0"
      aria-label=${caption}
      aria-valuemin="0"
      aria-valuemax=${last}
      aria-valuenow=${now}
      aria-valuetext=${spoken}
      @keydown=${(event: KeyboardEvent) => this.key_(part, event)}
      @pointerdown=${(event: PointerEvent) => this.grip_(part, event)}
      @pointermove=${(event: PointerEvent) => this.drag_(part, event, false)}
      @pointerup=${(event: PointerEvent) => this.drag_(part, event, true)}
      @pointercancel=${() => (this.held_ = undefined)}
    >${shape}<title>${caption}: ${spoken}</title></g>` as TemplateResult;
  }

  private grip_(part: Part, event: PointerEvent): void {
    (event.currentTarget as SVGGElement).setPointerCapture(event.pointerId);
    this.held_ = part;
  }

  private drag_(part: Part, event: PointerEvent, settled: boolean): void {
    if (this.held_ !== part) return;
    if (settled) this.held_ = undefined;
    const { optics, numbers_of } = this;
    const frame = this.renderRoot.querySelector("svg")?.getBoundingClientRect();
    if (!frame || !optics || !numbers_of) return;
    const zoom = zoom_of_page();
    const view = side_view(numbers_of, optics, this.subject_m, this.width_ / zoom);
    if (part === "aperture") {
      const half_px = Math.max(view.axis_y - (event.clientY - frame.top) / zoom, 0.1);
      // The f-number is focal length over diameter; at f/1 both are the same.
      const f_stop = nearest_step(view.largest_half_aperture_px / half_px);
      this.dispatchEvent(new StateChangeEvent({ f_stop }, settled));
    } else this.place_(part, view.distance_at((event.clientX - frame.left) / zoom), settled);
  }

  private place_(part: Part, at_m: Distance, settled: boolean): void {
    if (part === "focus")
      this.dispatchEvent(new StateChangeEvent({ focus_distance_m: at_m }, settled));
    else if (at_m !== "infinity") this.dispatchEvent(new SubjectMoveEvent(at_m, settled));
  }

  private key_(part: Part, event: KeyboardEvent): void {
    const steps = kSteps.get(event.key);
    if (steps === undefined) return;
    event.preventDefault();
    if (part === "aperture") {
      const f_stop = Math.min(Math.max(this.state.f_stop - Math.sign(steps), 0), kLastThirdStop);
      this.dispatchEvent(new StateChangeEvent({ f_stop }, true));
      return;
    }
    const from_m = part === "focus" ? this.state.focus_distance_m : this.subject_m;
    const last = part === "focus" ? kInfinityPosition : kInfinityPosition - 1;
    const position = Math.min(Math.max(position_of(from_m) + steps, 0), last);
    this.place_(part, distance_at(position), true);
  }
}

/// Of the page's letters where the drawing has its own size.
const kLetters_px = 15;

/// The drawing grows with the page's letters.
function zoom_of_page(): number {
  const style = getComputedStyle(document.documentElement);
  return Number.parseFloat(style.fontSize) / kLetters_px;
}

const kSteps: ReadonlyMap<string, number> = new Map([
  ["ArrowRight", 1],
  ["ArrowUp", 1],
  ["ArrowLeft", -1],
  ["ArrowDown", -1],
  ["PageUp", 5],
  ["PageDown", -5],
]);

function scale_of(view: SideView): TemplateResult {
  const y = view.height - 30;
  const few = view.width < 600;
  const ticks = kTicks_m.filter((at_m) => !few || Number.isInteger(Math.log10(at_m)));
  return svg`<line class="scale" x1="0" x2=${view.lens_x - 18} y1=${y} y2=${y} />
    ${ticks.map((at_m) => {
      const x = view.x_of(at_m);
      return svg`<line class="scale" x1=${x} x2=${x} y1=${y} y2=${y + 5} />
        <text class="tick" x=${x} y=${y + 19} text-anchor="middle">${at_m}</text>`;
    })}
    <text class="tick" x=${view.x_of("infinity")} y=${y + 19} text-anchor="middle">∞</text>` as TemplateResult;
}

/// Two arcs; their bulge is a picture of a lens, its power is not in it.
function lens_glass({ lens_x, axis_y, largest_half_aperture_px }: SideView): TemplateResult {
  const half = Math.min(largest_half_aperture_px, 72);
  const [top, bottom] = [axis_y - half, axis_y + half];
  return svg`<path class="glass"
    d="M${lens_x} ${top}Q${lens_x + 14} ${axis_y} ${lens_x} ${bottom}Q${lens_x - 14} ${axis_y} ${lens_x} ${top}z" />` as TemplateResult;
}

/// What blocks the light beside the aperture.
function stops({ lens_x, axis_y, half_aperture_px }: SideView): TemplateResult {
  const [top, bottom] = [axis_y - half_aperture_px, axis_y + half_aperture_px];
  return svg`<path class="stop" d="M${lens_x} 18V${Math.max(top, 18)}M${lens_x} ${Math.min(bottom, 166)}V166" />` as TemplateResult;
}
