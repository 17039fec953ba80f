import { describe, expect, it } from "vitest";
import { chart_size, kSensorNames, sensor_format } from "./sensor_formats.ts";
import {
  camera_of,
  distance_of,
  fragment_of,
  kDefaultState,
  number_of,
  same_blur,
  same_view,
  state_of,
} from "./state.ts";
import type { PlaygroundState } from "./state.ts";

const kLens: PlaygroundState = {
  ...kDefaultState,
  scene: "night & fog",
  focal_length_mm: 85,
  f_stop: 15,
  focus_distance_m: "infinity",
  breathing: false,
  max_error: 0.005,
};
const kPinhole: PlaygroundState = {
  ...kDefaultState,
  scene: "charts",
  camera: "pinhole",
  image_distance_mm: 120,
  diameter_mm: 0.35,
};

describe("state in the address", () => {
  it("comes back whole, lens and pinhole", () => {
    expect(state_of(fragment_of(kLens))).toEqual(kLens);
    expect(state_of(fragment_of(kPinhole))).toEqual(kPinhole);
    expect(state_of(fragment_of(kDefaultState))).toEqual(kDefaultState);
  });

  it("reads like the camera it describes", () => {
    expect(fragment_of(kLens)).toBe(
      "#scene=night+%26+fog&camera=lens&focal_length_mm=85&f_number=5.6" +
        "&focus_distance_m=infinity&breathing=false&max_error=0.005",
    );
  });

  it("falls back member by member", () => {
    expect(state_of("")).toEqual(kDefaultState);
    expect(
      state_of("#camera=mirror&f_number=5.7&focal_length_mm=NaN&breathing=1&unknown=1"),
    ).toEqual(kDefaultState);
    expect(state_of("#focal_length_mm=&focus_distance_m=3")).toEqual({
      ...kDefaultState,
      focus_distance_m: 3,
    });
  });

  it("leaves the judgement of readable values to the server", () => {
    expect(state_of("#focus_distance_m=0.01").focus_distance_m).toBe(0.01);
    expect(state_of("#focal_length_mm=-5").focal_length_mm).toBe(-5);
  });
});

describe("camera of a request", () => {
  it("has a lens or a pinhole, never both", () => {
    expect(camera_of(kLens)).toEqual({
      lens: { focal_length_mm: 85, f_number: 2 ** 2.5, focus_distance_m: "infinity" },
      breathing: false,
    });
    expect(camera_of(kPinhole)).toEqual({ pinhole: { image_distance_mm: 120, diameter_mm: 0.35 } });
  });
});

describe("typed text", () => {
  it("is a finite number or nothing", () => {
    expect(number_of(" 2.5 ")).toBe(2.5);
    for (const text of ["", " ", "two", "1e999", "NaN", "Infinity", "2,5"])
      expect(number_of(text)).toBeUndefined();
  });

  it("may name infinity where a distance is meant", () => {
    for (const text of ["infinity", "Infinity", "inf", " ∞ "])
      expect(distance_of(text)).toBe("infinity");
    expect(distance_of("2")).toBe(2);
    expect(distance_of("far")).toBeUndefined();
  });
});

describe("sensor formats", () => {
  // The contract: |(height_mm / height) / (width_mm / width) - 1| * longer side <= 1e-3.
  it("are divided into square pixels at every size, charts' too", () => {
    for (const name of kSensorNames) {
      const { sensor_mm, previews, picture } = sensor_format(name);
      for (const { width, height } of [...previews, picture, chart_size(name)]) {
        expect(Number.isInteger(width) && Number.isInteger(height), name).toBe(true);
        const aspect = sensor_mm[1] / height / (sensor_mm[0] / width);
        expect(Math.abs(aspect - 1) * Math.max(width, height), name).toBeLessThan(1e-3);
      }
    }
  });
});

describe("exposure", () => {
  it("is in the request only where pictures get darker or brighter", () => {
    expect(camera_of(kLens)).not.toHaveProperty("exposure");
    expect(camera_of({ ...kLens, exposure: "manual", shutter_step: 21, iso_step: 3 })).toMatchObject({
      shutter_s: 2 ** -7,
      exposure: { iso: 200 },
    });
  });
});

describe("what a layer holds for", () => {
  it("is the same view for depth, and the same blur for blur", () => {
    const closed = { ...kLens, f_stop: 20, max_error: 0.03 };
    expect([same_view(kLens, closed), same_blur(kLens, closed)]).toEqual([true, false]);
    expect(same_blur(kLens, { ...kLens, max_error: 0.03 })).toBe(true);
    expect(same_view(kLens, { ...kLens, camera_z_m: 1 })).toBe(false);
  });
});
