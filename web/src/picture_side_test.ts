import { describe, expect, it, vi } from "vitest";
import { RefusedError } from "./api_client.ts";
import type { RenderedImage } from "./api_client.ts";
import { PictureSide } from "./picture_side.ts";
import { pause } from "./picture_updates.ts";
import type { PictureSource } from "./picture_updates.ts";
import { PreviewPace } from "./preview_pace.ts";
import { kDefaultState } from "./state.ts";

const kImage: RenderedImage = {
  id: "1",
  method: "pinhole",
  error: new Map(),
  picture: new Blob(),
  round_trip_ms: 1,
  timings_ms: new Map(),
};
const kState = { ...kDefaultState, scene: "night" };

function source_of(render: PictureSource["render"]): PictureSource {
  const report = async () => ({ id: "1" });
  const layer = async () => ({ width: 1, height: 1, values: new Float32Array(1) });
  return { render, report, layer, scene: async () => ({}) } as unknown as PictureSource;
}

describe("one side of a comparison", () => {
  it("asks once for a state, and again when it is to forget that it did", async () => {
    const render = vi.fn(async () => kImage);
    const side = new PictureSide(source_of(render), new PreviewPace(), () => undefined);
    side.ask(kState, "urgent");
    side.ask({ ...kState }, "urgent");
    await vi.waitFor(() => expect(side.view.activity).toBe("idle"));
    await vi.waitFor(() => expect(side.view.layers_of).toBe(kState));
    expect(render).toHaveBeenCalledTimes(3); // two previews and the picture
    side.forget();
    side.ask(kState, "urgent");
    await vi.waitFor(() => expect(render.mock.calls.length).toBeGreaterThan(3));
    side.stop();
  });

  it("keeps its refusal to itself", async () => {
    const refusal = new RefusedError(422, { errors: [{ pointer: "#/scene", detail: "none" }] });
    const pace = new PreviewPace();
    const [a, b] = [async () => kImage, async () => Promise.reject(refusal)].map(
      (render) => new PictureSide(source_of(render), pace, () => undefined),
    );
    a?.ask(kState, "urgent");
    b?.ask(kState, "urgent");
    await vi.waitFor(() => expect(b?.view.complaint.faults).toHaveLength(1));
    await vi.waitFor(() => expect(a?.view.image).toBe(kImage));
    expect(a?.view.complaint.faults).toEqual([]);
    a?.stop();
  });

  it("takes no picture that comes in the moment of the next question", async () => {
    const replies: ((image: RenderedImage) => void)[] = [];
    const render = () => new Promise<RenderedImage>((resolve) => replies.push(resolve));
    const side = new PictureSide(source_of(render), new PreviewPace(), () => undefined);
    side.ask(kState, "urgent");
    await vi.waitFor(() => expect(replies).toHaveLength(1));
    await pause(150, new AbortController().signal); // so that the next question comes alone
    side.ask({ ...kState, f_stop: 9 }, "patient");
    replies[0]?.(kImage);
    side.hurry();
    await vi.waitFor(() => expect(replies).toHaveLength(2));
    expect(side.view.image).toBeUndefined();
    replies[1]?.({ ...kImage, id: "2" });
    await vi.waitFor(() => expect(side.view.image?.id).toBe("2"));
    side.stop();
  });

  it("begins with another's picture, and with nothing of what is under way there", () => {
    const side = new PictureSide(source_of(async () => kImage), new PreviewPace(), () => undefined);
    side.begin_with({ ...side.view, image: kImage, activity: "refining" });
    expect(side.view.image).toBe(kImage);
    expect(side.view.activity).toBe("idle");
  });
});
