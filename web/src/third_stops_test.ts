import { describe, expect, it } from "vitest";
import {
  f_number_of_step,
  kIsoSpeeds,
  kLastThirdStop,
  kShutterTimes,
  moved_on,
  nearest_step,
  nominal_label,
  step_of_label,
} from "./third_stops.ts";

const kSteps = Array.from({ length: kLastThirdStop + 1 }, (_, step) => step);

describe("third stops", () => {
  it("run from f/1 to f/64, six doublings of the f-number", () => {
    expect(f_number_of_step(0)).toBe(1);
    expect(f_number_of_step(kLastThirdStop)).toBe(64);
    expect(kLastThirdStop).toBe(36);
  });

  it("lose half the light in three steps", () => {
    for (const step of kSteps.slice(3)) {
      const light = (f_number_of_step(step - 3) / f_number_of_step(step)) ** 2;
      expect(light).toBeCloseTo(0.5, 12);
    }
  });

  it("carry labels within a twelfth of a stop of their value", () => {
    // The worst of the engraved scale is f/1.2 for 1.26, 0.14 stop; all others are closer.
    for (const step of kSteps) {
      const stops = 2 * Math.abs(Math.log2(Number(nominal_label(step)) / f_number_of_step(step)));
      expect(stops).toBeLessThan(nominal_label(step) === "1.2" ? 1 / 6 : 1 / 12);
    }
  });

  it("send 5.657 where the label says 5.6", () => {
    const step = step_of_label("5.6");
    expect(step).toBe(15);
    expect(f_number_of_step(15)).toBeCloseTo(4 * Math.SQRT2, 12);
  });

  it("know every label once and no other", () => {
    for (const step of kSteps) expect(step_of_label(nominal_label(step))).toBe(step);
    expect(step_of_label("5.7")).toBeUndefined();
    expect(() => f_number_of_step(37)).toThrow(RangeError);
    expect(() => nominal_label(0.5)).toThrow(RangeError);
  });
});

describe("scales of time and speed", () => {
  it("have the label that is nearest to the true value", () => {
    const number = (label: string): number => {
      const [above, below] = label.split("/").map(Number);
      return (above ?? 0) / (below ?? 1);
    };
    for (const { labels, value } of [kShutterTimes, kIsoSpeeds])
      labels.forEach((label, step) =>
        expect(Math.abs(Math.log2(number(label) / value(step))), label).toBeLessThan(1 / 6),
      );
  });

  it("find the step nearest to an f-number, and stop at their ends", () => {
    expect(nearest_step(5.6)).toBe(15);
    expect(nearest_step(0.1)).toBe(0);
    expect(nearest_step(1000)).toBe(kLastThirdStop);
    expect(moved_on(kIsoSpeeds, 0, -3)).toBe(0);
    expect(moved_on(kIsoSpeeds, 0, 3)).toBe(3);
  });
});
