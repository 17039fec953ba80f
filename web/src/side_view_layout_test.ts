import { describe, expect, it } from "vitest";
import type { OpticsReport } from "./contract.ts";
import { kCssPxPerMm, magnification_for, side_view } from "./side_view_layout.ts";
import { kDefaultState } from "./state.ts";

// 50 mm at f/2 focused at 2 m; a subject at 1 m. v = f s/(s - f), c = (f/N) v |1/s - 1/d|.
const kSubject = { object_distance_m: 1, image_distance_mm: 1000 / 19, coc_mm: -25 / 39, coc_px: 17 };
const kOptics = {
  image_distance_mm: 2000 / 39,
  at: [kSubject],
} as unknown as OpticsReport;
const kState = { ...kDefaultState, f_stop: 6 };

describe("side view", () => {
  const view = side_view(kState, kOptics, 1, 800);

  it("draws the rays so that they meet the sensor where the server's disc ends", () => {
    const [ray] = view.rays;
    const [, y] = /L\S+ (\S+)$/.exec(ray ?? "") ?? [];
    expect(Math.abs(Number(y) - view.axis_y)).toBeCloseTo(view.blur_half_px, 6);
    expect(view.beyond).toHaveLength(2); // the image lies behind the sensor
  });

  it("has one scale behind the lens", () => {
    expect((view.sensor_x - view.lens_x) / kOptics.image_distance_mm).toBeCloseTo(view.px_per_mm);
    expect((2 * view.half_aperture_px) / 25).toBeCloseTo(view.px_per_mm);
    expect((2 * view.half_sensor_px) / 24).toBeCloseTo(view.px_per_mm);
  });

  it("finds the distance that is drawn at a place", () => {
    for (const at_m of [0.5, 2, 20]) expect(view.distance_at(view.x_of(at_m))).toBeCloseTo(at_m, 2);
    expect(view.distance_at(view.x_of("infinity"))).toBe("infinity");
  });
});

describe("magnification", () => {
  it("is 1, 2 or 5 times a power of ten and fits", () => {
    expect(magnification_for(0.641, 150)).toBe(50);
    for (const largest_mm of [1e-4, 0.03, 0.64, 7]) {
      const found = magnification_for(largest_mm, 150);
      const px = largest_mm * kCssPxPerMm * found;
      expect(px).toBeLessThanOrEqual(150 * (1 + 1e-9));
      expect(px).toBeGreaterThan(150 / 2.5);
    }
  });
});
