/// Which control a fault of the server belongs to, and what to say where there is none.
import { RefusedError } from "./api_client.ts";
import type { Fault } from "./contract.ts";
import type { PlaygroundState } from "./state.ts";

export type Field = keyof PlaygroundState;

/// What went wrong: faults with a place in the request, or a sentence about the whole.
export interface Complaint {
  faults: readonly Fault[];
  message: string;
}
export const kNoComplaint: Complaint = { faults: [], message: "" };

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
  "#/camera/position_m/2": "camera_z_m",
  "#/camera/shutter_s": "shutter_step",
  "#/camera/exposure/iso": "iso_step",
  "#/camera/pinhole/criterion": "criterion",
  "#/camera/pinhole/image_distance_mm": "image_distance_mm",
  "#/camera/pinhole/diameter_mm": "diameter_mm",
  "#/quality/max_error": "max_error",
  "#/quality/samples": "samples",
  "#/camera/velocity_m_s": "velocity_m_s",
  "#/camera/velocity_m_s/0": "velocity_m_s",
  "#/illumination": "illumination",
  "#/image/halftone/method": "halftone",
  "#/image/halftone/cell_px": "cell_px",
};

export function complaint_of(error: unknown): Complaint {
  const faults = error instanceof RefusedError ? (error.problem.errors ?? []) : [];
  if (faults.length > 0) return { faults, message: "" };
  return { faults: [], message: error instanceof Error ? error.message : String(error) };
}

export type FieldFaults = ReadonlyMap<Field, readonly string[]>;

/// The faults by control, each once; `elsewhere` has those that no control shows.
export function sorted_faults(faults: readonly Fault[]): { at: FieldFaults; elsewhere: string[] } {
  const at = new Map<Field, string[]>();
  const elsewhere: string[] = [];
  for (const { pointer, detail } of faults) {
    const field = kFieldOfPointer[pointer];
    const details = field === undefined ? elsewhere : (at.get(field) ?? []);
    const text = field === undefined ? `${pointer}: ${detail}` : detail;
    if (!details.includes(text)) details.push(text);
    if (field !== undefined) at.set(field, details);
  }
  return { at, elsewhere };
}
