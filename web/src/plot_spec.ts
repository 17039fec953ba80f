/// What a plot shows, and the same as a table.
export interface Axis {
  caption: string; // with its unit
  scale: "log" | "linear";
  domain?: readonly [number, number]; // default: what the series span
}

export interface Series {
  name: string;
  kind: "line" | "dots" | "rings";
  points: readonly (readonly [number, number])[];
  remarks?: readonly string[]; // one for each point, in the table
}

/// A line across the plot at a value of one axis.
export interface Mark {
  axis: "x" | "y";
  at: number;
  caption: string;
}

export interface PlotSpec {
  title: string;
  x: Axis;
  y: Axis;
  series: readonly Series[];
  marks: readonly Mark[];
  remarks?: string; // what the remarks of points are
  file: string; // the name of an exported file, without its ending
}

export interface Table {
  columns: readonly string[];
  rows: readonly (readonly string[])[];
}

/// One row for each x and one column for each series where they share their x; else one row for
/// each point.
export function table_of({ x, y, series, remarks }: PlotSpec): Table {
  const xs = (one: Series): string => one.points.map(([at]) => at).join();
  const shared = series.every((one) => xs(one) === xs(series[0] ?? one));
  if (shared && remarks === undefined)
    return {
      columns: [x.caption, ...series.map(({ name }) => name)],
      rows: (series[0]?.points ?? []).map(([at], i) => [
        digits(at),
        ...series.map(({ points }) => digits(points[i]?.[1])),
      ]),
    };
  return {
    columns: ["", x.caption, y.caption, ...(remarks === undefined ? [] : [remarks])],
    rows: series.flatMap((one) =>
      one.points.map(([at, value], i) => [
        one.name,
        digits(at),
        digits(value),
        ...(remarks === undefined ? [] : [one.remarks?.[i] ?? ""]),
      ]),
    ),
  };
}

/// RFC 4180, but lines end with LF.
export function csv_of({ columns, rows }: Table): string {
  const cell = (text: string): string =>
    /[",\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text;
  return [columns, ...rows].map((row) => `${row.map(cell).join(",")}\n`).join("");
}

/// The smallest and largest value on an axis; on logarithmic ones of the positive values.
export function domain_of(axis: Axis, values: readonly number[]): [number, number] {
  if (axis.domain) return [axis.domain[0], axis.domain[1]];
  const counted = values.filter((value) => Number.isFinite(value) && (axis.scale === "linear" || value > 0));
  if (counted.length === 0) return axis.scale === "log" ? [1, 10] : [0, 1];
  const [least, most] = [Math.min(...counted), Math.max(...counted)];
  if (axis.scale === "log") return least < most ? [least, most] : [least / 2, most * 2];
  return least < most ? [least, most] : [least - 1, most + 1];
}

/// Six digits, as short as they are.
function digits(value: number | undefined): string {
  return value === undefined || !Number.isFinite(value)
    ? "–"
    : String(Number(value.toPrecision(6)));
}
