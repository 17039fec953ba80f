import { describe, expect, it } from "vitest";
import { read_layer, value_at } from "./exr.ts";

/// A file of 2 x 18 pixels, channel "A" half and "Z" float; ZIP packs sixteen rows at once.
async function file_with(compression: 0 | 3): Promise<ArrayBuffer> {
  const header: number[] = [];
  const int = (value: number): number[] => [...new Uint8Array(new Int32Array([value]).buffer)];
  const text = (value: string): number[] => [...new TextEncoder().encode(value), 0];
  const attribute = (name: string, type: string, value: number[]): void =>
    void header.push(...text(name), ...text(type), ...int(value.length), ...value);
  header.push(...int(20000630), ...int(2));
  const channel = (name: string, type: number): number[] => [
    ...text(name),
    ...int(type),
    ...int(0),
    ...int(1),
    ...int(1),
  ];
  attribute("channels", "chlist", [...channel("A", 1), ...channel("Z", 2), 0]);
  attribute("compression", "compression", [compression]);
  attribute("dataWindow", "box2i", [0, 0, 1, 17].flatMap(int));
  header.push(0);
  const rows = compression === 0 ? 1 : 16;
  const chunks: number[][] = [];
  for (let top = 0; top < 18; top += rows) {
    const raw: number[] = [];
    for (let y = top; y < Math.min(top + rows, 18); ++y) {
      raw.push(0x00, 0x3c, 0x00, 0xc0); // halves: 1 and -2
      raw.push(...new Uint8Array(new Float32Array([y, y + 0.5]).buffer));
    }
    const packed = compression === 0 ? raw : [...(await deflated(shuffled(raw)))];
    chunks.push([...int(top), ...int(packed.length), ...packed]);
  }
  let place = header.length + 8 * chunks.length;
  const table = chunks.flatMap((chunk) => {
    const at = [...int(place), ...int(0)];
    place += chunk.length;
    return at;
  });
  return new Uint8Array([...header, ...table, ...chunks.flat()]).buffer;
}

async function deflated(raw: Uint8Array<ArrayBuffer>): Promise<Uint8Array> {
  const stream = new Blob([raw]).stream().pipeThrough(new CompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

function shuffled(raw: number[]): Uint8Array<ArrayBuffer> {
  const apart = [...raw.filter((_, i) => i % 2 === 0), ...raw.filter((_, i) => i % 2 === 1)];
  return new Uint8Array(
    apart.map((byte, i) => (i === 0 ? byte : (byte - (apart[i - 1] ?? 0) + 128 + 256) & 255)),
  );
}

describe("layers of EXR files", () => {
  it.each([0, 3] as const)("are read, compression %i", async (compression) => {
    const depth = await read_layer(await file_with(compression), "Z");
    expect([depth.width, depth.height]).toEqual([2, 18]);
    expect(value_at(depth, 0.25, 17.5 / 18)).toBe(17);
    expect(value_at(depth, 1, 0)).toBe(0.5);
    const half = await read_layer(await file_with(compression), "A");
    expect([...half.values.slice(0, 2)]).toEqual([1, -2]);
  });
});
