import { describe, expect, it } from "vitest";
import {
  ApiClient,
  BusyError,
  DeferredError,
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

  it("tells refusal, lack of room, jobs and silence apart", async () => {
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

    const job = new Response(null, { status: 202, headers: { Location: "/v1/jobs/7" } });
    const deferred = await client_that(() => job)
      .client.render(kRequest, never)
      .catch((e) => e);
    expect(deferred).toBeInstanceOf(DeferredError);
    expect(deferred.message).toContain("/v1/jobs/7");

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
