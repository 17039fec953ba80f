import { describe, expect, it } from "vitest";
import type { OpticsReport } from "./contract.ts";
import { kDefaultState } from "./state.ts";
import { description_of, summary_of } from "./words.ts";

const kOptics = {
  near_m: 1.9,
  far_m: "infinity",
  image_distance_mm: 50,
  pinhole: { diameter_mm: 0.35 },
  at: [{ object_distance_m: 1, image_distance_mm: 52, coc_mm: -0.6, coc_px: -17.094 }],
} as unknown as OpticsReport;

describe("sentences", () => {
  it("say what a picture shows", () => {
    const state = { ...kDefaultState, scene: "night" };
    const scenes = [{ name: "night", title: "Harbour", description: "" }];
    expect(description_of(state, scenes)).toBe(
      "Harbour through a 50 mm lens at f/1.4, focused at 2 m",
    );
    expect(description_of({ ...state, camera: "pinhole" }, [])).toBe("night through a pinhole");
    expect(description_of(undefined, [])).toBe("");
  });

  it("say what came out, with a lens and with a hole", () => {
    expect(summary_of(kDefaultState, kOptics, 1).replaceAll("\u00a0", " ")).toBe(
      "50 mm at f/1.4, focused at 2 m: sharp from 1.9 m to ∞; a point at 1 m is a disc 17.09 px wide.",
    );
    const hole = { ...kDefaultState, camera: "pinhole" as const };
    expect(summary_of(hole, kOptics, 1)).toMatch(/^A hole of 0\.35\s*mm, 50\s*mm before the sensor/);
  });
});
