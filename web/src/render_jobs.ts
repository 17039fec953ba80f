/// Renders that the server goes on with by itself: followed by their events, to their picture.
import type { Job, Problem } from "./contract.ts";
import { events_of } from "./event_stream.ts";
import { RefusedError, UnreachableError } from "./reply_errors.ts";

/// How far a render is. `preview` is a picture of it, at most as wrong as `upper_95` says.
export interface RenderProgress {
  fraction: number;
  queue_place: number | undefined;
  upper_95: number | undefined;
  remaining_ms: number | undefined;
  preview: Blob | undefined;
}

/// Sends a call below the page's address; throws where there is no good answer.
export type Send = (path: string, init: RequestInit) => Promise<Response>;

const kMostReconnections = 8;
const kReconnection_ms = 400;

/// The reply with the finished picture. Throws: RefusedError where the render failed or was
/// cancelled, UnreachableError where the connection does not come back, the signal's reason where
/// it aborts; then the job is withdrawn.
export async function picture_of_job(
  { job }: Job,
  send: Send,
  signal: AbortSignal,
  tell: (progress: RenderProgress) => void,
): Promise<Response> {
  const path = `v1/jobs/${encodeURIComponent(job)}`;
  const withdraw = (): void => void send(path, { method: "DELETE" }).catch(() => undefined);
  signal.addEventListener("abort", withdraw, { once: true });
  try {
    await end_of(path, send, signal, tell);
    return await send(`${path}/image`, { headers: { Accept: "image/png" }, signal });
  } finally {
    signal.removeEventListener("abort", withdraw);
  }
}

/// Follows the events until the last, over connections that break.
async function end_of(
  path: string,
  send: Send,
  signal: AbortSignal,
  tell: (progress: RenderProgress) => void,
): Promise<void> {
  let known = "";
  let shown = ""; // the preview that was told of
  for (let connections = 0; connections < kMostReconnections; ++connections) {
    if (connections > 0) await new Promise((resolve) => setTimeout(resolve, kReconnection_ms));
    signal.throwIfAborted();
    try {
      const headers = known === "" ? {} : { "Last-Event-ID": known };
      const accept = { Accept: "text/event-stream", ...headers };
      const reply = await send(`${path}/events`, { headers: accept, signal });
      if (reply.status === 204) {
        if (is_done(await job_at(path, send, signal))) return;
        continue;
      }
      for await (const { event, data, id } of events_of(reply.body ?? new ReadableStream())) {
        known = id;
        const job = JSON.parse(data) as Job;
        if (event !== "progress" && is_done(job)) return;
        const newer = job.links.preview !== undefined && job.links.preview !== shown;
        shown = job.links.preview ?? shown;
        tell(progress_of(job, newer ? await preview_at(path, send, signal) : undefined));
      }
    } catch (error) {
      signal.throwIfAborted();
      if (!(error instanceof UnreachableError || error instanceof TypeError)) throw error;
    }
  }
  throw new UnreachableError("a job's events broke off too often");
}

async function job_at(path: string, send: Send, signal: AbortSignal): Promise<Job> {
  return (await (await send(path, { signal })).json()) as Job;
}

/// A preview may be gone before it is asked for; the next one comes.
async function preview_at(
  path: string,
  send: Send,
  signal: AbortSignal,
): Promise<Blob | undefined> {
  try {
    const reply = await send(`${path}/preview`, { headers: { Accept: "image/png" }, signal });
    return await reply.blob();
  } catch (error) {
    if (error instanceof RefusedError && error.status === 404) return undefined;
    throw error;
  }
}

/// Throws: RefusedError where it ended without a picture.
function is_done({ state, problem }: Job): boolean {
  const why: Problem = problem ?? { detail: "The render was cancelled." };
  if (state === "failed" || state === "cancelled") throw new RefusedError(why.status ?? 500, why);
  return state === "done";
}

function progress_of(
  { fraction, queue_place, upper_95, remaining_ms }: Job,
  preview: Blob | undefined,
): RenderProgress {
  return { fraction, queue_place, upper_95, remaining_ms, preview };
}
