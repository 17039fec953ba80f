/// Reads one channel of an OpenEXR file as fstop writes layers: scanlines, uncompressed or ZIP.
/// Source of the format: "OpenEXR File Layout" of the OpenEXR project.

/// A layer of numbers, row by row from the upper left.
export interface Layer {
  width: number;
  height: number;
  values: Float32Array;
}

interface Channel {
  name: string;
  bytes: 2 | 4; // half or float
}

interface Header {
  channels: Channel[];
  compression: number;
  width: number;
  height: number;
  end: number; // where the table of chunks begins
}

const kMagic = 20000630;
const kRowsOfChunk: ReadonlyMap<number, number> = new Map([
  [0, 1], // none
  [2, 1], // ZIPS
  [3, 16], // ZIP
]);

/// The channel with this name, or the first. Throws: Error where the file is none of those above.
export async function read_layer(file: ArrayBuffer, name = ""): Promise<Layer> {
  const view = new DataView(file);
  const { channels, compression, width, height, end } = header_of(view);
  const rows = kRowsOfChunk.get(compression);
  if (rows === undefined) throw new Error(`EXR compression ${compression} is not read here`);
  const at = Math.max(
    channels.findIndex((channel) => channel.name === name),
    0,
  );
  const before = channels.slice(0, at).reduce((sum, { bytes }) => sum + bytes * width, 0);
  const stride = channels.reduce((sum, { bytes }) => sum + bytes * width, 0);
  const wide = channels[at]?.bytes ?? 4;
  const values = new Float32Array(width * height);
  const chunks = Math.ceil(height / rows);
  const decode = async (index: number): Promise<void> => {
    const offset = Number(view.getBigUint64(end + 8 * index, true));
    const packed = new Uint8Array(file, offset + 8, view.getInt32(offset + 4, true));
    const count = Math.min(rows, height - index * rows);
    const raw = packed.length === count * stride ? packed : await unzipped(packed);
    const lines = new DataView(raw.buffer, raw.byteOffset, raw.byteLength);
    for (let row = 0; row < count; ++row)
      for (let x = 0; x < width; ++x) {
        const place = row * stride + before + x * wide;
        values[(index * rows + row) * width + x] =
          wide === 4 ? lines.getFloat32(place, true) : half(lines.getUint16(place, true));
      }
  };
  await Promise.all(Array.from({ length: chunks }, (_, index) => decode(index)));
  return { width, height, values };
}

function header_of(view: DataView): Header {
  if (view.getInt32(0, true) !== kMagic) throw new Error("not an EXR file");
  let place = 8;
  const text = (): string => {
    let found = "";
    for (let code = view.getUint8(place++); code !== 0; code = view.getUint8(place++))
      found += String.fromCharCode(code);
    return found;
  };
  const header: Header = { channels: [], compression: 0, width: 0, height: 0, end: 0 };
  for (let name = text(); name !== ""; name = text()) {
    text(); // its type, which its name tells already
    const size = view.getInt32(place, true);
    place += 4;
    const next = place + size;
    if (name === "compression") header.compression = view.getUint8(place);
    if (name === "dataWindow") {
      const [left, top, right, bottom] = [0, 4, 8, 12].map((by) => view.getInt32(place + by, true));
      header.width = (right ?? 0) - (left ?? 0) + 1;
      header.height = (bottom ?? 0) - (top ?? 0) + 1;
    }
    if (name === "channels")
      for (let channel = text(); channel !== ""; channel = text()) {
        header.channels.push({ name: channel, bytes: view.getInt32(place, true) === 1 ? 2 : 4 });
        place += 16;
      }
    place = next;
  }
  return { ...header, end: place };
}

/// A ZIP chunk: zlib of the bytes' differences, even places before odd ones.
async function unzipped(packed: Uint8Array<ArrayBuffer>): Promise<Uint8Array> {
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
  for (let i = 1; i < bytes.length; ++i)
    bytes[i] = ((bytes[i - 1] ?? 0) + (bytes[i] ?? 0) - 128) & 255;
  const raw = new Uint8Array(bytes.length);
  const middle = (bytes.length + 1) >> 1;
  for (let i = 0; i < bytes.length; ++i) raw[i] = bytes[(i & 1) * middle + (i >> 1)] ?? 0;
  return raw;
}

function half(bits: number): number {
  const sign = bits & 0x8000 ? -1 : 1;
  const exponent = (bits >> 10) & 31;
  const fraction = bits & 1023;
  if (exponent === 0) return (sign * fraction) / 2 ** 24;
  if (exponent === 31) return fraction ? Number.NaN : sign * Number.POSITIVE_INFINITY;
  return sign * (1 + fraction / 1024) * 2 ** (exponent - 15);
}

/// The value at a place given as fractions of width and height.
export function value_at(layer: Layer, x: number, y: number): number {
  const place = (fraction: number, count: number): number =>
    Math.min(Math.max(Math.floor(fraction * count), 0), count - 1);
  const index = place(y, layer.height) * layer.width + place(x, layer.width);
  return layer.values[index] ?? Number.NaN;
}
