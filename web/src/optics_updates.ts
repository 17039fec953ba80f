/// The numbers of the camera, asked for at distances that span a room and a landscape.
import type { ApiClient } from "./api_client.ts";
import type { Distance, OpticsReport, OpticsRequest } from "./contract.ts";
import { complaint_of, kNoComplaint } from "./faults.ts";
import type { Complaint } from "./faults.ts";
import { kDraggingPace } from "./latest_task.ts";
import type { Pace } from "./latest_task.ts";
import { patiently, size_of } from "./picture_updates.ts";
import { camera_of } from "./state.ts";
import type { PlaygroundState } from "./state.ts";

/// `optics` are those of the state `of` and of the subject at `subject_m`, whose row is at that
/// distance.
export interface OpticsView {
  optics: OpticsReport | undefined;
  of: PlaygroundState | undefined;
  subject_m: Distance | undefined;
  complaint: Complaint;
}
export const kNoOptics: OpticsView = {
  optics: undefined,
  of: undefined,
  subject_m: undefined,
  complaint: kNoComplaint,
};

export interface OpticsQuestion {
  state: PlaygroundState;
  subject_m: Distance;
}

/// As often as pictures come while a hand drags: drawing numbers more often takes their time.
export const kNumbersPace: Pace = { ...kDraggingPace, held_ms: 50 };

const kDistances_m: readonly number[] = [0.5, 1, 2, 3, 5, 10, 20, 50];

/// The answer to the newest camera, or why there is none; nothing when `signal` aborts.
export async function optics_update(
  source: Pick<ApiClient, "optics">,
  { state, subject_m }: OpticsQuestion,
  signal: AbortSignal,
): Promise<Partial<OpticsView>> {
  const request = optics_request(state, subject_m);
  try {
    const attempts = patiently("refining", (s) => source.optics(request, s), signal);
    for (;;) {
      const { done, value } = await attempts.next();
      if (done) return { optics: value, of: state, subject_m, complaint: kNoComplaint };
    }
  } catch (error) {
    return signal.aborted ? {} : { complaint: complaint_of(error) };
  }
}

/// The distances of the table: the fixed ones, the focused plane and the subject among them, and
/// infinity.
export function table_distances(state: PlaygroundState, subject_m: Distance): Distance[] {
  const focus = state.camera === "lens" ? state.focus_distance_m : "infinity";
  const wanted = [...kDistances_m, focus, subject_m];
  const finite = wanted.filter((distance): distance is number => distance !== "infinity");
  return [...[...new Set(finite)].sort((a, b) => a - b), "infinity"];
}

export function optics_request(state: PlaygroundState, subject_m: Distance): OpticsRequest {
  return {
    camera: camera_of(state),
    image: size_of(state),
    object_distances_m: table_distances(state, subject_m),
  };
}
