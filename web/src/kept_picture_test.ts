import { describe, expect, it } from "vitest";
import type { RenderReport } from "./contract.ts";
import { kept_picture, present_optics } from "./kept_picture.ts";
import { kNoOptics } from "./optics_updates.ts";
import { kNoPicture } from "./picture_updates.ts";
import type { PictureView } from "./picture_updates.ts";
import { kDefaultState } from "./state.ts";

const kImage = {
  id: "1",
  method: "pinhole",
  error: new Map<string, number>(),
  picture: new Blob(),
  round_trip_ms: 1,
  timings_ms: new Map<string, number>(),
};
const kFinished: PictureView = {
  ...kNoPicture,
  image: kImage,
  shown: kDefaultState,
  report: { id: "1" } as RenderReport,
};
const kRefused = { faults: [{ pointer: "#/scene", detail: "none" }], message: "", may_pass: false };

describe("files of a picture", () => {
  it("are those of the present settings, when it is finished", () => {
    expect(kept_picture(kFinished, { ...kDefaultState })).toEqual({ id: "1" });
    const refining = { ...kFinished, activity: "refining" as const };
    expect(kept_picture(refining, kDefaultState)).toEqual({
      waits_for: "The picture's files come when it is finished.",
    });
  });

  it("are not those of settings before", () => {
    const other = { ...kDefaultState, f_stop: 9 };
    expect(kept_picture(kFinished, other)).toHaveProperty("waits_for");
    expect(kept_picture({ ...kFinished, complaint: kRefused }, kDefaultState)).toEqual({
      waits_for: "The server refuses these settings: there is no picture of them to save.",
    });
    const away = { ...kFinished, activity: "away" as const };
    expect(kept_picture(away, kDefaultState)).toHaveProperty("waits_for");
  });

  it("are there for the optics of the present settings alone", () => {
    const optics = {} as NonNullable<(typeof kNoOptics)["optics"]>;
    const view = { ...kNoOptics, optics, of: kDefaultState };
    expect(present_optics(view, { ...kDefaultState })).toBe(optics);
    expect(present_optics(view, { ...kDefaultState, f_stop: 9 })).toBeUndefined();
    expect(present_optics({ ...view, complaint: kRefused }, kDefaultState)).toBeUndefined();
  });
});
