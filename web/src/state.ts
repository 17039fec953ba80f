/// What the playground photographs, and its text in the address.
import type { Camera, Distance, PinholeCriterion } from "./contract.ts";
import { kSensorNames, sensor_format } from "./sensor_formats.ts";
import type { SensorName } from "./sensor_formats.ts";
import {
  f_number_of_step,
  index_on,
  kIsoSpeeds,
  kShutterTimes,
  moved_on,
  nominal_label,
  step_of_label,
} from "./third_stops.ts";

/// relative: as bright at every f-stop. manual: stopping down darkens. time, iso: that one follows
/// the f-stop, step for step, and keeps the exposure.
export const kExposures = ["relative", "manual", "time", "iso"] as const;
export type Exposure = (typeof kExposures)[number];

export const kCriteria = [
  "brightest",
  "peak-per-energy",
  "energy50",
  "energy80",
  "mtf50",
  "mtf10",
  "line-spread",
  "fwhm",
  "rayleigh",
  "petzval",
] as const satisfies readonly PinholeCriterion[];

export const kIlluminations = ["local", "recursive", "global"] as const;
/// Empty: as the scene has it.
export const kFilters = [
  "",
  "nearest",
  "bilinear",
  "mipmap",
  "anisotropic",
  "summed-area",
  "stochastic",
  "brute-force",
] as const;
export const kShadings = ["", "phong", "blinn-phong"] as const;
export const kInterpolations = ["", "flat", "gouraud", "phong"] as const;
/// Empty: none.
export const kHalftones = [
  "",
  "clustered-dot",
  "dispersed-dot",
  "varying-dot",
  "error-diffusion",
] as const;
export type Halftone = (typeof kHalftones)[number];

export interface PlaygroundState {
  scene: string; // empty: the first scene that the server lists
  camera: "lens" | "pinhole";
  sensor: SensorName;
  focal_length_mm: number;
  f_stop: number; // third stops from f/1
  focus_distance_m: Distance;
  blades: number;
  blade_rotation_deg: number;
  breathing: boolean;
  lock_framing: boolean;
  image_distance_mm: number;
  diameter_mm: number | "optimal";
  criterion: PinholeCriterion;
  wavelength_nm: number;
  spectrum: "rgb" | "monochromatic";
  camera_z_m: number; // where the camera stands on the scene's axis; it looks along -z
  exposure: Exposure;
  shutter_step: number; // of kShutterTimes
  iso_step: number; // of kIsoSpeeds
  max_error: number;
  samples: number; // of a pixel; 0: as many as max_error needs
  velocity_m_s: number; // of the camera, to the right, while the shutter is open
  illumination: (typeof kIlluminations)[number];
  filter: (typeof kFilters)[number]; // of all textures
  shading: (typeof kShadings)[number]; // of all materials that answer to light
  interpolation: (typeof kInterpolations)[number]; // of all meshes
  halftone: Halftone;
  cell_px: number; // of the halftone
}

export type StateChange = Partial<PlaygroundState>;

export const kDefaultState: PlaygroundState = {
  scene: "",
  camera: "lens",
  sensor: "full-frame",
  focal_length_mm: 50,
  f_stop: 3,
  focus_distance_m: 2,
  blades: 0,
  blade_rotation_deg: 0,
  breathing: true,
  lock_framing: false,
  image_distance_mm: 50,
  diameter_mm: "optimal",
  criterion: "brightest",
  wavelength_nm: 550,
  spectrum: "rgb",
  camera_z_m: 0,
  exposure: "relative",
  shutter_step: 36,
  iso_step: 0,
  max_error: 0.01,
  samples: 0,
  velocity_m_s: 0,
  illumination: "recursive",
  filter: "",
  shading: "",
  interpolation: "",
  halftone: "",
  cell_px: 4,
};

/// How a member is written to the address and read from it. `always` members are written even
/// where they have their default, so that a shared link keeps its picture when defaults change.
interface Member<Key extends keyof PlaygroundState> {
  key: Key;
  parameter: string;
  of: "both" | "lens" | "pinhole";
  always: boolean;
  text: (value: PlaygroundState[Key]) => string;
  read: (text: string) => PlaygroundState[Key] | undefined;
}
type AnyMember = { [Key in keyof PlaygroundState]: Member<Key> }[keyof PlaygroundState];

function member<Key extends keyof PlaygroundState>(
  key: Key,
  of: Member<Key>["of"],
  read: Member<Key>["read"],
  more: Partial<Member<Key>> = {},
): AnyMember {
  // The union of all keys' members; its parts are only ever used together.
  return { key, parameter: key, of, always: false, text: String, read, ...more } as AnyMember;
}

const kAlways = { always: true } as const;
const kMembers: readonly AnyMember[] = [
  member("camera", "both", (text) => one_of(text, ["lens", "pinhole"] as const), kAlways),
  member("sensor", "both", (text) => one_of(text, kSensorNames)),
  member("focal_length_mm", "lens", number_of, kAlways),
  member("f_stop", "lens", step_of_label, {
    parameter: "f_number",
    always: true,
    text: nominal_label,
  }),
  member("focus_distance_m", "lens", distance_of, kAlways),
  member("breathing", "lens", truth_of, kAlways),
  member("blades", "lens", number_of),
  member("blade_rotation_deg", "lens", number_of),
  member("lock_framing", "lens", truth_of),
  member("image_distance_mm", "pinhole", number_of, kAlways),
  member(
    "diameter_mm",
    "pinhole",
    (text) => (text === "optimal" ? text : number_of(text)),
    kAlways,
  ),
  member("criterion", "pinhole", (text) => one_of(text, kCriteria)),
  member("wavelength_nm", "both", number_of),
  member("spectrum", "both", (text) => one_of(text, ["rgb", "monochromatic"] as const)),
  member("camera_z_m", "both", number_of),
  member("exposure", "both", (text) => one_of(text, kExposures)),
  member("shutter_step", "both", (text) => index_on(kShutterTimes, text), {
    parameter: "shutter",
    text: (step) => kShutterTimes.labels[step] ?? "",
  }),
  member("iso_step", "both", (text) => index_on(kIsoSpeeds, text), {
    parameter: "iso",
    text: (step) => kIsoSpeeds.labels[step] ?? "",
  }),
  member("max_error", "both", number_of, kAlways),
  member("samples", "both", number_of),
  member("velocity_m_s", "both", number_of),
  member("illumination", "both", (text) => one_of(text, kIlluminations)),
  member("filter", "both", (text) => one_of(text, kFilters)),
  member("shading", "both", (text) => one_of(text, kShadings)),
  member("interpolation", "both", (text) => one_of(text, kInterpolations)),
  member("halftone", "both", (text) => one_of(text, kHalftones)),
  member("cell_px", "both", number_of),
];

/// Writes every member that counts for the camera, each name behind `prefix`.
export function write_state(text: URLSearchParams, state: PlaygroundState, prefix = ""): void {
  if (state.scene !== "") text.set(`${prefix}scene`, state.scene);
  for (const { key, parameter, of, always, text: text_of } of kMembers) {
    const counts = of === "both" || of === state.camera;
    if (!counts || (!always && state[key] === kDefaultState[key])) continue;
    text.set(prefix + parameter, (text_of as (value: unknown) => string)(state[key]));
  }
}

/// The state that the parameters behind `prefix` name. A member that is absent or unreadable
/// keeps its default (see is_readable); whether a readable value makes sense is for the server to
/// say.
export function read_state(text: URLSearchParams, prefix = ""): PlaygroundState {
  const found: Record<string, unknown> = {};
  for (const { key, parameter, read } of kMembers) {
    const written = text.get(prefix + parameter);
    const value = written === null ? undefined : read(written);
    if (value !== undefined) found[key] = value;
  }
  return { ...kDefaultState, ...found, scene: text.get(`${prefix}scene`) ?? "" };
}

/// Whether a parameter of the address, without its prefix, is a member and its text a value of it.
export function is_readable(parameter: string, text: string): boolean {
  if (parameter === "scene") return text !== "";
  const found = kMembers.find((one) => one.parameter === parameter);
  return found?.read(text) !== undefined;
}

/// The address fragment of a state, "#scene=...&camera=lens&...".
export function fragment_of(state: PlaygroundState): string {
  const text = new URLSearchParams();
  write_state(text, state);
  return `#${text.toString()}`;
}

export function state_of(fragment: string): PlaygroundState {
  return read_state(new URLSearchParams(fragment.replace(/^#/, "")));
}

/// The `camera` member of a request. What has its default in the contract stays away.
export function camera_of(state: PlaygroundState): Camera {
  const z_m = state.camera_z_m;
  return {
    ...(z_m === 0 ? {} : { position_m: [0, 0, z_m], look_at_m: [0, 0, z_m - 1] }),
    ...(state.sensor === "full-frame" ? {} : { sensor_mm: sensor_format(state.sensor).sensor_mm }),
    ...(state.camera === "lens" ? lens_of(state) : pinhole_of(state)),
    ...(state.wavelength_nm === 550 ? {} : { wavelength_nm: state.wavelength_nm }),
    ...(state.spectrum === "rgb" ? {} : { spectrum: state.spectrum }),
    ...(state.velocity_m_s === 0 ? {} : motion_of(state)),
    ...(state.exposure === "relative" ? {} : exposure_of(state)),
  } as Camera;
}

function lens_of(state: PlaygroundState): Partial<Camera> {
  const { focal_length_mm, focus_distance_m, blades, blade_rotation_deg, breathing } = state;
  const f_number = f_number_of_step(state.f_stop);
  const iris = blades === 0 ? {} : { blades, blade_rotation_deg };
  return { lens: { focal_length_mm, f_number, focus_distance_m, ...iris }, breathing };
}

function pinhole_of({ image_distance_mm, diameter_mm, criterion }: PlaygroundState) {
  const by = diameter_mm === "optimal" && criterion !== "brightest" ? { criterion } : {};
  return { pinhole: { image_distance_mm, diameter_mm, ...by } };
}

function motion_of({ velocity_m_s, shutter_step }: PlaygroundState): Partial<Camera> {
  return { velocity_m_s: [velocity_m_s, 0, 0], shutter_s: kShutterTimes.value(shutter_step) };
}

function exposure_of(state: PlaygroundState): Partial<Camera> {
  const iso = kIsoSpeeds.value(state.iso_step);
  return { shutter_s: kShutterTimes.value(state.shutter_step), exposure: { iso } };
}

/// A change and what follows from it: time or ISO keep the exposure where they are told to, and
/// with locked framing the focused subject keeps its size. Its image is as large as before where
/// distance and focal length keep their ratio; the camera moves by the difference.
export function with_consequences(state: PlaygroundState, change: StateChange): PlaygroundState {
  const wanted = { ...state, ...change };
  const stops = wanted.f_stop - state.f_stop;
  if (wanted.exposure === "time" && stops !== 0)
    wanted.shutter_step = moved_on(kShutterTimes, state.shutter_step, -stops);
  if (wanted.exposure === "iso" && stops !== 0)
    wanted.iso_step = moved_on(kIsoSpeeds, state.iso_step, stops);
  const from_m = state.focus_distance_m;
  if (wanted.lock_framing && change.focal_length_mm !== undefined && from_m !== "infinity") {
    const ratio = wanted.focal_length_mm / state.focal_length_mm;
    const to_m = rounded(from_m * ratio);
    wanted.focus_distance_m = to_m;
    wanted.camera_z_m = rounded(state.camera_z_m + to_m - from_m);
  }
  return wanted;
}

const kOfTheView = [
  "scene",
  "camera",
  "sensor",
  "focal_length_mm",
  "breathing",
  "image_distance_mm",
  "camera_z_m",
] as const;
const kOfTheBlur = [...kOfTheView, "f_stop", "focus_distance_m", "diameter_mm", "criterion"] as const;

/// Whether the same things are seen at the same places: their depths hold for both, but for the
/// little that focus breathing moves them.
export function same_view(a: PlaygroundState, b: PlaygroundState): boolean {
  return kOfTheView.every((key) => a[key] === b[key]);
}

/// Whether they are as blurred too.
export function same_blur(a: PlaygroundState, b: PlaygroundState): boolean {
  return kOfTheBlur.every((key) => a[key] === b[key]);
}

/// To tenths of a millimetre: beyond what a picture shows, and short in the address.
export function rounded(value_m: number): number {
  return Math.round(value_m * 1e4) / 1e4;
}

/// A typed number, or nothing if the text is not one. JSON has no other numbers than finite ones.
export function number_of(text: string): number | undefined {
  const value = text.trim() === "" ? Number.NaN : Number(text);
  return Number.isFinite(value) ? value : undefined;
}

/// A typed distance: a number, or infinity as a word or as its sign.
export function distance_of(text: string): Distance | undefined {
  return /^\s*(inf|infinity|∞)\s*$/i.test(text) ? "infinity" : number_of(text);
}

function truth_of(text: string): boolean | undefined {
  return text === "true" ? true : text === "false" ? false : undefined;
}

function one_of<Choice extends string>(
  text: string,
  choices: readonly Choice[],
): Choice | undefined {
  return choices.find((choice) => choice === text);
}
