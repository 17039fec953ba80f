/// Blur measured in pictures: a small lamp is rendered at several distances, and the server measures
/// its blur disc in each picture.
import type { ApiClient } from "./api_client.ts";
import type { MeasurementRequest, OpticsAtDistance, OpticsReport } from "./contract.ts";
import type { RenderRequest } from "./contract.ts";
import type { PlotSpec, Series } from "./plot_spec.ts";
import { camera_of } from "./state.ts";
import type { PlaygroundState } from "./state.ts";

export type Laboratory = Pick<ApiClient, "render" | "measure">;

const kPoints = 10;
const kLeastBlur_mm = 0.02; // ten pixels: fewer sample a disc too coarsely for its moments
const kSmallestSensor_mm = 1;
const kMostPixels = 512;
const kDisc_px = 24; // where the sensor is not too small for it
const kRoom = 1.6; // of the disc's diameter
const kLampShare = 1 / 20; // of the disc's diameter is the lamp's own image
const kDiscValue = 0.5;
const kMaxError = 0.03; // lamps are splatted: their discs are far better than that

/// One distance: where, what the closed form says, what the picture says.
export interface MeasuredBlur {
  object_distance_m: number;
  theory_um: number;
  measured_um: number;
}

/// The distances worth a picture: blurred enough to be measured, evenly among the rows.
export function measurable(rows: readonly OpticsAtDistance[]): OpticsAtDistance[] {
  const blurred = rows.filter(({ coc_mm }) => Math.abs(coc_mm) >= kLeastBlur_mm);
  const count = Math.min(kPoints, blurred.length);
  const places = Array.from({ length: count }, (_, i) =>
    Math.round((i * (blurred.length - 1)) / Math.max(count - 1, 1)),
  );
  return [...new Set(places)].flatMap((place) => blurred[place] ?? []);
}

/// The lamp at a distance before the camera of `state`, on a sensor just large enough for its disc.
export function lamp_shot(
  state: PlaygroundState,
  { object_distance_m, coc_mm }: OpticsAtDistance,
  image_distance_mm: number,
): { request: RenderRequest; lamp_px: number } {
  const disc_mm = Math.abs(coc_mm);
  const side_mm = Math.max(kRoom * disc_mm, kSmallestSensor_mm);
  const side_px = Math.min(Math.ceil((side_mm / disc_mm) * kDisc_px), kMostPixels);
  const at_m = Number(object_distance_m);
  // Its image is as much smaller than the lamp as it is nearer.
  const radius_m = Math.max((kLampShare * disc_mm * at_m) / (2 * image_distance_mm), 1e-6);
  const lamp_mm = (2 * radius_m * image_distance_mm) / at_m;
  const emission = kDiscValue * (disc_mm / lamp_mm) ** 2;
  const camera = {
    ...camera_of({ ...state, camera_z_m: 0, exposure: "relative" }),
    sensor_mm: [side_mm, side_mm] as [number, number],
  };
  const request = {
    scene: {
      format: "fstop-scene/1",
      materials: { lamp: { model: "unlit", emission: [emission, emission, emission] } },
      objects: [{ type: "sphere", center_m: [0, 0, -at_m], radius_m, material: "lamp" }],
    },
    camera,
    image: { width: side_px, height: side_px, format: "jpeg" }, // the server keeps the numbers
    quality: { max_error: kMaxError },
    effects: { defocus: "on", diffraction: "off" },
  } as RenderRequest;
  return { request, lamp_px: (lamp_mm / side_mm) * side_px };
}

/// Yields one point after the other.
export async function* measured_blur(
  laboratory: Laboratory,
  state: PlaygroundState,
  { at, image_distance_mm }: OpticsReport,
  signal: AbortSignal,
): AsyncGenerator<MeasuredBlur, void> {
  const blades = state.camera === "lens" ? state.blades : 0;
  for (const row of measurable(at)) {
    const { request, lamp_px } = lamp_shot(state, row, image_distance_mm);
    const { id } = await laboratory.render(request, signal);
    const spot = { kind: "spot", background: 0, source_diameter_px: lamp_px, blades } as const;
    const question: MeasurementRequest = { render: id, measurements: [spot] };
    const [answer] = (await laboratory.measure(question, signal)).measurements;
    if (answer?.kind !== "spot" || answer.disc_diameter_um === undefined) continue;
    yield {
      object_distance_m: Number(row.object_distance_m),
      theory_um: 1000 * Math.abs(row.coc_mm),
      measured_um: answer.disc_diameter_um,
    };
  }
}

/// By how much the picture's disc is larger than the closed form's, per cent.
export function deviation_percent({ theory_um, measured_um }: MeasuredBlur): number {
  return 100 * (measured_um / theory_um - 1);
}

/// The plot with the points that have been measured.
export function with_measured(plot: PlotSpec, points: readonly MeasuredBlur[]): PlotSpec {
  const measured: Series = {
    name: "measured in rendered pictures (rays)",
    kind: "dots",
    points: points.map(({ object_distance_m, measured_um }) => [object_distance_m, measured_um]),
    remarks: points.map((point) => deviation_percent(point).toFixed(2)),
  };
  return { ...plot, series: [...plot.series, measured], remarks: "off the blur disc, %" };
}

/// What was measured, in a sentence.
export function measured_words(points: readonly MeasuredBlur[]): string {
  const worst = Math.max(...points.map((point) => Math.abs(deviation_percent(point))));
  return points.length === 0
    ? "Nothing is blurred enough to be measured in a picture."
    : `Measured at ${points.length} distances, by second moments of a lamp's disc in rendered ` +
        `pictures: within ${worst.toPrecision(2)} % of the geometric blur disc.`;
}
