import { describe, expect, it } from "vitest";
import {
  ApiClient,
  BusyError,
  RefusedError,
  UnreachableError,
} from "./api_client.ts";
import { numbers_of, retry_after_ms, timings_of } from "./api_client.ts";
import type { Fetch } from "./api_client.ts";
import type { RenderRequest } from "./contract.ts";

const kRequest: RenderRequest = {
  scene: "still-life",
  camera: { pinhole: { image_distance_mm: 50, diameter_mm: "optimal" } },
  image: { width: 480, height: 320, format: "png" },
  quality: { max_error: 0.03 },
};

function client_that(answer: () => Response | Promise<Response>) {
  const calls: { url: string; init: RequestInit }[] = [];
  const send: Fetch = async (input, init) => {
    calls.push({ url: input.href, init });
    return answer();
  };
  return { client: new ApiClient("http://host/below/#f", send), calls };
}

const never = new AbortController().signal;

describe("api client", () => {
  it("posts a render and reads its headers", async () => {
    const headers = {
      "Fstop-Render-Id": "abc",
      "Fstop-Method": "pinhole",
      "Fstop-Error": "estimate=0.0071, upper_95=0.0082",
      "Server-Timing": "queue;dur=0.3, render;desc=rays;dur=812",
    };
    const { client, calls } = client_that(() => new Response("bytes", { headers }));
    const image = await client.render(kRequest, never);
    expect(calls[0]?.url).toBe("http://host/below/v1/renders");
    expect(calls[0]?.init.body).toBe(JSON.stringify(kRequest));
    expect([image.id, image.method]).toEqual(["abc", "pinhole"]);
    expect(Object.fromEntries(image.error)).toEqual({ estimate: 0.0071, upper_95: 0.0082 });
    expect(await image.picture.text()).toBe("bytes");
    expect(image.timings_ms).toEqual(
      new Map([
        ["queue", 0.3],
        ["render", 812],
      ]),
    );
  });

  it("tells refusal, lack of room and silence apart", async () => {
    const problem = { title: "Invalid", errors: [{ pointer: "#/scene", detail: "unknown" }] };
    const refused = new Response(JSON.stringify(problem), {
      status: 422,
      headers: { "Content-Type": "application/problem+json" },
    });
    const failure = await client_that(() => refused)
      .client.render(kRequest, never)
      .catch((e) => e);
    expect(failure).toBeInstanceOf(RefusedError);
    expect(failure.problem).toEqual(problem);

    const busy = new Response(null, { status: 503, headers: { "Retry-After": "2" } });
    const wait = await client_that(() => busy)
      .client.render(kRequest, never)
      .catch((e) => e);
    expect(wait).toBeInstanceOf(BusyError);
    expect(wait.retry_after_ms).toBe(2000);

    const silent = client_that(() => Promise.reject(new TypeError("network")));
    await expect(silent.client.scenes(never)).rejects.toBeInstanceOf(UnreachableError);
  });

  it("passes an abort on as what it is", async () => {
    const abort = new AbortController();
    const { client } = client_that(() => (abort.abort(), Promise.reject(new TypeError("aborted"))));
    const failure = await client.scenes(abort.signal).catch((error) => error);
    expect(failure.name).toBe("AbortError");
  });
});

describe("a render that becomes a job", () => {
  const kJob = { job: "5f", state: "running", render: "r", fraction: 0, links: {} };
  const event = (name: string, job: object, id: number): string =>
    `id: ${id}\nevent: ${name}\ndata: ${JSON.stringify({ ...kJob, ...job })}\n\n`;

  /// A server that makes a job of every render; `streams` are its events, one for each connection.
  function job_server(...streams: string[]) {
    const calls: { method: string; path: string; headers: Headers }[] = [];
    const send: Fetch = async (input, init) => {
      const headers = new Headers(init.headers);
      calls.push({ method: init.method ?? "GET", path: input.pathname, headers });
      if (init.method === "POST") return new Response(JSON.stringify(kJob), { status: 202 });
      if (init.method === "DELETE") return new Response(null, { status: 204 });
      if (input.pathname.endsWith("/preview")) return new Response("preview");
      if (input.pathname.endsWith("/image"))
        return new Response("picture", { headers: { "Fstop-Render-Id": "r" } });
      const stream = streams.shift();
      if (stream !== undefined) return new Response(stream);
      // Nothing more comes: until the reader goes.
      return new Promise((_, reject) =>
        init.signal?.addEventListener("abort", () => reject(new TypeError("aborted"))),
      );
    };
    return { client: new ApiClient("http://host/below/", send), calls };
  }

  it("tells of its progress and previews, over a connection that breaks, to the picture", async () => {
    const preview = { links: { preview: "/v1/jobs/5f/preview?number=1" } };
    const { client, calls } = job_server(
      event("progress", { fraction: 0.25, upper_95: 0.1, ...preview }, 41),
      event("progress", { fraction: 0.5, ...preview }, 42) + event("done", { state: "done" }, 43),
    );
    const told: [number, string | undefined][] = [];
    const image = await client.render(kRequest, never, ({ fraction, preview }) =>
      void told.push([fraction, preview && "picture"]),
    );
    expect(told).toEqual([
      [0.25, "picture"],
      [0.5, undefined], // the same preview again is not fetched again
    ]);
    expect([image.id, await image.picture.text()]).toEqual(["r", "picture"]);
    expect(calls[0]?.headers.get("Prefer")).toBe("respond-async");
    const watched = calls.filter(({ path }) => path === "/below/v1/jobs/5f/events");
    expect(watched.map(({ headers }) => headers.get("Last-Event-ID"))).toEqual([null, "41"]);
  });

  it("is refused where it fails, with the server's reason", async () => {
    const problem = { status: 504, detail: "took too long" };
    const { client } = job_server(event("failed", { state: "failed", problem }, 1));
    const failure = await client.render(kRequest, never).catch((error) => error);
    expect(failure).toBeInstanceOf(RefusedError);
    expect(failure.message).toBe("took too long");
  });

  it("is withdrawn when nobody wants it any more", async () => {
    const abort = new AbortController();
    const { client, calls } = job_server();
    setTimeout(() => abort.abort(), 10);
    await expect(client.render(kRequest, abort.signal)).rejects.toThrow();
    expect(calls.at(-1)).toMatchObject({ method: "DELETE", path: "/below/v1/jobs/5f" });
  });
});

describe("header values", () => {
  it("reads Retry-After in seconds and as a date", () => {
    const now_ms = Date.parse("Mon, 02 Jan 2023 03:04:05 GMT");
    expect(retry_after_ms("3", now_ms)).toBe(3000);
    expect(retry_after_ms("0", now_ms)).toBe(100);
    expect(retry_after_ms("Mon, 02 Jan 2023 03:04:09 GMT", now_ms)).toBe(4000);
    expect(retry_after_ms("soon", now_ms)).toBe(1000);
    expect(retry_after_ms(null, now_ms)).toBe(1000);
  });

  it("reads Server-Timing, with and without durations", () => {
    expect(timings_of("cache, render;dur=12.5")).toEqual(new Map([["render", 12.5]]));
    expect(timings_of(null).size).toBe(0);
  });

  it("reads Fstop-Error as far as it has numbers", () => {
    expect(numbers_of("estimate=0.1, upper_95=unknown, ")).toEqual(new Map([["estimate", 0.1]]));
    expect(numbers_of(null).size).toBe(0);
  });
});
