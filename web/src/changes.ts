/// What components report to the page.
import type { Distance } from "./contract.ts";
import type { PicturePoint } from "./page_state.ts";
import type { StateChange } from "./state.ts";

/// A change that the user made; `settled` is false while a slider is still held.
export class StateChangeEvent extends CustomEvent<{ change: StateChange; settled: boolean }> {
  constructor(change: StateChange, settled: boolean) {
    super("state-change", { detail: { change, settled }, bubbles: true, composed: true });
  }
}

/// The subject is wanted at another distance from the camera.
export class SubjectMoveEvent extends CustomEvent<{ subject_m: Distance; settled: boolean }> {
  constructor(subject_m: Distance, settled: boolean) {
    super("subject-move", { detail: { subject_m, settled }, bubbles: true, composed: true });
  }
}

/// A place was chosen in the picture of a side; `distance_m` is the server's depth there.
export class PickEvent extends CustomEvent<{
  point: PicturePoint;
  distance_m: Distance;
  focus: boolean;
  side: "a" | "b";
}> {
  constructor(point: PicturePoint, distance_m: Distance, focus: boolean, side: "a" | "b") {
    const detail = { point, distance_m, focus, side };
    super("pick", { detail, bubbles: true, composed: true });
  }
}
