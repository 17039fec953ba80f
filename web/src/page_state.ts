/// All that a link holds: a request, where wanted a second one to compare it with, how they are
/// compared, and the point that is looked at.
import type { Distance } from "./contract.ts";
import { distance_of, kDefaultState, number_of, read_state, write_state } from "./state.ts";
import type { PlaygroundState } from "./state.ts";

export const kComparisons = ["wipe", "difference"] as const;
export type Comparison = (typeof kComparisons)[number];

/// A place in the picture, as fractions of its width and height from the upper left.
export interface PicturePoint {
  x: number;
  y: number;
}

export interface PageState {
  a: PlaygroundState;
  b: PlaygroundState | undefined;
  comparison: Comparison;
  subject_m: Distance; // from the camera of `a`, along its axis
  point: PicturePoint | undefined; // where the subject was clicked
  experiment: string; // the name of an experiment's file; empty: none
  step: number; // of the experiment, from 0
}

export const kDefaultPage: PageState = {
  a: kDefaultState,
  b: undefined,
  comparison: "wipe",
  subject_m: 1,
  point: undefined,
  experiment: "",
  step: 0,
};

export function page_fragment(page: PageState): string {
  const text = new URLSearchParams();
  write_state(text, page.a);
  if (page.b) {
    write_state(text, page.b, "b.");
    text.set("compare", page.comparison);
  }
  if (page.subject_m !== kDefaultPage.subject_m) text.set("subject_m", String(page.subject_m));
  if (page.point) text.set("point", `${page.point.x},${page.point.y}`);
  if (page.experiment !== "") {
    text.set("experiment", page.experiment);
    text.set("step", String(page.step + 1));
  }
  return `#${text.toString()}`;
}

export function page_of(fragment: string): PageState {
  const text = new URLSearchParams(fragment.replace(/^#/, ""));
  const comparison = kComparisons.find((name) => name === text.get("compare"));
  return {
    a: read_state(text),
    b: text.has("b.camera") ? read_state(text, "b.") : undefined,
    comparison: comparison ?? kDefaultPage.comparison,
    subject_m: distance_of(text.get("subject_m") ?? "") ?? kDefaultPage.subject_m,
    point: point_of(text.get("point")),
    experiment: text.get("experiment") ?? "",
    step: step_of(text.get("step")),
  };
}

function step_of(text: string | null): number {
  const step = number_of(text ?? "") ?? 1;
  return Number.isInteger(step) && step >= 1 ? step - 1 : 0;
}

function point_of(text: string | null): PicturePoint | undefined {
  const [x, y] = (text ?? "").split(",").map(number_of);
  const inside = (value: number | undefined): value is number =>
    value !== undefined && value >= 0 && value <= 1;
  return inside(x) && inside(y) ? { x, y } : undefined;
}
