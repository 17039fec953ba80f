import { describe, expect, it } from "vitest";
import { RefusedError } from "./api_client.ts";
import { complaint_of, sorted_faults } from "./faults.ts";

describe("faults", () => {
  it("go to the control that their pointer names, each once", () => {
    const focus = {
      pointer: "#/camera/lens/focus_distance_m",
      detail: "must exceed focal_length_mm",
    };
    const up = { pointer: "#/camera/up", detail: "must not be zero" };
    const { at, elsewhere } = sorted_faults([focus, up, { ...focus }]);
    expect([...at]).toEqual([["focus_distance_m", ["must exceed focal_length_mm"]]]);
    expect(elsewhere).toEqual(["#/camera/up: must not be zero"]);
  });

  it("are taken from a refusal; other errors are one sentence", () => {
    const errors = [{ pointer: "#/scene", detail: "no such scene" }];
    expect(complaint_of(new RefusedError(422, { title: "Invalid", errors }))).toEqual({
      faults: errors,
      message: "",
    });
    expect(complaint_of(new RefusedError(500, { title: "Internal error" })).message).toBe(
      "Internal error",
    );
    expect(complaint_of(new Error("gone")).message).toBe("gone");
  });
});
