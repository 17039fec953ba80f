/// Where the parts of the side view are drawn. Distances before the lens are on a logarithmic
/// scale, behind it everything is to one scale; the numbers themselves come from the server.
import { scaleLog } from "d3-scale";
import type { Distance, OpticsAtDistance, OpticsReport } from "./contract.ts";
import { sensor_format } from "./sensor_formats.ts";
import type { PlaygroundState } from "./state.ts";
import { f_number_of_step } from "./third_stops.ts";

export const kTicks_m: readonly number[] = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100];
const kNearest_m = 0.1;
const kFarthest_m = 100;
const kFarEnd_px = 22; // where infinity is drawn
const kGap_px = 18; // between the near end of the scale and the lens
const kFarGap_px = 32; // between its far end and infinity: their words stand side by side
const kMargin_px = 22;
const kBehind_px = 190; // from the lens to the end of what lies behind it

export interface SideView {
  width: number;
  height: number;
  axis_y: number;
  lens_x: number;
  sensor_x: number;
  px_per_mm: number; // behind the lens
  half_sensor_px: number;
  half_aperture_px: number;
  largest_half_aperture_px: number; // at f/1
  blur_half_px: number; // of the subject's disc on the sensor
  /// The two edges of the subject's cone, and their way on to where they meet.
  rays: readonly string[];
  beyond: readonly string[];
  x_of: (distance_m: Distance) => number;
  distance_at: (x: number) => Distance;
}

/// The row of the server's answer for this distance.
export function row_at(optics: OpticsReport, at_m: Distance): OpticsAtDistance | undefined {
  return optics.at.find(({ object_distance_m }) => object_distance_m === at_m);
}

/// The diameter that the f-number stands for, by its definition; of a hole the server's.
export function aperture_diameter_mm(state: PlaygroundState, optics: OpticsReport): number {
  return state.camera === "lens"
    ? state.focal_length_mm / f_number_of_step(state.f_stop)
    : (optics.pinhole.diameter_mm ?? 0);
}

export function side_view(
  state: PlaygroundState,
  optics: OpticsReport,
  subject_m: Distance,
  width: number,
): SideView {
  const height = 210;
  const axis_y = 92;
  const { image_distance_mm } = optics;
  const sensor_mm = sensor_format(state.sensor).sensor_mm[1];
  const reference_mm = state.camera === "lens" ? state.focal_length_mm : image_distance_mm;
  const room = width < 460 ? 0.55 : 1;
  const px_per_mm =
    room * Math.min(140 / reference_mm, 150 / sensor_mm, kBehind_px / image_distance_mm);
  // The lens stays where it is drawn: else the scale would move under the hand that drags.
  const lens_x = width - kMargin_px - room * kBehind_px;
  const sensor_x = lens_x + image_distance_mm * px_per_mm;
  const scale = scaleLog(
    [kFarthest_m, kNearest_m],
    [kFarEnd_px + kFarGap_px, lens_x - kGap_px],
  ).clamp(true);
  const x_of = (at_m: Distance): number => (at_m === "infinity" ? kFarEnd_px : scale(at_m));
  const distance_at = (x: number): Distance =>
    x < kFarEnd_px + kFarGap_px / 2 ? "infinity" : Number(scale.invert(x).toPrecision(3));
  const half_aperture_px = (aperture_diameter_mm(state, optics) / 2) * px_per_mm;
  const row = row_at(optics, subject_m);
  const { rays, beyond } = cone(row, x_of(subject_m), {
    lens_x,
    sensor_x,
    axis_y,
    px_per_mm,
    half_aperture_px,
    image_distance_mm,
    width,
  });
  return {
    width,
    height,
    axis_y,
    lens_x,
    sensor_x,
    px_per_mm,
    half_sensor_px: (sensor_mm / 2) * px_per_mm,
    half_aperture_px,
    largest_half_aperture_px: (state.focal_length_mm / 2) * px_per_mm,
    blur_half_px: (Math.abs(row?.coc_mm ?? 0) / 2) * px_per_mm,
    rays,
    beyond,
    x_of,
    distance_at,
  };
}

interface Bench {
  lens_x: number;
  sensor_x: number;
  axis_y: number;
  px_per_mm: number;
  half_aperture_px: number;
  image_distance_mm: number;
  width: number;
}

/// Lines from the subject over the edges of the aperture to its image, where the server says it
/// is: a straight line between two points, cut by the sensor.
function cone(row: OpticsAtDistance | undefined, subject_x: number, bench: Bench) {
  if (row === undefined) return { rays: [], beyond: [] };
  const { lens_x, sensor_x, axis_y, px_per_mm, image_distance_mm, width } = bench;
  const image_mm = row.image_distance_mm;
  const far = row.object_distance_m === "infinity";
  const height_at = (x: number, edge_y: number): number =>
    image_mm === "infinity"
      ? edge_y
      : axis_y + (edge_y - axis_y) * (1 - (x - lens_x) / (image_mm * px_per_mm));
  const rays: string[] = [];
  const beyond: string[] = [];
  for (const side of [-1, 1]) {
    const edge_y = axis_y + side * bench.half_aperture_px;
    const from = far ? `M${subject_x} ${edge_y}` : `M${subject_x} ${axis_y}`;
    const sensor_y = height_at(sensor_x, edge_y);
    rays.push(`${from}L${lens_x} ${edge_y}L${sensor_x} ${sensor_y}`);
    const behind = image_mm !== "infinity" && image_mm > image_distance_mm;
    const end_x = behind ? Math.min(lens_x + image_mm * px_per_mm, width) : sensor_x;
    if (end_x > sensor_x)
      beyond.push(`M${sensor_x} ${sensor_y}L${end_x} ${height_at(end_x, edge_y)}`);
  }
  return { rays, beyond };
}

/// CSS pixels to a millimetre.
export const kCssPxPerMm = 96 / 25.4;

/// How many times as large the blur on the sensor is drawn: 1, 2 or 5 times a power of ten, so
/// that `largest_mm` stays within `room_px`.
export function magnification_for(largest_mm: number, room_px: number): number {
  const most = room_px / (largest_mm * kCssPxPerMm);
  if (!Number.isFinite(most)) return 1;
  const power = 10 ** Math.floor(Math.log10(most));
  return ([5, 2, 1].find((step) => step * power <= most * (1 + 1e-9)) ?? 1) * power;
}
