import { describe, expect, it } from "vitest";
import { place_within, same_shape } from "./letterbox.ts";

const kFullFrame = { width: 960, height: 640 };
const kPhone = { width: 880, height: 660 };

describe("a picture in a frame of another shape", () => {
  it("keeps its shape, in the middle, with bars beside it", () => {
    // 4 : 3 in 3 : 2 takes (4/3)/(3/2) = 8/9 of the width.
    expect(place_within({ x: 0.5, y: 0.25 }, kFullFrame, kPhone)).toEqual({ x: 0.5, y: 0.25 });
    expect(place_within({ x: 1 / 18, y: 0 }, kFullFrame, kPhone)?.x).toBeCloseTo(0, 12);
    expect(place_within({ x: 0.05, y: 0.5 }, kFullFrame, kPhone)).toBeUndefined();
    expect(place_within({ x: 0.5, y: 1 / 18 }, kPhone, kFullFrame)?.y).toBeCloseTo(0, 12);
    expect(place_within({ x: 0.5, y: 0.97 }, kPhone, kFullFrame)).toBeUndefined();
  });

  it("has a shape whatever its size", () => {
    expect(same_shape(kFullFrame, { width: 642, height: 428 })).toBe(true);
    expect(same_shape(kFullFrame, kPhone)).toBe(false);
  });
});
