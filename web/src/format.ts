/// Numbers as text: four digits, units in words a photographer uses, infinity as its sign.
import type { Distance } from "./contract.ts";

const kFourDigits = digits(4);
const kTwoDigits = digits(2);
const kTwoDigitsUp = digits(2, "ceil");
/// Smaller values, and from a million on larger ones, are written with a power of ten.
const kLeastPlain = 1e-4;
const kLeastPower = 1e6;
/// No picture shows less.
const kLeast_px = 1e-3;

interface Digits {
  plain: Intl.NumberFormat;
  with_power: Intl.NumberFormat;
}

function digits(most: number, roundingMode: "halfExpand" | "ceil" = "halfExpand"): Digits {
  const options = { maximumSignificantDigits: most, useGrouping: false, roundingMode } as const;
  return {
    plain: new Intl.NumberFormat("en", options),
    with_power: new Intl.NumberFormat("en", { ...options, notation: "scientific" }),
  };
}

/// A number of the server, with its unit; a dash where the server gave none.
export function quantity(value: Distance | null | undefined, unit = ""): string {
  if (value === null || value === undefined) return "–";
  if (value === "infinity") return "∞";
  const ending = unit === "" ? "" : `\u00a0${unit}`;
  if (unit === "px" && value !== 0 && Math.abs(value) < kLeast_px)
    return `${value < 0 ? "> \u2212" : "< "}${kLeast_px}${ending}`;
  return `${number_text(value, kFourDigits)}${ending}`;
}

/// An error: two digits are all that it is worth.
export function error_size(value: Distance): string {
  return value === "infinity" ? "∞" : number_text(value, kTwoDigits);
}

/// An upper bound: its two digits never say less than it does.
export function bound_size(value: Distance): string {
  return value === "infinity" ? "∞" : number_text(value, kTwoDigitsUp);
}

export function duration(value_ms: number): string {
  return value_ms < 1000
    ? `${Math.round(value_ms)}\u00a0ms`
    : `${(value_ms / 1000).toFixed(1)}\u00a0s`;
}

function number_text(value: number, { plain, with_power }: Digits): string {
  const size = Math.abs(value);
  const is_plain = size === 0 || (size >= kLeastPlain && size < kLeastPower);
  if (is_plain) return signed(plain.format(value));
  const [factor = "", power = ""] = with_power.format(value).split("E");
  return `${signed(factor)}\u202f×\u202f10${raised(power)}`;
}

function signed(text: string): string {
  return text.replace("-", "\u2212");
}

const kRaised: Readonly<Record<string, string>> = { "-": "⁻" };

function raised(power: string): string {
  return [...power].map((letter) => kRaised[letter] ?? "⁰¹²³⁴⁵⁶⁷⁸⁹"[Number(letter)] ?? "").join("");
}
