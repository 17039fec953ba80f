import { describe, expect, it } from "vitest";
import type { Scene } from "./contract.ts";
import { has_look, learn_scene, scene_of, with_look } from "./scene_looks.ts";
import { kDefaultState } from "./state.ts";

const kScene = {
  format: "fstop-scene/1",
  textures: { card: { file: "card.png", filter: "mipmap" } },
  materials: {
    lamp: { model: "unlit", emission: [1, 1, 1] },
    ball: { model: "phong", diffuse: { texture: "card" } },
  },
  objects: [
    { type: "mesh", file: "ball.obj", material: "ball", interpolation: "phong" },
    { type: "sphere", center_m: [0, 0, -1], radius_m: 0.1, material: "ball" },
  ],
} as unknown as Scene;
const kState = { ...kDefaultState, scene: "room" };

describe("a scene's look", () => {
  it("changes what it names and the places of files alone", () => {
    const scene = with_look(kScene, {
      ...kState,
      filter: "nearest",
      shading: "blinn-phong",
      interpolation: "flat",
    });
    expect(scene.textures?.["card"]).toEqual({ file: "room/card.png", filter: "nearest" });
    expect(scene.materials?.["lamp"]).toEqual(kScene.materials?.["lamp"]);
    expect(scene.materials?.["ball"]).toMatchObject({ model: "blinn-phong" });
    expect(scene.objects?.[0]).toMatchObject({ file: "room/ball.obj", interpolation: "flat" });
    expect(scene.objects?.[1]).toEqual(kScene.objects?.[1]);
    expect(with_look(kScene, { ...kState, filter: "bilinear" }).objects?.[0]).toMatchObject({
      interpolation: "phong",
    });
  });

  it("is asked for once, and only where there is one", async () => {
    let asked = 0;
    const source = {
      scene: async () => {
        ++asked;
        return kScene;
      },
    };
    const { signal } = new AbortController();
    expect(has_look(kState)).toBe(false);
    await learn_scene(source, kState, signal);
    expect(asked).toBe(0);
    expect(scene_of(kState)).toBe("room");
    const looked = { ...kState, interpolation: "gouraud" } as const;
    await learn_scene(source, looked, signal);
    await learn_scene(source, looked, signal);
    expect(asked).toBe(1);
    expect(scene_of(looked)).toMatchObject({ format: "fstop-scene/1" });
    expect(scene_of(kState)).toBe("room");
  });
});
