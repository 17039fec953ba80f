/// Which control a fault of the server belongs to, and what to say where there is none.
import { RefusedError } from "./api_client.ts";
import type { Fault } from "./contract.ts";
import type { PlaygroundState } from "./state.ts";

export type Field = keyof PlaygroundState;

/// What went wrong: faults with a place in the request, or a sentence about the whole.
export interface Complaint {
  faults: readonly Fault[];
  message: string;
  may_pass: boolean; // the same request may be answered another time
}
export const kNoComplaint: Complaint = { faults: [], message: "", may_pass: false };

const kFieldOfPointer: Readonly<Record<string, Field>> = {
  "#/scene": "scene",
  "#/camera/lens/focal_length_mm": "focal_length_mm",
  "#/camera/lens/f_number": "f_stop",
  "#/camera/lens/focus_distance_m": "focus_distance_m",
  "#/camera/lens/blades": "blades",
  "#/camera/lens/blade_rotation_deg": "blade_rotation_deg",
  "#/camera/breathing": "breathing",
  "#/camera/sensor_mm": "sensor",
  "#/camera/wavelength_nm": "wavelength_nm",
  "#/camera/spectrum": "spectrum",
  "#/camera/position_m": "camera_z_m",
  "#/camera/look_at_m": "camera_z_m",
  "#/camera/shutter_s": "shutter_step",
  "#/camera/exposure/iso": "iso_step",
  "#/camera/pinhole/criterion": "criterion",
  "#/camera/pinhole/image_distance_mm": "image_distance_mm",
  "#/camera/pinhole/diameter_mm": "diameter_mm",
  "#/quality/max_error": "max_error",
  "#/quality/samples": "samples",
  "#/camera/velocity_m_s": "velocity_m_s",
  "#/illumination": "illumination",
  "#/image/halftone/method": "halftone",
  "#/image/halftone/cell_px": "cell_px",
};

/// What the page calls what no control stands for.
const kWordsOfPointer: Readonly<Record<string, string>> = {
  "#/object_distances_m": "Distance of the subject",
  "#/object_distance_m": "Distance of the subject",
};
const kUnit = /_(m_s|per_mm|mm|um|nm|ms|m|s|deg|px|w)$/;

/// The place that a pointer names, in words: "#/camera/up_m/2" is "Camera, up, value 3".
export function words_of(pointer: string): string {
  const known = kWordsOfPointer[whole(pointer)];
  if (known !== undefined) return known;
  const words = pointer
    .replace(/^#/, "")
    .split("/")
    .filter((part) => part !== "")
    .map((part) =>
      /^\d+$/.test(part)
        ? `value ${Number(part) + 1}`
        : part.replaceAll("~1", "/").replaceAll("~0", "~").replace(kUnit, "").replaceAll("_", " "),
    )
    .join(", ");
  return words === "" ? "The request" : words.charAt(0).toUpperCase() + words.slice(1);
}

/// What the server says, its names of members in words: "must exceed focal_length_mm". Texts in
/// quotes are of others.
function detail_in_words(detail: string): string {
  const name = /\b[a-z]+(?:_[a-z]+)+\b/g;
  return detail
    .split(/("[^"]*")/)
    .map((part, i) =>
      i % 2 === 1 ? part : part.replace(name, (found) => found.replace(kUnit, "").replaceAll("_", " ")),
    )
    .join("");
}

/// The pointer to the list or vector that a value is in.
function whole(pointer: string): string {
  return pointer.replace(/(\/\d+)+$/, "");
}

export function complaint_of(error: unknown): Complaint {
  const faults = error instanceof RefusedError ? (error.problem.errors ?? []) : [];
  const may_pass = !(error instanceof RefusedError) || error.status >= 500;
  if (faults.length > 0) return { faults, message: "", may_pass };
  return { faults: [], message: error instanceof Error ? error.message : String(error), may_pass };
}

/// The complaint in sentences that need no control beside them.
export function sentences_of({ message, faults }: Complaint): string[] {
  const told = faults.map(
    ({ pointer, detail }) => `${words_of(pointer)}: ${detail_in_words(detail)}`,
  );
  return [...new Set(message === "" ? told : [message, ...told])];
}

export type FieldFaults = ReadonlyMap<Field, readonly string[]>;
/// One for all, so that controls without faults are not drawn anew with every picture.
export const kNoFaults: FieldFaults = new Map();

/// The faults by control, each once; `elsewhere` has those that no control shows.
export function sorted_faults(faults: readonly Fault[]): { at: FieldFaults; elsewhere: string[] } {
  const at = new Map<Field, string[]>();
  const elsewhere: string[] = [];
  for (const { pointer, detail } of faults) {
    const field = kFieldOfPointer[whole(pointer)];
    const details = field === undefined ? elsewhere : (at.get(field) ?? []);
    const words = detail_in_words(detail);
    const text = field === undefined ? `${words_of(pointer)}: ${words}` : words;
    if (!details.includes(text)) details.push(text);
    if (field !== undefined) at.set(field, details);
  }
  return { at: at.size === 0 ? kNoFaults : at, elsewhere };
}
