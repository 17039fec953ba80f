import { describe, expect, it } from "vitest";
import { kDefaultPage, misread, page_fragment, page_of } from "./page_state.ts";
import type { PageState } from "./page_state.ts";
import { kDefaultState, with_consequences } from "./state.ts";
import type { PlaygroundState } from "./state.ts";

const kA: PlaygroundState = {
  ...kDefaultState,
  scene: "night",
  sensor: "aps-c",
  blades: 7,
  blade_rotation_deg: -12.5,
  lock_framing: true,
  wavelength_nm: 450,
  spectrum: "monochromatic",
  camera_z_m: 1.25,
  exposure: "time",
  shutter_step: 21,
  iso_step: 6,
};
const kB: PlaygroundState = {
  ...kDefaultState,
  scene: "charts",
  camera: "pinhole",
  diameter_mm: "optimal",
  criterion: "mtf50",
};

describe("page in the address", () => {
  it("comes back whole: both requests, their comparison, subject, point and experiment", () => {
    const page: PageState = {
      a: kA,
      b: kB,
      comparison: "difference",
      subject_m: 2.5,
      point: { x: 0.25, y: 0.5 },
      experiment: "hyperfocal-focusing",
      step: 1,
    };
    expect(page_of(page_fragment(page))).toEqual(page);
    expect(page_of(page_fragment({ ...page, b: undefined })).b).toBeUndefined();
    expect(page_of("")).toEqual(kDefaultPage);
  });

  it("writes stops as cameras engrave them", () => {
    const text = new URLSearchParams(page_fragment({ ...kDefaultPage, a: kA }).slice(1));
    expect(text.get("shutter")).toBe("1/125");
    expect(text.get("iso")).toBe("400");
    expect(text.get("f_number")).toBe("1.4");
  });

  it("takes no point outside the picture and no unknown comparison", () => {
    expect(page_of("#point=1.5,0.5").point).toBeUndefined();
    expect(page_of("#point=0.5").point).toBeUndefined();
    expect(page_of("#compare=magic").comparison).toBe("wipe");
    expect(page_of("#experiment=a&step=0").step).toBe(0);
    expect(page_of("#experiment=a&step=2").step).toBe(1);
    expect(page_of("#subject_m=infinity").subject_m).toBe("infinity");
  });
});

describe("parts of the address that are not understood", () => {
  it("are named: values that are none, values off the scale, and names that are none", () => {
    expect(misread("#camera=lens&f_number=abc&focus_distance_m=2")).toEqual(["f_number=abc"]);
    expect(misread("#f_number=3&shutter=1/7&sensor=imax&colour=red")).toEqual([
      "f_number=3",
      "shutter=1/7",
      "sensor=imax",
      "colour=red",
    ]);
    expect(misread("#point=1.5,0.5&compare=magic&step=0&subject_m=near")).toHaveLength(4);
    expect(misread("#b.f_number=8")).toEqual(["b.f_number=8"]);
    expect(misread("#b.camera=lens&b.f_number=8.1&b.blades=")).toEqual([
      "b.f_number=8.1",
      "b.blades=",
    ]);
  });

  it("are none in a link of the page's own; what the server refuses is for it to say", () => {
    const page: PageState = { ...kDefaultPage, a: kA, b: kB, point: { x: 0.25, y: 0.5 } };
    expect(misread(page_fragment({ ...page, experiment: "focus-breathing" }))).toEqual([]);
    expect(misread("#focal_length_mm=-5&max_error=7&subject_m=infinity")).toEqual([]);
  });
});

describe("consequences of a change", () => {
  it("let time or ISO make up for the f-stop, step for step", () => {
    const stopped = with_consequences(kA, { f_stop: kA.f_stop + 3 });
    expect(stopped.shutter_step).toBe(kA.shutter_step - 3);
    const by_iso = with_consequences({ ...kA, exposure: "iso" }, { f_stop: kA.f_stop + 3 });
    expect([by_iso.shutter_step, by_iso.iso_step]).toEqual([kA.shutter_step, kA.iso_step + 3]);
    const manual = with_consequences({ ...kA, exposure: "manual" }, { f_stop: kA.f_stop + 3 });
    expect([manual.shutter_step, manual.iso_step]).toEqual([kA.shutter_step, kA.iso_step]);
  });

  it("keep the subject's size where the framing is locked: m = f/(s - f)", () => {
    const state = { ...kDefaultState, lock_framing: true, focal_length_mm: 50, focus_distance_m: 2 };
    const longer = with_consequences(state, { focal_length_mm: 200 });
    const size = (f_mm: number, s_m: number): number => f_mm / (1000 * s_m - f_mm);
    expect(size(200, Number(longer.focus_distance_m))).toBeCloseTo(size(50, 2), 9);
    expect(longer.camera_z_m).toBeCloseTo(Number(longer.focus_distance_m) - 2, 9);
    const free = with_consequences({ ...state, lock_framing: false }, { focal_length_mm: 200 });
    expect(free.focus_distance_m).toBe(2);
    expect(free.camera_z_m).toBe(0);
  });
});
