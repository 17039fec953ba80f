import { describe, expect, it } from "vitest";
import { bound_size, duration, error_size, quantity } from "./format.ts";

describe("numbers as text", () => {
  it("have four digits, a unit and a true minus sign", () => {
    expect(quantity(51.282051282051285, "mm")).toBe("51.28\u00a0mm");
    expect(quantity(-0.0123456)).toBe("\u22120.01235");
    expect(quantity(12345.6, "m")).toBe("12350\u00a0m");
    expect(quantity(0, "px")).toBe("0\u00a0px");
  });

  it("have a power of ten where zeros would hide the digits", () => {
    expect(quantity(6.592e-7, "mm")).toBe("6.592\u202f×\u202f10⁻⁷\u00a0mm");
    expect(quantity(-6.592123e-12)).toBe("\u22126.592\u202f×\u202f10⁻¹²");
    expect(quantity(123456789, "m")).toBe("1.235\u202f×\u202f10⁸\u00a0m");
    expect(quantity(0.000123456)).toBe("0.0001235");
    expect(error_size(0.00000234)).toBe("2.3\u202f×\u202f10⁻⁶");
    expect(bound_size(0.00000231)).toBe("2.4\u202f×\u202f10⁻⁶");
  });

  it("tell no pixels that no picture shows", () => {
    expect(quantity(0.0000006592, "px")).toBe("< 0.001\u00a0px");
    expect(quantity(-0.0009, "px")).toBe("> \u22120.001\u00a0px");
    expect(quantity(0.0011, "px")).toBe("0.0011\u00a0px");
  });

  it("show infinity as its sign and what is absent as a dash", () => {
    expect(quantity("infinity", "m")).toBe("∞");
    expect(quantity(undefined, "m")).toBe("–");
    expect(quantity(null)).toBe("–");
  });

  it("claim two digits of an error", () => {
    expect(error_size(0.0071234)).toBe("0.0071");
    expect(error_size("infinity")).toBe("∞");
  });

  it("never state a bound below itself", () => {
    expect(bound_size(0.0204088)).toBe("0.021");
    expect(bound_size(0.02)).toBe("0.02");
    expect(bound_size("infinity")).toBe("∞");
  });

  it("read as milliseconds or seconds", () => {
    expect(duration(812.4)).toBe("812\u00a0ms");
    expect(duration(3180)).toBe("3.2\u00a0s");
  });
});
