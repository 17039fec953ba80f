/// What the playground shows, and its text in the address: the page holds no other state.
import type { Camera, Distance } from "./contract.ts";
import { f_number_of_step, nominal_label, step_of_label } from "./third_stops.ts";

export interface PlaygroundState {
  scene: string; // empty: the first scene that the server lists
  camera: "lens" | "pinhole";
  focal_length_mm: number;
  f_stop: number; // third stops from f/1
  focus_distance_m: Distance;
  breathing: boolean;
  image_distance_mm: number;
  diameter_mm: number | "optimal";
  max_error: number;
}

export type StateChange = Partial<PlaygroundState>;

export const kDefaultState: PlaygroundState = {
  scene: "",
  camera: "lens",
  focal_length_mm: 50,
  f_stop: 3,
  focus_distance_m: 2,
  breathing: true,
  image_distance_mm: 50,
  diameter_mm: "optimal",
  max_error: 0.01,
};

/// The address fragment of a state, "#scene=...&camera=lens&...": every member that counts for
/// its camera, so that a shared link keeps its picture when the defaults change.
export function fragment_of(state: PlaygroundState): string {
  const text = new URLSearchParams();
  if (state.scene !== "") text.set("scene", state.scene);
  text.set("camera", state.camera);
  if (state.camera === "lens") {
    text.set("focal_length_mm", String(state.focal_length_mm));
    text.set("f_number", nominal_label(state.f_stop));
    text.set("focus_distance_m", String(state.focus_distance_m));
    text.set("breathing", String(state.breathing));
  } else {
    text.set("image_distance_mm", String(state.image_distance_mm));
    text.set("diameter_mm", String(state.diameter_mm));
  }
  text.set("max_error", String(state.max_error));
  return `#${text.toString()}`;
}

/// The state that a fragment names. A member that is absent or unreadable keeps its default;
/// whether a readable value makes sense is for the server to say.
export function state_of(fragment: string): PlaygroundState {
  const text = new URLSearchParams(fragment.replace(/^#/, ""));
  const state = { ...kDefaultState };
  const assign = <Key extends keyof PlaygroundState>(
    key: Key,
    parameter: string,
    read: (value: string) => PlaygroundState[Key] | undefined,
  ): void => {
    const value = text.get(parameter);
    state[key] = (value === null ? undefined : read(value)) ?? state[key];
  };
  assign("scene", "scene", (value) => value);
  assign("camera", "camera", (value) => one_of(value, ["lens", "pinhole"] as const));
  assign("focal_length_mm", "focal_length_mm", number_of);
  assign("f_stop", "f_number", step_of_label);
  assign("focus_distance_m", "focus_distance_m", distance_of);
  assign("breathing", "breathing", (value) =>
    value === "true" ? true : value === "false" ? false : undefined,
  );
  assign("image_distance_mm", "image_distance_mm", number_of);
  assign("diameter_mm", "diameter_mm", (value) => (value === "optimal" ? value : number_of(value)));
  assign("max_error", "max_error", number_of);
  return state;
}

/// The `camera` member of a request.
export function camera_of(state: PlaygroundState): Camera {
  const { focal_length_mm, focus_distance_m, image_distance_mm, diameter_mm, breathing } = state;
  return state.camera === "lens"
    ? {
        lens: { focal_length_mm, f_number: f_number_of_step(state.f_stop), focus_distance_m },
        breathing,
      }
    : { pinhole: { image_distance_mm, diameter_mm } };
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

function one_of<Choice extends string>(
  text: string,
  choices: readonly Choice[],
): Choice | undefined {
  return choices.find((choice) => choice === text);
}
