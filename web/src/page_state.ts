/// All that a link holds: a request, where wanted a second one to compare it with, how they are
/// compared, and the point that is looked at.
import type { Distance } from "./contract.ts";
import { distance_of, is_readable, kDefaultState, number_of, read_state } from "./state.ts";
import { write_state } from "./state.ts";
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

/// The parts of a fragment that page_of() leaves out: names that are none, and values that cannot be
/// read.
export function misread(fragment: string): string[] {
  const text = new URLSearchParams(fragment.replace(/^#/, ""));
  const has_b = text.has("b.camera");
  return [...text]
    .filter(([name, value]) => {
      const known = kReadable.get(name);
      if (known) return !known(value);
      return name.startsWith("b.") ? !has_b || !is_readable(name.slice(2), value) : !is_readable(name, value);
    })
    .map(([name, value]) => `${name}=${value}`);
}

const kReadable: ReadonlyMap<string, (text: string) => boolean> = new Map([
  ["compare", (text) => (kComparisons as readonly string[]).includes(text)],
  ["subject_m", (text) => distance_of(text) !== undefined],
  ["point", (text) => point_of(text) !== undefined],
  ["experiment", () => true], // the experiments themselves are loaded later
  ["step", (text) => /^[1-9]\d*$/.test(text)],
]);

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
