import { describe, expect, it } from "vitest";
import { csv_of, domain_of, table_of } from "./plot_spec.ts";
import type { PlotSpec } from "./plot_spec.ts";

const kSpec: PlotSpec = {
  title: "t",
  file: "f",
  x: { caption: "x, m", scale: "log" },
  y: { caption: "y", scale: "log" },
  marks: [],
  series: [
    { name: "one", kind: "line", points: [[1, 10], [2, 20]] },
    { name: "two", kind: "line", points: [[1, 0.1], [2, Number.NaN]] },
  ],
};

describe("table of a plot", () => {
  it("has a column for each series where they share x", () => {
    expect(table_of(kSpec)).toEqual({
      columns: ["x, m", "one", "two"],
      rows: [
        ["1", "10", "0.1"],
        ["2", "20", "–"],
      ],
    });
  });

  it("has a row for each point else", () => {
    const apart = { ...kSpec, series: [...kSpec.series, { ...kSpec.series[0]!, points: [[5, 6]] as [number, number][] }] };
    expect(table_of(apart).rows).toHaveLength(5);
    expect(table_of(apart).columns).toEqual(["", "x, m", "y"]);
  });

  it("is CSV with quotes where a cell needs them", () => {
    expect(csv_of({ columns: ["x, m", 'say "y"'], rows: [["1", "2"]] })).toBe(
      '"x, m","say ""y"""\n1,2\n',
    );
  });
});

describe("domain", () => {
  it("spans what can be drawn", () => {
    expect(domain_of(kSpec.x, [0, 0.1, 10, Number.NaN, Number.POSITIVE_INFINITY])).toEqual([0.1, 10]);
    expect(domain_of({ caption: "", scale: "linear" }, [-0.1, 1])).toEqual([-0.1, 1]);
    expect(domain_of({ caption: "", scale: "log" }, [4])).toEqual([2, 8]);
    expect(domain_of({ caption: "", scale: "log" }, [])).toEqual([1, 10]);
  });
});
