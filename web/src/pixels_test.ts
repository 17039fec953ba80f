import { describe, expect, it } from "vitest";
import { blur_colours, difference_of } from "./pixels.ts";

describe("pixels", () => {
  it("differ by the mean of their channels, shown about mid-grey", () => {
    const a = new Uint8ClampedArray([10, 10, 10, 255, 0, 0, 0, 255]);
    const b = new Uint8ClampedArray([16, 10, 4, 255, 0, 0, 0, 255]);
    const { pixels, mean, largest } = difference_of(a, b, 4);
    expect([...pixels]).toEqual([152, 128, 104, 255, 128, 128, 128, 255]);
    expect(mean).toBeCloseTo(2);
    expect(largest).toBe(6);
  });

  it("are coloured by side, and deeper where the blur is larger", () => {
    const values = new Float32Array([0, -4, 4, -64]);
    const colours = blur_colours({ width: 4, height: 1, values }, 1);
    const at = (i: number) => [...colours.slice(4 * i, 4 * i + 4)];
    expect(at(0).slice(0, 3)).not.toEqual(at(1).slice(0, 3));
    expect(at(1).slice(0, 3)).not.toEqual(at(2).slice(0, 3));
    expect(at(3)[3]).toBeGreaterThan(at(1)[3]!);
  });
});
