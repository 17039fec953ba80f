import { describe, expect, it } from "vitest";
import type { RenderRequest } from "./contract.ts";
import { curl_command, python_program } from "./snippets.ts";

const kRequest: RenderRequest = {
  scene: "o'clock",
  camera: { lens: { focal_length_mm: 50, focus_distance_m: "infinity" } },
};

describe("the request as a command", () => {
  it("is one word of the shell, quotes and all", () => {
    const command = curl_command("http://host:1/below/", kRequest);
    expect(command).toContain("http://host:1/below/v1/renders");
    const [, quoted] = / -d '(.*)' http/.exec(command) ?? [];
    expect(JSON.parse((quoted ?? "").replaceAll("'\\''", "'"))).toEqual(kRequest);
  });

  it("is a Python program whose text holds the same request", () => {
    const [, text] = /r"""(.*)"""/s.exec(python_program("http://host:1/", kRequest)) ?? [];
    expect(JSON.parse(text ?? "")).toEqual(kRequest);
  });
});
