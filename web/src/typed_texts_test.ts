import { describe, expect, it, vi } from "vitest";
import type { FieldFaults } from "./faults.ts";
import { kDefaultState } from "./state.ts";
import { TypedTexts } from "./typed_texts.ts";

function host_of(faults: FieldFaults) {
  return {
    state: kDefaultState,
    faults,
    addController: vi.fn(),
    removeController: vi.fn(),
    requestUpdate: vi.fn(),
    updateComplete: Promise.resolve(true),
  };
}

describe("typed texts that are no value", () => {
  it("stay with their fault before the server's, until they are dropped", () => {
    const host = host_of(new Map([["wavelength_nm", ["must lie in 100 nm to 2000 nm"]]]));
    const typed = new TypedTexts(host);
    expect(typed.faults("wavelength_nm")).toEqual(["must lie in 100 nm to 2000 nm"]);
    typed.keep("wavelength_nm", "green");
    expect(host.requestUpdate).toHaveBeenCalledTimes(1);
    expect(typed.text("wavelength_nm")).toBe("green");
    expect(typed.faults("wavelength_nm")).toEqual(['"green" is not a number']);
    expect(typed.faults("camera_z_m")).toEqual([]);
    typed.drop(["wavelength_nm"]);
    expect(typed.text("wavelength_nm")).toBeUndefined();
  });

  it("go when the value changes, and not when another does", () => {
    const host = host_of(new Map());
    const typed = new TypedTexts(host);
    typed.hostUpdate();
    typed.keep("camera_z_m", "far");
    host.state = { ...kDefaultState, f_stop: 9 };
    typed.hostUpdate();
    expect(typed.text("camera_z_m")).toBe("far");
    host.state = { ...host.state, camera_z_m: 1 };
    typed.hostUpdate();
    expect(typed.text("camera_z_m")).toBeUndefined();
  });
});
