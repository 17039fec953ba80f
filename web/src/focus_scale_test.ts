import { describe, expect, it } from "vitest";
import { distance_at, kInfinityPosition, position_of } from "./focus_scale.ts";

describe("focus scale", () => {
  it("runs from 0.1 m over 100 m to infinity", () => {
    expect(distance_at(0)).toBe(0.1);
    expect(distance_at(kInfinityPosition - 1)).toBe(100);
    expect(distance_at(kInfinityPosition)).toBe("infinity");
  });

  it("finds every mark again", () => {
    for (let position = 0; position <= kInfinityPosition; ++position)
      expect(position_of(distance_at(position))).toBe(position);
  });

  it("keeps distances beyond the marks at the ends", () => {
    expect(position_of(0.02)).toBe(0);
    expect(position_of(5000)).toBe(kInfinityPosition - 1);
  });
});
