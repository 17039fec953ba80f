/// Numbers as text: four digits, units in words a photographer uses, infinity as its sign.
import type { Distance } from "./contract.ts";

const kFourDigits = new Intl.NumberFormat("en", {
  maximumSignificantDigits: 4,
  useGrouping: false,
});
const kTwoDigits = new Intl.NumberFormat("en", { maximumSignificantDigits: 2, useGrouping: false });

const kTwoDigitsUp = new Intl.NumberFormat("en", {
  maximumSignificantDigits: 2,
  useGrouping: false,
  roundingMode: "ceil",
});

/// A number of the server, with its unit; a dash where the server gave none.
export function quantity(value: Distance | null | undefined, unit = ""): string {
  if (value === null || value === undefined) return "–";
  if (value === "infinity") return "∞";
  return `${signed(kFourDigits.format(value))}${unit === "" ? "" : `\u00a0${unit}`}`;
}

/// An error: two digits are all that it is worth.
export function error_size(value: Distance): string {
  return value === "infinity" ? "∞" : kTwoDigits.format(value);
}

/// An upper bound: its two digits never say less than it does.
export function bound_size(value: Distance): string {
  return value === "infinity" ? "∞" : kTwoDigitsUp.format(value);
}

export function duration(value_ms: number): string {
  return value_ms < 1000
    ? `${Math.round(value_ms)}\u00a0ms`
    : `${(value_ms / 1000).toFixed(1)}\u00a0s`;
}

function signed(text: string): string {
  return text.replace("-", "\u2212");
}
