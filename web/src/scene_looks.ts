/// Stored scenes with other texture filters, shading models or interpolations than they have: then
/// the request holds the scene itself, whose files are those of the stored one.
import type { ApiClient } from "./api_client.ts";
import type { Scene } from "./contract.ts";
import type { PlaygroundState } from "./state.ts";

export type SceneSource = Pick<ApiClient, "scene">;
type Look = Pick<PlaygroundState, "scene" | "filter" | "shading" | "interpolation">;

/// Scenes that were asked for, by name.
const kKnown = new Map<string, Scene>();

export function has_look({ filter, shading, interpolation }: Look): boolean {
  return filter !== "" || shading !== "" || interpolation !== "";
}

/// Fetches what scene_of() needs, once.
export async function learn_scene(
  source: SceneSource,
  state: Look,
  signal: AbortSignal,
): Promise<void> {
  if (!has_look(state) || kKnown.has(state.scene)) return;
  kKnown.set(state.scene, await source.scene(state.scene, signal));
}

/// The member `scene` of a request: a name, or the scene that was learnt, changed.
export function scene_of(state: Look): string | Scene {
  const scene = kKnown.get(state.scene);
  return has_look(state) && scene ? with_look(scene, state) : state.scene;
}

/// `scene` as the state wants it, its files by the name of the stored scene.
export function with_look(scene: Scene, state: Look): Scene {
  const { filter, shading, interpolation } = state;
  const file_of = (file: string): string => `${state.scene}/${file}`;
  const textures = mapped(scene.textures, (texture) => ({
    ...texture,
    file: file_of(texture.file),
    ...(filter === "" ? {} : { filter }),
  }));
  const written = scene.materials as Readonly<Record<string, { model?: string }>> | undefined;
  const materials = mapped(written, (material) =>
    shading === "" || material.model === "unlit" || material.model === undefined
      ? material
      : { ...material, model: shading },
  );
  const objects = scene.objects?.map((object) =>
    object.type !== "mesh"
      ? object
      : {
          ...object,
          file: file_of(object.file),
          ...(interpolation === "" ? {} : { interpolation }),
        },
  );
  return {
    ...scene,
    ...(textures ? { textures } : {}),
    ...(materials ? { materials } : {}),
    ...(objects ? { objects } : {}),
  } as Scene;
}

function mapped<Value, Other>(
  values: Readonly<Record<string, Value>> | undefined,
  change: (value: Value) => Other,
): Record<string, Other> | undefined {
  if (values === undefined) return undefined;
  return Object.fromEntries(Object.entries(values).map(([name, value]) => [name, change(value)]));
}
