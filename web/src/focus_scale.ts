/// The focus slider's scale: equal steps in the logarithm of the distance, like a lens barrel,
/// with infinity behind the farthest mark. A scale of the control; no optics.
import type { Distance } from "./contract.ts";

const kNearestMark_m = 0.1;
const kStepsPerDecade = 40;
const kDecades = 3;

/// The slider's last position, infinity; the first is 0, the nearest mark.
export const kInfinityPosition = kDecades * kStepsPerDecade + 1;

/// The distance marked at a position, rounded to three digits.
export function distance_at(position: number): Distance {
  if (position >= kInfinityPosition) return "infinity";
  const distance_m = kNearestMark_m * 10 ** (position / kStepsPerDecade);
  return Number(distance_m.toPrecision(3));
}

/// The position nearest to a distance; distances beyond the marks sit at the end marks.
export function position_of(distance_m: Distance): number {
  if (distance_m === "infinity") return kInfinityPosition;
  const position = Math.round(kStepsPerDecade * Math.log10(distance_m / kNearestMark_m));
  return Math.min(Math.max(position, 0), kInfinityPosition - 1);
}
