/// The numbers behind the plots, asked from the server, and what they look like as plots.
import { RefusedError } from "./api_client.ts";
import type { ApiClient } from "./api_client.ts";
import type { ChartReport, ChartRequest, Distance } from "./contract.ts";
import type { OpticsReport, PsfReport, PsfRequest } from "./contract.ts";
import { quantity } from "./format.ts";
import { size_of } from "./picture_updates.ts";
import type { PlotSpec, Series } from "./plot_spec.ts";
import { chart_size, sensor_format } from "./sensor_formats.ts";
import { camera_of } from "./state.ts";
import type { PlaygroundState } from "./state.ts";

type Numbers = Pick<ApiClient, "optics" | "psf">;

/// The Airy disc holds 83.8 % of a focused point's light; so do all spots here.
const kAiryShare = 0.8377;
const kFewDistances = 25;
const kManyDistances = 120;

/// `count` values from the first to the last, in equal ratios, to four digits.
export function ratios(first: number, last: number, count: number): number[] {
  const step = (last / first) ** (1 / (count - 1));
  return Array.from({ length: count }, (_, i) => Number((first * step ** i).toPrecision(4)));
}

/// The answer, or nothing where the point is so far out of focus that the server has no wave for
/// it; the blur disc is all there is to say there.
async function psf_or_nothing(
  source: Numbers,
  request: PsfRequest,
  signal: AbortSignal,
): Promise<PsfReport | undefined> {
  try {
    return await source.psf(request, signal);
  } catch (error) {
    const type = error instanceof RefusedError ? (error.problem.type ?? "") : "";
    if (/\/(outside-domain|over-budget)$/.test(type)) return undefined;
    throw error;
  }
}

function spot_um({ encircled_energy }: PsfReport): number {
  const radius = encircled_energy[0]?.radius_um;
  return typeof radius === "number" ? 2 * radius : Number.NaN;
}

/// Blur on the sensor against the distance of the object.
export async function blur_plot(
  source: Numbers,
  state: PlaygroundState,
  signal: AbortSignal,
): Promise<PlotSpec> {
  const camera = camera_of(state);
  const nearest_m = Math.max(0.2, state.camera === "lens" ? state.focal_length_mm / 500 : 0);
  const around_m = state.camera === "lens" ? around(state.focus_distance_m) : [];
  const spread = (count: number): number[] =>
    [...ratios(nearest_m, 100, count), ...around_m].sort((a, b) => a - b);
  const [many_m, few_m] = [spread(kManyDistances), spread(kFewDistances)];
  const image = size_of(state);
  const optics = await source.optics({ camera, image, object_distances_m: many_m }, signal);
  // The waves of a polygon cost too much for so many distances.
  const round = camera_of({ ...state, blades: 0 });
  const combined: [number, number][] = [];
  for (const object_distance_m of few_m) {
    const spot = { camera: round, object_distance_m, radii_um: [0], frequencies_per_mm: [0] };
    const psf = await psf_or_nothing(source, { ...spot, fractions: [kAiryShare] }, signal);
    if (psf) combined.push([object_distance_m, spot_um(psf)]);
  }
  const pixel_um = (1000 * sensor_format(state.sensor).sensor_mm[0]) / image.width;
  const airy_um = optics.airy_diameter_um;
  return {
    title: "Blur on the sensor against distance",
    file: "blur-by-distance",
    x: { caption: "distance of the object, m", scale: "log" },
    y: { caption: "diameter, µm", scale: "log", domain: blur_domain(optics, airy_um) },
    series: [
      {
        name: "geometric: blur disc",
        kind: "line",
        points: optics.at.map(({ object_distance_m, coc_mm }) => [
          Number(object_distance_m),
          1000 * Math.abs(coc_mm),
        ]),
      },
      {
        name: "diffraction alone: Airy disc",
        kind: "line",
        points: many_m.map((at_m) => [at_m, airy_um]),
      },
      {
        name: `both, wave optics${state.blades > 0 ? ", round iris" : ""}: 83.8 % of the light`,
        kind: "line",
        points: combined,
      },
    ],
    marks: [
      { axis: "y", at: 1000 * optics.coc_limit_mm, caption: "still sharp" },
      { axis: "y", at: pixel_um, caption: "one pixel" },
    ],
  };
}

/// The focused plane, and distances close about it, where the blur changes fastest.
function around(focus_m: Distance): number[] {
  if (focus_m === "infinity") return [];
  const by = [0.003, 0.01, 0.025, 0.05, 0.1];
  return [focus_m, ...by.flatMap((share) => [focus_m / (1 + share), focus_m * (1 + share)])].map(
    (at_m) => Number(at_m.toPrecision(6)),
  );
}

function blur_domain(optics: OpticsReport, airy_um: number): [number, number] {
  const most = Math.max(...optics.at.map(({ coc_mm }) => 1000 * Math.abs(coc_mm)), airy_um);
  return [airy_um / 4, Math.max(2 * most, 200)];
}

/// The spot of a point through holes of many diameters.
export async function pinhole_plot(
  source: Numbers,
  state: PlaygroundState,
  subject_m: Distance,
  signal: AbortSignal,
): Promise<{ plot: PlotSpec; optimal_mm: number; optics: OpticsReport }> {
  const image_distance_mm = state.image_distance_mm;
  const camera_with = (diameter_mm: number | "optimal") => ({
    ...camera_of({ ...state, camera: "pinhole", diameter_mm, criterion: "brightest" }),
  });
  const optics = await source.optics({ camera: camera_with("optimal") }, signal);
  const { optimal_diameter_mm: optimal_mm, criteria } = optics.pinhole;
  const geometric: [number, number][] = [];
  const airy: [number, number][] = [];
  const wave: [number, number][] = [];
  for (const diameter_mm of ratios(optimal_mm / 6, optimal_mm * 6, 31)) {
    const psf = await psf_or_nothing(
      source,
      {
        camera: camera_with(diameter_mm),
        object_distance_m: subject_m,
        radii_um: [0],
        frequencies_per_mm: [0],
        fractions: [kAiryShare],
      },
      signal,
    );
    if (psf === undefined) continue;
    geometric.push([diameter_mm, psf.geometric_diameter_um]);
    airy.push([diameter_mm, psf.airy_diameter_um]);
    wave.push([diameter_mm, spot_um(psf)]);
  }
  const plot: PlotSpec = {
    title:
      `Spot of a point at ${quantity(subject_m, "m")}, ${quantity(image_distance_mm, "mm")} ` +
      `behind the hole, ${quantity(state.wavelength_nm, "nm")}`,
    file: "pinhole-sharpness",
    x: { caption: "diameter of the hole, mm", scale: "log" },
    y: { caption: "diameter of the spot, µm", scale: "log" },
    series: [
      { name: "geometric: the hole's shadow", kind: "line", points: geometric },
      { name: "diffraction: Airy disc", kind: "line", points: airy },
      { name: "full wave: 83.8 % of the light", kind: "line", points: wave },
    ],
    marks: criteria
      .filter(({ criterion }) => ["brightest", "energy80", "mtf50"].includes(criterion))
      .map(({ criterion, diameter_mm }) => ({ axis: "x", at: diameter_mm, caption: criterion })),
  };
  return { plot, optimal_mm, optics };
}

/// Contrast against frequency at the subject and in focus.
export async function contrast_plot(
  source: Numbers,
  state: PlaygroundState,
  subject_m: Distance,
  signal: AbortSignal,
): Promise<PlotSpec> {
  const camera = camera_of(state);
  const nyquist_per_mm = size_of(state).width / (2 * sensor_format(state.sensor).sensor_mm[0]);
  const frequencies_per_mm = Array.from({ length: 121 }, (_, i) => (3 * nyquist_per_mm * i) / 120);
  const at = async (object_distance_m: Distance): Promise<Series["points"]> => {
    const question = { camera, object_distance_m, frequencies_per_mm, radii_um: [0] };
    const { otf } = await source.psf(question, signal);
    return otf.map((point) => [
      point.frequency_per_mm,
      typeof point.otf === "number" ? point.otf : Number.NaN,
    ]);
  };
  const points = await at(subject_m);
  const focus_m = state.focus_distance_m;
  const focused = state.camera === "lens" ? await at(focus_m) : undefined;
  return {
    title: `Contrast that is left at ${quantity(subject_m, "m")}, ${quantity(state.wavelength_nm, "nm")}`,
    file: "contrast",
    x: { caption: "frequency on the sensor, cycles per mm", scale: "linear" },
    y: { caption: "contrast; negative is reversed", scale: "linear" },
    series: [
      { name: `at the subject, ${quantity(subject_m, "m")}`, kind: "line", points },
      ...(focused
        ? [{ name: `in focus, ${quantity(focus_m, "m")}`, kind: "line" as const, points: focused }]
        : []),
    ],
    marks: [
      { axis: "x", at: nyquist_per_mm, caption: "finest the pixels show" },
      { axis: "y", at: 0.5, caption: "half" },
    ],
  };
}

/// The question behind the chart of all methods: a small picture of the present scene.
export function chart_request(state: PlaygroundState): ChartRequest {
  return {
    scene: state.scene,
    camera: camera_of(state),
    image: chart_size(state.sensor),
    samples: [1, 4, 16, 64],
    max_errors: [0.03, 0.01],
  };
}

/// Processor time against true error, by method, with what the planner chose.
export function speed_plot({ points, picks }: ChartReport): PlotSpec {
  const methods = [...new Set(points.map(({ method }) => method))];
  return {
    title: "Speed against accuracy of all methods on this scene",
    file: "speed-accuracy",
    x: { caption: "processor time, s", scale: "log" },
    y: { caption: "true error, root-mean-square", scale: "log" },
    series: [
      ...methods.map((name): Series => ({
        name,
        kind: "dots",
        points: points
          .filter(({ method }) => method === name)
          .map(({ cpu_s, true_error }) => [cpu_s, true_error.rmse_at_most]),
      })),
      ...picks.map(({ max_error, method, cpu_s, true_error }): Series => ({
        name: `chosen for ${max_error}: ${method}`,
        kind: "rings",
        points: [[cpu_s, true_error.rmse_at_most]],
      })),
    ],
    marks: picks.map(({ max_error }) => ({
      axis: "y",
      at: max_error,
      caption: `error asked for: ${max_error}`,
    })),
  };
}
