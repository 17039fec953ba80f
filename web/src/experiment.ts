/// Guided experiments: data files of steps, each with something to see, a question and an answer
/// that is measured by the server when it is asked for.
import type { ApiClient } from "./api_client.ts";
import type { ChartRequest, Distance, OpticsRequest, PsfRequest } from "./contract.ts";
import type { MeasurementRequest, RenderRequest } from "./contract.ts";
import { quantity } from "./format.ts";
import { page_of } from "./page_state.ts";
import type { PageState } from "./page_state.ts";
import { render_request, size_of } from "./picture_updates.ts";
import { learn_scene } from "./scene_looks.ts";
import { camera_of } from "./state.ts";
import type { PlaygroundState } from "./state.ts";

/// A number of the server: where in which answer; or one made from two that stand before it.
export interface Measurement {
  name: string; // in the answer's text
  label: string;
  unit?: string;
  /// picture: the report of a render of what is shown, and what is measured in it:
  /// {report, measurements}; the request's `measurements` say what.
  call?: "optics" | "psf" | "charts" | "picture";
  settings?: string; // of the camera, as in the address, over those that the step shows
  request?: Readonly<Record<string, unknown>>; // members beside scene, camera and image
  pointer?: string; // into the answer, RFC 6901
  ratio?: readonly [string, string];
  difference?: readonly [string, string];
}

/// The right choice is told by what was measured: the choice whose number in `of` is the largest
/// or smallest, or whose value in `values` is nearest to the number `of`.
export type Verdict =
  | { largest: readonly string[] }
  | { smallest: readonly string[] }
  | { nearest: string; values: readonly number[] };

export interface Step {
  text: string;
  show: string; // the page's settings, as in the address
  question: string;
  choices: readonly string[];
  measure: readonly Measurement[];
  right: Verdict;
  answer: string; // {name} stands for a measured number
}

export interface Experiment {
  title: string;
  summary: string;
  steps: readonly Step[];
}

export type Measured = ReadonlyMap<string, number>;
export type NumberSource = Pick<
  ApiClient,
  "optics" | "psf" | "chart" | "render" | "report" | "measure" | "scene"
>;

/// The page that a step shows; the experiment stays open.
export function page_of_step(step: Step, experiment: string, at = 0): PageState {
  return { ...page_of(step.show), experiment, step: at };
}

/// Throws: what the client throws, and Error where an answer has no such number.
export async function measured(
  source: NumberSource,
  { show, measure }: Step,
  signal: AbortSignal,
): Promise<Measured> {
  const numbers = new Map<string, number>();
  const answers = new Map<string, Promise<unknown>>();
  for (const one of measure) numbers.set(one.name, await value_of(one, show));
  return numbers;

  async function value_of(one: Measurement, shown: string): Promise<number> {
    const { ratio, difference } = one;
    if (ratio) return known(ratio[0]) / known(ratio[1]);
    if (difference) return known(difference[0]) - known(difference[1]);
    const key = JSON.stringify([one.call, one.settings, one.request]);
    const answer = answers.get(key) ?? ask(source, one, shown, signal);
    answers.set(key, answer);
    return number_at(await answer, one.pointer ?? "");
  }

  function known(name: string): number {
    const value = numbers.get(name);
    if (value === undefined) throw new Error(`"${name}" is not measured before it is used`);
    return value;
  }
}

function ask(
  source: NumberSource,
  { call, settings, request }: Measurement,
  show: string,
  signal: AbortSignal,
): Promise<unknown> {
  const text = new URLSearchParams(show);
  new URLSearchParams(settings ?? "").forEach((value, key) => text.set(key, value));
  const { a: state } = page_of(text.toString());
  if (call === "picture") return pictured(source, state, request ?? {}, signal);
  const camera = camera_of(state);
  if (call === "psf") return source.psf({ camera, ...request } as PsfRequest, signal);
  if (call === "charts") {
    const chart = { scene: state.scene, camera, ...request } as ChartRequest;
    return source.chart(chart, () => undefined, signal);
  }
  return source.optics({ camera, image: size_of(state), ...request } as OpticsRequest, signal);
}

async function pictured(
  source: NumberSource,
  state: PlaygroundState,
  { measurements, ...more }: Readonly<Record<string, unknown>>,
  signal: AbortSignal,
): Promise<unknown> {
  await learn_scene(source, state, signal);
  const request = { ...render_request(state), ...more } as RenderRequest;
  const { id } = await source.render(request, signal);
  const report = await source.report(id, signal);
  if (measurements === undefined) return { report };
  const question = { render: id, measurements } as MeasurementRequest;
  return { report, measurements: (await source.measure(question, signal)).measurements };
}

/// The number at a JSON pointer; infinity where the contract writes so.
export function number_at(answer: unknown, pointer: string): number {
  const found = pointer
    .split("/")
    .slice(1)
    .reduce<unknown>((value, part) => (value as Record<string, unknown> | undefined)?.[part], answer);
  if (found === "infinity") return Number.POSITIVE_INFINITY;
  if (typeof found !== "number") throw new Error(`the answer has no number at ${pointer}`);
  return found;
}

/// The index of the right choice.
export function right_choice(verdict: Verdict, numbers: Measured): number {
  if ("nearest" in verdict) {
    const value = numbers.get(verdict.nearest) ?? Number.NaN;
    const off = verdict.values.map((choice) => Math.abs(Math.log(choice / value)));
    return off.indexOf(Math.min(...off));
  }
  const names = "largest" in verdict ? verdict.largest : verdict.smallest;
  const values = names.map((name) => numbers.get(name) ?? Number.NaN);
  return values.indexOf("largest" in verdict ? Math.max(...values) : Math.min(...values));
}

/// A measured number with its unit.
export function worded(value: number | undefined, unit = ""): string {
  const written: Distance | undefined = value === Number.POSITIVE_INFINITY ? "infinity" : value;
  return quantity(typeof written === "number" ? Number(written.toPrecision(3)) : written, unit);
}

/// The answer's text with its numbers.
export function answer_of({ answer, measure }: Step, numbers: Measured): string {
  return answer.replace(/\{(\w+)\}/g, (_, name: string) =>
    worded(numbers.get(name), measure.find((one) => one.name === name)?.unit),
  );
}
