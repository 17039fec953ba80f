import { describe, expect, it } from "vitest";
import type { MeasurementReport, OpticsAtDistance, OpticsReport } from "./contract.ts";
import { lamp_shot, measurable, measured_blur, measured_words, with_measured } from "./measured_blur.ts";
import type { Laboratory } from "./measured_blur.ts";
import type { PlotSpec } from "./plot_spec.ts";
import { table_of } from "./plot_spec.ts";
import { kDefaultState } from "./state.ts";

const row = (object_distance_m: number, coc_mm: number): OpticsAtDistance => ({
  object_distance_m,
  coc_mm,
  coc_px: coc_mm * 27,
  image_distance_mm: 51,
});
const kRows = Array.from({ length: 40 }, (_, i) => row(1 + 0.1 * i, 0.03 * (i - 10)));

describe("measured blur", () => {
  it("is looked for where there is blur, at both ends", () => {
    const chosen = measurable(kRows);
    expect(chosen).toHaveLength(10);
    expect(chosen.every(({ coc_mm }) => coc_mm !== 0)).toBe(true);
    expect([chosen[0], chosen.at(-1)]).toEqual([kRows[0], kRows[39]]);
    expect(measurable([row(2, 0)])).toEqual([]);
  });

  it("photographs a lamp whose disc fills the sensor, its own image a twentieth of it", () => {
    const { request, lamp_px } = lamp_shot(kDefaultState, row(3, 2), 50);
    expect(request.camera.sensor_mm).toEqual([3.2, 3.2]);
    expect(request.image).toMatchObject({ width: 39, height: 39 });
    expect(lamp_px).toBeCloseTo((0.1 / 3.2) * 39, 9); // 2 mm / 20
    const { objects } = request.scene as { objects: { center_m: number[]; radius_m: number }[] };
    expect(objects[0]).toMatchObject({ center_m: [0, 0, -3] });
    expect(objects[0]?.radius_m).toBeCloseTo(0.003, 9); // 0.05 mm * 3 m / 50 mm
  });

  it("takes the smallest sensor for little blur, with more pixels", () => {
    const { request } = lamp_shot(kDefaultState, row(2.1, 0.02), 50);
    expect(request.camera.sensor_mm).toEqual([1, 1]);
    expect(request.image?.width).toBe(512);
  });

  it("asks for a picture and its measurement, point after point, and says how far off they are", async () => {
    const asked: unknown[] = [];
    const laboratory: Laboratory = {
      render: async ({ camera }) => {
        asked.push(camera.sensor_mm?.[0]);
        const nothing = { method: "", picture: new Blob([]), round_trip_ms: 0 };
        return { id: "a".repeat(64), error: new Map(), timings_ms: new Map(), ...nothing };
      },
      measure: async (request) => {
        asked.push(request);
        const spot = { kind: "spot", disc_diameter_um: 101 };
        return { width: 1, height: 1, measurements: [spot] } as unknown as MeasurementReport;
      },
    };
    const optics = { at: [row(1, -0.1), row(3, 0.1)], image_distance_mm: 50 } as OpticsReport;
    const points = [];
    const { signal } = new AbortController();
    for await (const point of measured_blur(laboratory, { ...kDefaultState, blades: 7 }, optics, signal))
      points.push(point);
    expect(asked[1]).toMatchObject({
      render: "a".repeat(64),
      measurements: [{ kind: "spot", background: 0, blades: 7 }],
    });
    expect(points.map(({ measured_um }) => measured_um)).toEqual([101, 101]);
    expect(measured_words(points)).toContain("within 1.0 %");
    const plot: PlotSpec = {
      title: "",
      file: "",
      x: { caption: "x", scale: "log" },
      y: { caption: "y", scale: "log" },
      series: [{ name: "theory", kind: "line", points: [[1, 100]] }],
      marks: [],
    };
    const table = table_of(with_measured(plot, points));
    expect(table.columns).toEqual(["", "x", "y", "off the blur disc, %"]);
    expect(table.rows[0]).toEqual(["theory", "1", "100", ""]);
    expect(table.rows[2]?.slice(1)).toEqual(["3", "101", "1.00"]);
  });
});
