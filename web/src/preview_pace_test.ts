import { describe, expect, it } from "vitest";
import { PreviewPace } from "./preview_pace.ts";

const kSizes = [
  { width: 200, height: 100 },
  { width: 400, height: 200 },
  { width: 800, height: 400 },
] as const;

/// A server that takes 8 ms and `ns_per_pixel` for each pixel.
function settled(ns_per_pixel: number, pace = new PreviewPace()): number {
  for (let i = 0; i < 20; ++i) {
    const size = pace.size_among(kSizes);
    pace.learn(size, 8 + (size.width * size.height * ns_per_pixel) / 1e6);
  }
  return pace.size_among(kSizes).width;
}

describe("preview pace", () => {
  it("starts with the largest", () => {
    expect(new PreviewPace().size_among(kSizes).width).toBe(800);
  });

  it("settles for the largest that comes within 40 ms", () => {
    expect(settled(90)).toBe(800); // 8 + 28.8 ms
    expect(settled(150)).toBe(400); // 8 + 48 ms, 8 + 12 ms
    expect(settled(500)).toBe(200); // 8 + 40 ms, 8 + 10 ms
    expect(settled(50_000)).toBe(200); // there is no smaller one
  });

  it("follows a server that becomes slower or faster", () => {
    const pace = new PreviewPace();
    expect(settled(90, pace)).toBe(800);
    expect(settled(500, pace)).toBe(200);
    expect(settled(90, pace)).toBe(800);
  });
});
