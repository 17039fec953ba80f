/// The way from a state to its picture: two previews, each quick beside what follows it, then the
/// picture that was asked for.
import { BusyError } from "./api_client.ts";
import type { ApiClient, RenderedImage } from "./api_client.ts";
import type { ImageSize, RenderReport, RenderRequest } from "./contract.ts";
import { complaint_of, kNoComplaint } from "./faults.ts";
import type { Complaint } from "./faults.ts";
import { camera_of } from "./state.ts";
import type { PlaygroundState } from "./state.ts";

export const kPictureSize: ImageSize = { width: 960, height: 640 };

interface Pass {
  activity: Activity;
  size: ImageSize;
  least_error: number; // of max_error: more would be lost on so small a picture
  max_time_ms?: number;
}
const kPasses: readonly Pass[] = [
  { activity: "preview", size: { width: 240, height: 160 }, least_error: 0.05, max_time_ms: 120 },
  { activity: "refining", size: { width: 480, height: 320 }, least_error: 0.03 },
  { activity: "refining", size: kPictureSize, least_error: 0 },
];

export type Activity = "idle" | "preview" | "refining" | "waiting";

/// What the page knows of its picture. `image` shows the state `shown`; `report` is the newest that
/// has come, of `image` if it has its id.
export interface PictureView {
  activity: Activity;
  image: RenderedImage | undefined;
  shown: PlaygroundState | undefined;
  report: RenderReport | undefined;
  complaint: Complaint;
}
export const kNoPicture: PictureView = {
  activity: "idle",
  image: undefined,
  shown: undefined,
  report: undefined,
  complaint: kNoComplaint,
};

/// The calls that a picture needs.
export type PictureSource = Pick<ApiClient, "render" | "report">;

/// Yields what changes on the way. Ends early, saying nothing more, when `signal` aborts;
/// an error becomes the last update.
export async function* picture_updates(
  source: PictureSource,
  state: PlaygroundState,
  signal: AbortSignal,
): AsyncGenerator<Partial<PictureView>, void> {
  try {
    yield { complaint: kNoComplaint };
    for (const pass of kPasses) {
      const { activity } = pass;
      const request = render_request(state, pass);
      const image = yield* patiently(activity, (s) => source.render(request, s), signal);
      yield { image, shown: state };
      // The server does not keep what was made against the clock, nor its report.
      if (image.id === "" || pass.max_time_ms !== undefined) continue;
      const report = yield* patiently(activity, (s) => source.report(image.id, s), signal);
      yield { report };
    }
    yield { activity: "idle" };
  } catch (error) {
    if (!signal.aborted) yield { activity: "idle", complaint: complaint_of(error) };
  }
}

/// Tries until the server has room, waiting as long as it asks.
async function* patiently<Answer>(
  activity: Activity,
  attempt: (signal: AbortSignal) => Promise<Answer>,
  signal: AbortSignal,
): AsyncGenerator<Partial<PictureView>, Answer> {
  for (;;) {
    yield { activity };
    try {
      return await attempt(signal);
    } catch (error) {
      if (!(error instanceof BusyError)) throw error;
      yield { activity: "waiting" };
      await pause(error.retry_after_ms, signal);
    }
  }
}

function render_request(state: PlaygroundState, pass: Pass): RenderRequest {
  const { size, least_error, max_time_ms } = pass;
  return {
    scene: state.scene,
    camera: camera_of(state),
    image: { ...size, format: "png" },
    quality: {
      max_error: Math.max(least_error, state.max_error),
      ...(max_time_ms === undefined ? {} : { max_time_ms }),
    },
  };
}

/// Throws: the signal's reason, as soon as it aborts.
export function pause(duration_ms: number, signal: AbortSignal): Promise<void> {
  return new Promise((resolve, reject) => {
    signal.throwIfAborted();
    const abort = (): void => {
      clearTimeout(timer);
      reject(signal.reason as Error);
    };
    const timer = setTimeout(() => {
      signal.removeEventListener("abort", abort);
      resolve();
    }, duration_ms);
    signal.addEventListener("abort", abort, { once: true });
  });
}
