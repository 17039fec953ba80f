import { describe, expect, it } from "vitest";
import { RefusedError } from "./api_client.ts";
import { complaint_of, sentences_of, sorted_faults, words_of } from "./faults.ts";

describe("faults", () => {
  it("go to the control that their pointer names, each once", () => {
    const focus = {
      pointer: "#/camera/lens/focus_distance_m",
      detail: "must exceed focal_length_mm",
    };
    const up = { pointer: "#/camera/up", detail: "must not be zero" };
    const { at, elsewhere } = sorted_faults([focus, up, { ...focus }]);
    expect([...at]).toEqual([["focus_distance_m", ["must exceed focal length"]]]);
    expect(elsewhere).toEqual(["Camera, up: must not be zero"]);
  });

  it("are taken from a refusal; other errors are one sentence", () => {
    const errors = [{ pointer: "#/scene", detail: "no such scene" }];
    expect(complaint_of(new RefusedError(422, { title: "Invalid", errors }))).toEqual({
      faults: errors,
      message: "",
      may_pass: false,
    });
    expect(complaint_of(new RefusedError(500, { title: "Internal error" })).message).toBe(
      "Internal error",
    );
    expect(complaint_of(new Error("gone")).message).toBe("gone");
  });

  it("go to the control of a vector wherever in it they are", () => {
    const faults = ["#/camera/look_at_m/2", "#/camera/sensor_mm/0", "#/camera/velocity_m_s/1"];
    const { at, elsewhere } = sorted_faults(faults.map((pointer) => ({ pointer, detail: "no" })));
    expect([...at.keys()]).toEqual(["camera_z_m", "sensor", "velocity_m_s"]);
    expect(elsewhere).toEqual([]);
    expect(sorted_faults([]).at).toBe(sorted_faults([]).at);
  });

  it("have their place in words where no control shows them, never as a pointer", () => {
    expect(words_of("#/object_distances_m/8")).toBe("Distance of the subject");
    expect(words_of("#/camera/up/2")).toBe("Camera, up, value 3");
    expect(words_of("#/scene/objects/0/radius_m")).toBe("Scene, objects, value 1, radius");
    expect(words_of("#/quality/max_time_ms")).toBe("Quality, max time");
    expect(words_of("#/scene/materials/a~1b")).toBe("Scene, materials, a/b");
    expect(words_of("#")).toBe("The request");
    const quoted = { pointer: "#/scene", detail: 'has no "blue_m"; see velocity_m_s' };
    expect(sorted_faults([quoted]).at.get("scene")).toEqual(['has no "blue_m"; see velocity']);
    const errors = [{ pointer: "#/object_distances_m/0", detail: "must be more than 0" }];
    expect(sentences_of(complaint_of(new RefusedError(422, { errors })))).toEqual([
      "Distance of the subject: must be more than 0",
    ]);
  });

  it("of a refused request do not pass by trying again; a failure may", () => {
    for (const status of [400, 404, 413, 422])
      expect(complaint_of(new RefusedError(status, { title: "Refused" })).may_pass).toBe(false);
    expect(complaint_of(new RefusedError(500, { title: "Failed" })).may_pass).toBe(true);
    expect(complaint_of(new Error("no decoder")).may_pass).toBe(true);
  });
});
