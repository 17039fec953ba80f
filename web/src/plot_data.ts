/// The numbers behind the plots, asked from the server, and what they look like as plots.
import type { ApiClient } from "./api_client.ts";
import type { Camera, ChartReport, ChartRequest, Distance } from "./contract.ts";
import type { OpticsReport, PsfReport } from "./contract.ts";
import { quantity } from "./format.ts";
import { size_of } from "./picture_updates.ts";
import type { PlotSpec, Series } from "./plot_spec.ts";
import { chart_size, sensor_format } from "./sensor_formats.ts";
import { camera_of } from "./state.ts";
import type { PlaygroundState } from "./state.ts";

type Numbers = Pick<ApiClient, "optics" | "psf">;

/// The Airy disc holds 83.8 % of a focused point's light; so do all spots here.
const kAiryShare = 0.8377;
/// Beyond so many Airy discs of blur the wave adds nothing that a plot of spots shows.
const kWaveReach = 1000;
/// The server's limit, 10,000 rad of defocus: beyond it there is no transfer either. A disc of n
/// Airy discs has 1.22 pi n rad.
const kWaveLimit = 10_000 / (1.22 * Math.PI);
/// Beyond so many an iris's waves take too long for a plot; a round one of its area then holds as
/// much light within the same circle to a fifth of a per cent.
const kIrisReach = 40;
const kFewDistances = 25;
const kManyDistances = 120;

/// `count` values from the first to the last, in equal ratios, to four digits.
export function ratios(first: number, last: number, count: number): number[] {
  const step = (last / first) ** (1 / (count - 1));
  return Array.from({ length: count }, (_, i) => Number((first * step ** i).toPrecision(4)));
}

function spot_um({ encircled_energy }: PsfReport): number {
  const radius = encircled_energy[0]?.radius_um;
  return typeof radius === "number" ? 2 * radius : Number.NaN;
}

/// Blur on the sensor against the distance of the object, and the numbers it is drawn from.
export async function blur_plot(
  source: Numbers,
  state: PlaygroundState,
  signal: AbortSignal,
): Promise<{ plot: PlotSpec; optics: OpticsReport }> {
  const camera = camera_of(state);
  const nearest_m = Math.max(0.2, state.camera === "lens" ? state.focal_length_mm / 500 : 0);
  const around_m = state.camera === "lens" ? around(state.focus_distance_m) : [];
  const few_m = [...ratios(nearest_m, 100, kFewDistances), ...around_m];
  const many_m = [...new Set([...ratios(nearest_m, 100, kManyDistances), ...few_m])];
  many_m.sort((a, b) => a - b);
  const image = size_of(state);
  const optics = await source.optics({ camera, image, object_distances_m: many_m }, signal);
  const airy_um = optics.airy_diameter_um;
  const combined: [number, number][] = [];
  for (const { object_distance_m, coc_mm } of optics.at) {
    const airy_discs = (1000 * Math.abs(coc_mm)) / airy_um;
    if (!few_m.includes(Number(object_distance_m)) || airy_discs > kWaveReach) continue;
    const iris = airy_discs > kIrisReach ? camera_of({ ...state, blades: 0 }) : camera;
    const spot = { object_distance_m, radii_um: [0], frequencies_per_mm: [0] };
    const psf = await source.psf({ camera: iris, ...spot, fractions: [kAiryShare] }, signal);
    combined.push([Number(object_distance_m), spot_um(psf)]);
  }
  const pixel_um = (1000 * sensor_format(state.sensor).sensor_mm[0]) / image.width;
  const iris = state.camera === "lens" && state.blades > 0 ? `, ${state.blades} blades` : "";
  const plot: PlotSpec = {
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
      { name: `both, wave optics${iris}: 83.8 % of the light`, kind: "line", points: combined },
    ],
    marks: [
      { axis: "y", at: 1000 * optics.coc_limit_mm, caption: "still sharp" },
      { axis: "y", at: pixel_um, caption: "one pixel" },
    ],
  };
  return { plot, optics };
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
    const psf = await source.psf(
      {
        camera: camera_with(diameter_mm),
        object_distance_m: subject_m,
        radii_um: [0],
        frequencies_per_mm: [0],
        fractions: [kAiryShare],
      },
      signal,
    );
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
  const optics = await source.optics({ camera, object_distances_m: [subject_m] }, signal);
  const blur_mm = Math.abs(optics.at[0]?.coc_mm ?? 0);
  const airy_discs = (1000 * blur_mm) / optics.airy_diameter_um;
  const iris = airy_discs > kIrisReach ? camera_of({ ...state, blades: 0 }) : camera;
  const nyquist_per_mm = size_of(state).width / (2 * sensor_format(state.sensor).sensor_mm[0]);
  const frequencies_per_mm = Array.from({ length: 121 }, (_, i) => (3 * nyquist_per_mm * i) / 120);
  const at = async (camera: Camera, object_distance_m: Distance): Promise<Series["points"]> => {
    const question = { camera, object_distance_m, frequencies_per_mm, radii_um: [0] };
    const { otf } = await source.psf(question, signal);
    return otf.map((point) => [
      point.frequency_per_mm,
      typeof point.otf === "number" ? point.otf : Number.NaN,
    ]);
  };
  const is_told = airy_discs < kWaveLimit;
  const points = is_told ? await at(iris, subject_m) : [];
  const focus_m = state.focus_distance_m;
  const focused = state.camera === "lens" ? await at(camera, focus_m) : undefined;
  return {
    title: `Contrast that is left at ${quantity(subject_m, "m")}, ${quantity(state.wavelength_nm, "nm")}`,
    file: "contrast",
    x: { caption: "frequency on the sensor, cycles per mm", scale: "linear" },
    y: { caption: "contrast; negative is reversed", scale: "linear" },
    series: [
      {
        name: `at the subject, ${quantity(subject_m, "m")}${is_told ? "" : ": too blurred to tell"}`,
        kind: "line",
        points,
      },
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
