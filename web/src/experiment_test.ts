import { describe, expect, it } from "vitest";
import type { OpticsRequest } from "./contract.ts";
import { answer_of, measured, number_at, page_of_step, right_choice } from "./experiment.ts";
import type { NumberSource, Step } from "./experiment.ts";
import { kExperiments } from "./experiments/index.ts";
import { page_fragment } from "./page_state.ts";

const kStep: Step = {
  text: "",
  show: "scene=night&camera=lens&focal_length_mm=50&f_number=2&focus_distance_m=2",
  question: "",
  choices: ["one", "two"],
  measure: [
    { name: "a", label: "", call: "optics", pointer: "/near_m", unit: "m" },
    { name: "b", label: "", call: "optics", settings: "f_number=8", pointer: "/near_m" },
    { name: "same", label: "", call: "optics", pointer: "/far_m" },
    { name: "times", label: "", ratio: ["a", "b"] },
    { name: "less", label: "", difference: ["a", "b"] },
  ],
  right: { largest: ["a", "b"] },
  answer: "{a} and {times}",
};

describe("an experiment's step", () => {
  it("measures by the camera that it shows, with its own settings over it, each once", async () => {
    const asked: number[] = [];
    const source = {
      optics: async ({ camera }: OpticsRequest) => {
        const f_number = camera.lens?.f_number ?? 0;
        asked.push(Math.round(f_number));
        return { near_m: f_number, far_m: "infinity" };
      },
    } as unknown as NumberSource;
    const numbers = await measured(source, kStep, new AbortController().signal);
    expect(asked).toEqual([2, 8]);
    expect(numbers.get("a")).toBeCloseTo(2);
    expect(numbers.get("same")).toBe(Number.POSITIVE_INFINITY);
    expect(numbers.get("times")).toBeCloseTo(0.25);
    expect(numbers.get("less")).toBeCloseTo(-6);
    expect(answer_of(kStep, numbers)).toBe("2\u00a0m and 0.25");
    expect(right_choice(kStep.right, numbers)).toBe(1);
    expect(right_choice({ smallest: ["a", "b"] }, numbers)).toBe(0);
    expect(right_choice({ nearest: "times", values: [4, 0.3, 0.1] }, numbers)).toBe(1);
  });

  it("says where an answer lacks a number", () => {
    expect(number_at({ a: [{ b: 2 }] }, "/a/0/b")).toBe(2);
    expect(() => number_at({ a: null }, "/a/b")).toThrow("/a/b");
  });
});

describe("the experiments' files", () => {
  it("measure a point where their words say that it is", () => {
    const distance_m = (words: string): number | undefined => {
      const [, found] = /\bpoint at (\d+(?:\.\d+)?) m\b/i.exec(words) ?? [];
      return found === undefined ? undefined : Number(found);
    };
    let told = 0;
    for (const [name, { steps }] of kExperiments)
      for (const { question, measure } of steps)
        for (const { label, request, pointer } of measure) {
          const at_m = distance_m(label) ?? distance_m(question);
          if (at_m === undefined) continue;
          expect(request?.["object_distance_m"], `${name}: ${label}`).toBe(at_m);
          expect(pointer, "these figures are of a point at infinity").not.toMatch(/pinhole\/figures/);
          ++told;
        }
    expect(told).toBeGreaterThanOrEqual(8);
  });

  it("are at least six, each of steps whose parts belong together", () => {
    expect(kExperiments.size).toBeGreaterThanOrEqual(6);
    for (const [name, { steps }] of kExperiments)
      for (const step of steps) {
        const known = new Set(step.measure.map((one) => one.name));
        const { right } = step;
        const named =
          "nearest" in right
            ? [right.nearest]
            : "largest" in right
              ? right.largest
              : right.smallest;
        const count = "nearest" in right ? right.values.length : named.length;
        expect(count, name).toBeGreaterThanOrEqual(2);
        expect(count, `${name}: a verdict for every choice`).toBeLessThanOrEqual(
          step.choices.length,
        );
        for (const one of [...named, ...step.answer.matchAll(/\{(\w+)\}/g)].map((found) =>
          typeof found === "string" ? found : found[1],
        ))
          expect(known, `${name}: ${one}`).toContain(one);
        const page = page_of_step(step, name);
        expect(page.a.scene, name).not.toBe("");
        for (const part of step.show.split("&"))
          expect(page_fragment(page).slice(1).split("&"), name).toContain(part);
      }
  });
});
