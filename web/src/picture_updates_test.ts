import { describe, expect, it } from "vitest";
import { BusyError, RefusedError, UnreachableError } from "./api_client.ts";
import type { RenderedImage } from "./api_client.ts";
import type { RenderReport, RenderRequest } from "./contract.ts";
import { kNoPicture, picture_updates } from "./picture_updates.ts";
import type { PictureSource, PictureView } from "./picture_updates.ts";
import { PreviewPace } from "./preview_pace.ts";
import { kDefaultState } from "./state.ts";
import type { PlaygroundState } from "./state.ts";

const kState: PlaygroundState = { ...kDefaultState, scene: "charts" };

function image_of(request: RenderRequest): RenderedImage {
  const id = `${request.image?.width}`;
  const picture = new Blob([]);
  return {
    id,
    method: "pinhole",
    error: new Map(),
    picture,
    round_trip_ms: 1,
    timings_ms: new Map(),
  };
}

/// The page hands reports on without looking into them.
function report_of(id: string): RenderReport {
  return { id } as RenderReport;
}

/// A server whose renders fail with the given errors first, and the requests it has seen.
function source_with(...errors: Error[]) {
  const requests: RenderRequest[] = [];
  const source: PictureSource = {
    render: async (request) => {
      requests.push(request);
      const error = errors.shift();
      if (error) throw error;
      return image_of(request);
    },
    report: async (id) => report_of(id),
    scene: async () => ({ format: "fstop-scene/1" }),
    layer: async () => ({ width: 1, height: 1, values: new Float32Array([2]) }),
  };
  return { source, requests };
}

async function views(
  source: PictureSource,
  state: PlaygroundState,
  signal: AbortSignal,
  pace?: PreviewPace,
) {
  const seen: PictureView[] = [kNoPicture];
  const hand = pace && { pace, is_held: true };
  for await (const update of picture_updates(source, state, signal, hand))
    seen.push({ ...(seen.at(-1) ?? kNoPicture), ...update });
  return seen;
}

describe("picture updates", () => {
  it("show previews, then the picture asked for, with reports of what is kept", async () => {
    const { source, requests } = source_with();
    const seen = await views(source, kState, new AbortController().signal);
    expect(
      requests.map(({ image, quality }) => [image?.width, image?.height, quality?.max_error]),
    ).toEqual([
      [642, 428, 0.1],
      [642, 428, 0.03],
      [960, 640, 0.01],
    ]);
    expect(requests.map(({ quality }) => quality?.max_time_ms)).toEqual([
      50,
      undefined,
      undefined,
    ]);
    const reported = seen.filter(({ image, report }) => report && report.id === image?.id);
    expect(new Set(reported.map(({ image }) => image?.id))).toEqual(new Set(["642", "960"]));
    expect(seen.at(-1)).toMatchObject({
      activity: "idle",
      image: { id: "960" },
      report: { id: "960" },
    });
  });

  it("begin as small and quick as the server's pace asks while a hand is moving", async () => {
    const pace = new PreviewPace();
    pace.learn({ width: 642, height: 428 }, 8 + 150); // 20 ms for 240 x 160 pixels
    const { source, requests } = source_with();
    await views(source, kState, new AbortController().signal, pace);
    expect(requests.map(({ image }) => image?.width)).toEqual([240, 642, 960]);
    expect(requests.map(({ image }) => image?.format)).toEqual(["jpeg", "png", "png"]);
    expect(requests[0]?.quality?.max_time_ms).toBe(20);
    // That came in 1 ms: the next may be larger.
    await views(source, kState, new AbortController().signal, pace);
    expect(requests[3]?.image?.width).toBeGreaterThan(240);
  });

  it("never preview better than what was asked for", async () => {
    const { source, requests } = source_with();
    await views(source, { ...kState, max_error: 0.15 }, new AbortController().signal);
    expect(requests.map(({ quality }) => quality?.max_error)).toEqual([0.15, 0.15, 0.15]);
  });

  it("wait as long as a busy server asks and try again", async () => {
    const { source, requests } = source_with(new BusyError(5), new BusyError(5));
    const seen = await views(source, kState, new AbortController().signal);
    expect(requests).toHaveLength(5);
    expect(seen.filter(({ activity }) => activity === "waiting")).toHaveLength(2);
    expect(seen.at(-1)?.image?.id).toBe("960");
  });

  it("ask for depth and blur of what is kept, and say whose they are", async () => {
    const { source, requests } = source_with();
    const seen = await views(source, kState, new AbortController().signal);
    expect(requests.map(({ outputs }) => outputs?.join())).toEqual([
      undefined,
      "color,depth,coc",
      "color,depth,coc",
    ]);
    expect(seen.at(-1)).toMatchObject({ layers_of: kState });
    expect(seen.at(-1)?.layers?.depth_m.values[0]).toBe(2);
  });

  it("say that the server is away, try again and go on where they were", async () => {
    const { source, requests } = source_with(new UnreachableError("gone"));
    const seen = await views(source, kState, new AbortController().signal);
    expect(seen.some(({ activity }) => activity === "away")).toBe(true);
    expect(requests).toHaveLength(4);
    expect(seen.at(-1)).toMatchObject({ activity: "idle", image: { id: "960" } });
  });

  it("have the sensor's own shape", async () => {
    const { source, requests } = source_with();
    await views(source, { ...kState, sensor: "aps-c" }, new AbortController().signal);
    expect(requests.map(({ image }) => image?.height)).toEqual([468, 468, 624]);
  });

  it("end with the faults of a refused request and without a second one", async () => {
    const errors = [{ pointer: "#/camera/lens/focus_distance_m", detail: "must exceed f" }];
    const { source, requests } = source_with(new RefusedError(422, { errors }));
    const seen = await views(source, kState, new AbortController().signal);
    expect(requests).toHaveLength(1);
    expect(seen.at(-1)).toMatchObject({ activity: "idle", complaint: { faults: errors } });
  });

  it("fall silent when aborted, also while waiting", async () => {
    const abort = new AbortController();
    const { source, requests } = source_with(new BusyError(60_000));
    setTimeout(() => abort.abort(), 20);
    const seen = await views(source, kState, abort.signal);
    expect(requests).toHaveLength(1);
    expect(seen.at(-1)).toMatchObject({ activity: "waiting", complaint: kNoPicture.complaint });
  });
});
