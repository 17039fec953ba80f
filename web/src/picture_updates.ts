/// The way from a state to its picture: a preview at once, a better one, then the picture that was
/// asked for; and the layers that tell depth and blur at its pixels.
import { BusyError, UnreachableError } from "./api_client.ts";
import type { ApiClient, RenderedImage } from "./api_client.ts";
import type { ImageSize, RenderReport, RenderRequest } from "./contract.ts";
import type { Layer } from "./exr.ts";
import { complaint_of, kNoComplaint } from "./faults.ts";
import type { Complaint } from "./faults.ts";
import type { PreviewPace } from "./preview_pace.ts";
import { picture_size, preview_size, sensor_format } from "./sensor_formats.ts";
import type { RenderProgress } from "./render_jobs.ts";
import { learn_scene, scene_of } from "./scene_looks.ts";
import { camera_of, same_blur, same_view } from "./state.ts";
import type { PlaygroundState } from "./state.ts";
import { told } from "./told.ts";

interface Pass {
  activity: Activity;
  size: (state: PlaygroundState) => ImageSize;
  format: "png" | "jpeg"; // JPEG takes a fifth of the time to encode
  least_error: number; // of max_error: more would be lost on so small a picture
  max_time_ms?: number;
  layers: boolean;
  progress: boolean; // worth to be told of
  previews: boolean; // shown, where the server has some before the picture
}
const kFinalPass: Pass = {
  activity: "refining",
  size: size_of,
  format: "png",
  least_error: 0,
  layers: true,
  progress: true,
  previews: false, // smaller than what is there already
};
const kPreviewPass: Pass = {
  activity: "preview",
  size: ({ sensor }) => preview_size(sensor),
  format: "jpeg",
  least_error: 0.1,
  max_time_ms: 50,
  layers: false,
  progress: false,
  previews: false,
};
const kLaterPasses: readonly Pass[] = [
  {
    activity: "refining",
    size: ({ sensor }) => preview_size(sensor),
    format: "png",
    least_error: 0.03,
    layers: true,
    progress: true,
    previews: true,
  },
  kFinalPass,
];
const kThumbnailPass: Pass = {
  activity: "refining",
  size: ({ sensor }) => sensor_format(sensor).previews[0],
  format: "jpeg",
  least_error: 0.05,
  layers: false,
  progress: false,
  previews: false,
};
/// A hand that drags gets its next preview before the picture is refined.
const kRefinementDelay_ms = 80;
const kHeldTime_ms = 20;
const kFirstRetry_ms = 500;
const kLastRetry_ms = 8000;

/// waiting: the server has no room. away: it does not answer.
export type Activity = "idle" | "preview" | "refining" | "waiting" | "away";

/// What the server tells of each pixel of a picture.
export interface Layers {
  depth_m: Layer;
  coc_px: Layer; // pixels of this layer's own raster, near negative
}

/// What the page knows of its picture, which is to be of the state `wanted`. `image` shows the state
/// `shown`; `report` is the newest that
/// has come, of `image` if it has its id; `layers` are of a picture of `layers_of`.
export interface PictureView {
  activity: Activity;
  since_ms: number; // of the activity, by performance.now()
  progress: RenderProgress | undefined; // of the picture that was asked for, where it is told
  wanted: PlaygroundState | undefined;
  image: RenderedImage | undefined;
  shown: PlaygroundState | undefined;
  report: RenderReport | undefined;
  layers: Layers | undefined;
  layers_of: PlaygroundState | undefined;
  complaint: Complaint;
}
/// Layers as far as they hold for a picture; `blur_holds`: their blur does, not only their depth.
export interface HeldLayers {
  layers: Layers | undefined;
  blur_holds: boolean;
}

/// What the layers of a view tell of the picture that it shows.
export function held_layers({ layers, layers_of, shown }: PictureView): HeldLayers {
  if (!layers_of || !shown || !same_view(layers_of, shown))
    return { layers: undefined, blur_holds: false };
  return { layers, blur_holds: same_blur(layers_of, shown) };
}

/// Whether what is shown is of older settings because the server refused the present ones.
export function is_outdated({ complaint, shown, wanted }: PictureView): boolean {
  return complaint !== kNoComplaint && shown !== undefined && shown !== wanted;
}

export const kNoPicture: PictureView = {
  activity: "idle",
  since_ms: 0,
  progress: undefined,
  wanted: undefined,
  image: undefined,
  shown: undefined,
  report: undefined,
  layers: undefined,
  layers_of: undefined,
  complaint: kNoComplaint,
};

/// Whether a hand holds what changes, and how fast previews come.
export interface Hand {
  pace: PreviewPace;
  is_held: boolean;
}

/// The calls that a picture needs.
export type PictureSource = Pick<ApiClient, "render" | "report" | "layer" | "scene">;

/// Yields what changes on the way. `hand`: while it is still moving, the first preview is as large
/// as it may be to come in time. Ends early, saying nothing more, when `signal` aborts;
/// an error becomes the last update.
export async function* picture_updates(
  source: PictureSource,
  state: PlaygroundState,
  signal: AbortSignal,
  hand?: Hand,
): AsyncGenerator<Partial<PictureView>, void> {
  try {
    yield { complaint: kNoComplaint, progress: undefined, wanted: state };
    yield* patiently("preview", (s) => learn_scene(source, state, s), signal);
    const first = hand?.is_held ? held_pass(state, hand.pace) : kPreviewPass;
    for (const pass of [first, ...kLaterPasses]) {
      const { activity } = pass;
      const request = pass_request(state, pass);
      const attempts = patiently(
        activity,
        (s, tell) => source.render(request, s, pass.progress ? tell : undefined),
        signal,
      );
      let step = await attempts.next();
      for (; !step.done; step = await attempts.next()) {
        const preview = pass.previews ? image_of(step.value.progress) : undefined;
        yield preview ? { ...step.value, image: preview, shown: state } : step.value;
      }
      const image = step.value;
      if (pass === first) hand?.pace.learn(pass.size(state), image.round_trip_ms);
      yield { image, shown: state, progress: undefined };
      if (pass.max_time_ms !== undefined) await pause(kRefinementDelay_ms, signal);
      // The server does not keep what was made against the clock, nor its report.
      if (image.id === "" || pass.max_time_ms !== undefined) continue;
      const report = yield* patiently(activity, (s) => source.report(image.id, s), signal);
      yield { report };
      if (!pass.layers) continue;
      const layers = yield* patiently(activity, (s) => layers_of(source, image.id, s), signal);
      yield { layers, layers_of: state };
    }
    yield { activity: "idle" };
  } catch (error) {
    if (!signal.aborted) yield { activity: "idle", complaint: complaint_of(error) };
  }
}

/// Tries until the server has room, waiting as long as it asks, and until it answers, waiting
/// longer each time.
export async function* patiently<Answer>(
  activity: Activity,
  attempt: (signal: AbortSignal, tell: (progress: RenderProgress) => void) => Promise<Answer>,
  signal: AbortSignal,
): AsyncGenerator<Partial<PictureView>, Answer> {
  let retry_ms = kFirstRetry_ms;
  for (;;) {
    yield { activity, since_ms: performance.now() };
    try {
      const task = told<RenderProgress, Answer>((tell) => attempt(signal, tell));
      for (;;) {
        const { done, value } = await task.next();
        if (done) return value;
        signal.throwIfAborted();
        yield { progress: value };
      }
    } catch (error) {
      if (error instanceof BusyError) {
        yield { activity: "waiting", since_ms: performance.now() };
        await pause(error.retry_after_ms, signal);
      } else if (error instanceof UnreachableError) {
        yield { activity: "away", since_ms: performance.now() };
        await pause(retry_ms, signal);
        retry_ms = Math.min(2 * retry_ms, kLastRetry_ms);
      } else throw error;
    }
  }
}

/// A render's preview as a picture that the server does not keep.
function image_of(progress: RenderProgress | undefined): RenderedImage | undefined {
  const { preview, upper_95 } = progress ?? {};
  if (preview === undefined) return undefined;
  const error = new Map(upper_95 === undefined ? [] : [["upper_95", upper_95]]);
  const timings_ms = new Map<string, number>();
  return { id: "", method: "", error, picture: preview, round_trip_ms: 0, timings_ms };
}

async function layers_of(
  source: PictureSource,
  id: string,
  signal: AbortSignal,
): Promise<Layers> {
  const [depth_m, coc_px] = await Promise.all([
    source.layer(id, "depth", signal),
    source.layer(id, "coc", signal),
  ]);
  return { depth_m, coc_px };
}

/// Small and quick enough that a hand that drags sees twenty a second.
function held_pass(state: PlaygroundState, pace: PreviewPace): Pass {
  const { previews } = sensor_format(state.sensor);
  return { ...kPreviewPass, size: () => pace.size_among(previews), max_time_ms: kHeldTime_ms };
}

/// The request for the finished picture: what the address stands for.
export function render_request(state: PlaygroundState): RenderRequest {
  return pass_request(state, kFinalPass);
}

/// The finished picture's size.
export function size_of(state: PlaygroundState): ImageSize {
  return picture_size(state.sensor);
}

function pass_request(state: PlaygroundState, pass: Pass): RenderRequest {
  const { size, format, least_error, max_time_ms } = pass;
  const { halftone, illumination, samples } = state;
  return {
    scene: scene_of(state),
    camera: camera_of(state),
    image: { ...size(state), format, ...(halftone === "" ? {} : { halftone: halftone_of(state) }) },
    quality: {
      max_error: Math.max(least_error, state.max_error),
      ...(max_time_ms === undefined ? {} : { max_time_ms }),
      // Previews against the clock have as many as there is time for.
      ...(samples === 0 || max_time_ms !== undefined ? {} : forced(samples)),
    },
    ...(illumination === "recursive" ? {} : { illumination }),
    ...(pass.layers ? { outputs: ["color", "depth", "coc"] } : {}),
  } as RenderRequest;
}

/// So many samples, side by side: a texture lookup averages over its share of the pixel.
function forced(samples: number) {
  return { samples, texture_width_px: 1 / Math.sqrt(samples) };
}

function halftone_of({ halftone, cell_px }: PlaygroundState) {
  return halftone === "error-diffusion" ? { method: halftone } : { method: halftone, cell_px };
}

/// A small picture of what a state shows, for a list of them.
export function thumbnail_request(state: PlaygroundState): RenderRequest {
  return pass_request(state, kThumbnailPass);
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
