/// Sentences about a state and its numbers.
import type { Distance, OpticsReport, SceneSummary } from "./contract.ts";
import { quantity } from "./format.ts";
import { row_at } from "./side_view_layout.ts";
import type { PlaygroundState } from "./state.ts";
import { nominal_label } from "./third_stops.ts";

/// What a picture shows, for who cannot see it.
export function description_of(
  shown: PlaygroundState | undefined,
  scenes: readonly SceneSummary[],
): string {
  if (shown === undefined) return "";
  const title = scenes.find(({ name }) => name === shown.scene)?.title ?? shown.scene;
  if (shown.camera === "pinhole") return `${title} through a pinhole`;
  const { focal_length_mm, f_stop, focus_distance_m } = shown;
  const focus = focus_distance_m === "infinity" ? "infinity" : `${focus_distance_m} m`;
  const lens = `${focal_length_mm} mm lens at f/${nominal_label(f_stop)}`;
  return `${title} through a ${lens}, focused at ${focus}`;
}

/// The outcome in one sentence.
export function summary_of(
  state: PlaygroundState,
  optics: OpticsReport,
  subject_m: Distance,
): string {
  const row = row_at(optics, subject_m);
  const disc = row
    ? `a point at ${quantity(subject_m, "m")} is a disc ` +
      `${quantity(Math.abs(row.coc_px), "px")} wide.`
    : "";
  if (state.camera === "pinhole") {
    const hole = quantity(optics.pinhole.diameter_mm, "mm");
    return `A hole of ${hole}, ${quantity(optics.image_distance_mm, "mm")} before the sensor: ${disc}`;
  }
  const { near_m, far_m } = optics;
  const focus = quantity(state.focus_distance_m, "m");
  return (
    `${state.focal_length_mm}\u00a0mm at f/${nominal_label(state.f_stop)}, focused at ${focus}: ` +
    `sharp from ${quantity(near_m, "m")} to ${quantity(far_m, "m")}; ${disc}`
  );
}
