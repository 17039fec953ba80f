import { describe, expect, it } from "vitest";
import { box_along, crosses, fitting, overlap, words_above } from "./plot_labels.ts";

const kRoom = { left: 0, top: 0, right: 300, bottom: 200 };
const kWord = { width: 60, height: 12 };

describe("words of a plot", () => {
  it("at ticks stand side by side, or are left out", () => {
    const at = (tick: number): number => 10 * tick;
    expect(fitting([[1, 2, 3, 4, 5]], at, () => 8)).toEqual([1, 3, 5]);
    expect(fitting([[1, 2, 3]], at, () => 6)).toEqual([1, 2, 3]);
    expect(fitting([[1, 2, 5, 10], [1, 10]], at, () => 8)).toEqual([1, 10]);
  });

  it("above lines stand beside them, where no other line passes", () => {
    const marks = [
      { x: 120, width: 60 },
      { x: 100, width: 60 },
    ];
    expect(words_above(marks, kRoom)).toEqual([
      { row: 1, left: 124 },
      { row: 0, left: 104 },
    ]);
    // Near the right end they stand to the left, the rightmost uppermost.
    const last = marks.map(({ x, width }) => ({ x: x + 170, width }));
    expect(words_above(last, kRoom)).toEqual([
      { row: 0, left: 226 },
      { row: 1, left: 206 },
    ]);
  });

  it("along a line keep off other words and lines", () => {
    const free = box_along(100, kWord, kRoom, { boxes: [], lines: [] });
    expect(free).toEqual({ left: 236, top: 86, right: 296, bottom: 98 });
    const below = box_along(100, kWord, kRoom, { boxes: [free], lines: [] });
    expect(below.top).toBe(102);
    const falling = [
      [150, 0],
      [300, 200],
    ] as const;
    const beside = box_along(100, kWord, kRoom, { boxes: [], lines: [falling] });
    expect(crosses(falling, beside)).toBe(false);
    expect(overlap(free, below)).toBe(false);
  });

  it("are crossed by a line that passes through, not by one that passes by", () => {
    const box = { left: 10, top: 10, right: 20, bottom: 20 };
    expect(crosses([[0, 0], [30, 30]], box)).toBe(true);
    expect(crosses([[0, 15], [30, 15]], box)).toBe(true);
    expect(crosses([[0, 12], [12, 0]], box)).toBe(false);
    expect(crosses([[0, 0], [5, 5]], box)).toBe(false);
    expect(crosses([[25, 15]], box)).toBe(true);
    expect(crosses([[35, 15]], box)).toBe(false);
  });
});
