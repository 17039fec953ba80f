/// fstop's HTTP interface as functions. The only place of the page that calls `fetch`.
import type { ChartReport, ChartRequest, OpticsReport, OpticsRequest } from "./contract.ts";
import type { MeasurementReport, MeasurementRequest } from "./contract.ts";
import type { Job, Problem, PsfReport, PsfRequest, RenderReport } from "./contract.ts";
import type { RenderRequest, Scene, SceneList, SceneSummary } from "./contract.ts";
import { events_of } from "./event_stream.ts";
import { read_layer } from "./exr.ts";
import type { Layer } from "./exr.ts";
import { picture_of_job } from "./render_jobs.ts";
import type { RenderProgress } from "./render_jobs.ts";
import { BusyError, RefusedError, UnreachableError } from "./reply_errors.ts";

export { BusyError, RefusedError, UnreachableError };

/// An image and what its reply's headers say of it; texts are empty where absent.
export interface RenderedImage {
  id: string;
  method: string;
  error: ReadonlyMap<string, number>; // estimate, upper_95
  picture: Blob;
  round_trip_ms: number;
  timings_ms: ReadonlyMap<string, number>; // empty of what the server had already, and of jobs
  was_job?: boolean; // was waited for as a job
}

export type Fetch = (input: URL, init: RequestInit) => Promise<Response>;

export class ApiClient {
  /// `base`: the address of the page, below which the interface lies.
  constructor(
    private readonly base_: string,
    private readonly fetch_: Fetch = (input, init) => fetch(input, init),
  ) {}

  async scenes(signal: AbortSignal): Promise<SceneSummary[]> {
    return (await this.json_<SceneList>("v1/scenes", { signal })).scenes;
  }

  scene(name: string, signal: AbortSignal): Promise<Scene> {
    return this.json_(`v1/scenes/${encodeURIComponent(name)}`, { signal });
  }

  /// Where `tell` is given and the server makes jobs, it hears of the progress. A render that is
  /// aborted is withdrawn.
  async render(
    request: RenderRequest,
    signal: AbortSignal,
    tell?: (progress: RenderProgress) => void,
  ): Promise<RenderedImage> {
    const start_ms = performance.now();
    const format = request.image?.format ?? "png";
    const call = post_of(request, `image/${format}, application/problem+json`);
    const headers = tell ? { ...call.headers, Prefer: "respond-async" } : call.headers;
    let reply = await this.reply_("v1/renders", { ...call, headers, signal });
    const was_job = reply.status === 202;
    if (was_job) {
      const job = (await reply.json()) as Job;
      const send = (path: string, init: RequestInit): Promise<Response> => this.reply_(path, init);
      reply = await picture_of_job(job, send, signal, tell ?? (() => undefined));
    }
    const picture = await whole(reply.blob(), signal);
    return {
      id: reply.headers.get("Fstop-Render-Id") ?? "",
      method: reply.headers.get("Fstop-Method") ?? "",
      error: numbers_of(reply.headers.get("Fstop-Error")),
      picture,
      round_trip_ms: performance.now() - start_ms,
      timings_ms: timings_of(reply.headers.get("Server-Timing")),
      was_job,
    };
  }

  report(id: string, signal: AbortSignal): Promise<RenderReport> {
    return this.json_(`v1/renders/${encodeURIComponent(id)}`, { signal });
  }

  optics(request: OpticsRequest, signal: AbortSignal): Promise<OpticsReport> {
    return this.json_("v1/optics", { ...post_of(request, "application/json"), signal });
  }

  psf(request: PsfRequest, signal: AbortSignal): Promise<PsfReport> {
    return this.json_("v1/psf", { ...post_of(request, "application/json"), signal });
  }

  measure(request: MeasurementRequest, signal: AbortSignal): Promise<MeasurementReport> {
    return this.json_("v1/measurements", { ...post_of(request, "application/json"), signal });
  }

  /// Where a finished render's picture is, in a format.
  picture_address(id: string, format: string): string {
    const path = `v1/renders/${encodeURIComponent(id)}/image?format=${format}`;
    return new URL(path, this.base_).href;
  }

  /// A layer that the render was asked for: metres along the axis, or signed blur in pixels.
  async layer(id: string, output: "depth" | "coc", signal: AbortSignal): Promise<Layer> {
    const path = `v1/renders/${encodeURIComponent(id)}/outputs/${output}?format=exr`;
    const reply = await this.reply_(path, { signal });
    return read_layer(await whole(reply.arrayBuffer(), signal));
  }

  /// `on_progress` hears of the share that is done, 0 to 1.
  async chart(
    request: ChartRequest,
    on_progress: (share: number) => void,
    signal: AbortSignal,
  ): Promise<ChartReport> {
    const reply = await this.reply_("v1/charts", { ...post_of(request, kEventStream), signal });
    return whole(told_chart(reply, on_progress), signal);
  }

  /// The drawing that the server makes of a chart.
  async chart_drawing(request: ChartRequest, signal: AbortSignal): Promise<string> {
    return (await this.reply_("v1/charts", { ...post_of(request, "image/svg+xml"), signal })).text();
  }

  private async json_<Answer>(path: string, init: RequestInit): Promise<Answer> {
    const reply = await this.reply_(path, init);
    return (await whole(reply.json(), init.signal ?? undefined)) as Answer;
  }

  /// The reply with what was asked for. Throws: one of the errors above, or the signal's reason.
  private async reply_(path: string, init: RequestInit): Promise<Response> {
    let reply: Response;
    try {
      reply = await this.fetch_(new URL(path, this.base_), init);
    } catch (error) {
      init.signal?.throwIfAborted();
      throw new UnreachableError(error);
    }
    if (reply.status === 502 || reply.status === 504)
      throw new UnreachableError(`a gateway answered with ${reply.status}`);
    if (reply.status === 503 || reply.status === 429)
      throw new BusyError(retry_after_ms(reply.headers.get("Retry-After"), Date.now()));
    if (!reply.ok) throw new RefusedError(reply.status, await problem_of(reply));
    return reply;
  }
}

/// A reply's body. Throws: UnreachableError where the connection breaks before its end.
async function whole<Body>(body: Promise<Body>, signal: AbortSignal | undefined): Promise<Body> {
  try {
    return await body;
  } catch (error) {
    signal?.throwIfAborted();
    // So `fetch` calls a broken connection; an unreadable body is another kind of error.
    if (error instanceof TypeError) throw new UnreachableError(error);
    throw error;
  }
}

/// Milliseconds that a `Retry-After` asks to wait: seconds or a date; one second where it is
/// absent or unreadable. At least 100 ms, so that a server that says 0 is not flooded.
export function retry_after_ms(header: string | null, now_ms: number): number {
  const text = header?.trim() ?? "";
  const wait_ms = /^\d+$/.test(text) ? 1000 * Number(text) : Date.parse(text) - now_ms;
  return Number.isNaN(wait_ms) ? 1000 : Math.max(wait_ms, 100);
}

/// The durations of a `Server-Timing` header by name.
export function timings_of(header: string | null): Map<string, number> {
  const timings_ms = new Map<string, number>();
  for (const metric of header?.split(",") ?? []) {
    const [name, ...parameters] = metric.split(";").map((part) => part.trim());
    const duration = parameters.find((parameter) => parameter.startsWith("dur="));
    const value_ms = Number(duration?.slice("dur=".length));
    if (name && Number.isFinite(value_ms)) timings_ms.set(name, value_ms);
  }
  return timings_ms;
}

/// The numbers of a header like "estimate=0.0071, upper_95=0.0082" by name.
export function numbers_of(header: string | null): Map<string, number> {
  const pairs = (header?.split(",") ?? []).map((pair) => pair.trim().split("=", 2));
  const numbers = pairs.map(([name, text]) => [name ?? "", Number(text)] as const);
  return new Map(numbers.filter(([name, value]) => name !== "" && Number.isFinite(value)));
}

const kEventStream = "text/event-stream, application/problem+json";

/// The chart at the end of its events.
async function told_chart(
  reply: Response,
  on_progress: (share: number) => void,
): Promise<ChartReport> {
  for await (const { event, data } of events_of(reply.body ?? new ReadableStream())) {
    if (event === "progress") on_progress((JSON.parse(data) as { progress: number }).progress);
    if (event === "problem") throw refusal_of(JSON.parse(data) as Problem);
    if (event === "chart") return JSON.parse(data) as ChartReport;
  }
  throw new UnreachableError("the events ended before the chart");
}

function refusal_of(problem: Problem): RefusedError {
  return new RefusedError(problem.status ?? 500, problem);
}

function post_of(body: unknown, accept: string) {
  const headers = { "Content-Type": "application/json", Accept: accept };
  return { method: "POST", headers, body: JSON.stringify(body) };
}

async function problem_of(reply: Response): Promise<Problem> {
  const type = reply.headers.get("Content-Type") ?? "";
  return /\bjson\b/.test(type) ? ((await reply.json()) as Problem) : { status: reply.status };
}
