/// The numbers of the camera, asked for at distances that span a room and a landscape.
import { BusyError } from "./api_client.ts";
import type { ApiClient } from "./api_client.ts";
import type { Distance, OpticsReport, OpticsRequest } from "./contract.ts";
import { complaint_of, kNoComplaint } from "./faults.ts";
import type { Complaint } from "./faults.ts";
import { kPictureSize, pause } from "./picture_updates.ts";
import { camera_of } from "./state.ts";
import type { PlaygroundState } from "./state.ts";

export interface OpticsView {
  optics: OpticsReport | undefined;
  complaint: Complaint;
}
export const kNoOptics: OpticsView = { optics: undefined, complaint: kNoComplaint };

const kDistances_m: readonly number[] = [0.5, 1, 2, 3, 5, 10, 20, 50];

/// The answer to the newest camera, or why there is none; nothing when `signal` aborts.
export async function optics_update(
  source: Pick<ApiClient, "optics">,
  state: PlaygroundState,
  signal: AbortSignal,
): Promise<Partial<OpticsView>> {
  try {
    for (;;) {
      try {
        const optics = await source.optics(optics_request(state), signal);
        return { optics, complaint: kNoComplaint };
      } catch (error) {
        if (!(error instanceof BusyError)) throw error;
        await pause(error.retry_after_ms, signal);
      }
    }
  } catch (error) {
    return signal.aborted ? {} : { complaint: complaint_of(error) };
  }
}

/// The distances of the table: the fixed ones, the focused plane among them, and infinity.
export function table_distances(state: PlaygroundState): Distance[] {
  const focus = state.camera === "lens" ? state.focus_distance_m : "infinity";
  const finite = focus === "infinity" ? kDistances_m : [...kDistances_m, focus];
  return [...[...new Set(finite)].sort((a, b) => a - b), "infinity"];
}

function optics_request(state: PlaygroundState): OpticsRequest {
  return {
    camera: camera_of(state),
    image: kPictureSize,
    object_distances_m: table_distances(state),
  };
}
