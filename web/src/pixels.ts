/// Arithmetic of finished pictures' pixels: reading, comparing, colouring.
import type { ImageSize } from "./contract.ts";
import type { Layer } from "./exr.ts";

/// The 8-bit pixels of a picture, brought to `size` where that is given.
export async function pixels_of(picture: Blob, size?: ImageSize): Promise<ImageData> {
  const bitmap = await createImageBitmap(picture);
  const { width, height } = size ?? bitmap;
  const context = new OffscreenCanvas(width, height).getContext("2d");
  if (!context) throw new Error("this browser draws no pictures");
  context.drawImage(bitmap, 0, 0, width, height);
  bitmap.close();
  return context.getImageData(0, 0, width, height);
}

export interface Difference {
  pixels: Uint8ClampedArray<ArrayBuffer>; // RGBA, mid-grey where equal
  mean: number; // of the absolute differences of all channels, levels of 255
  largest: number;
}

/// What the second picture has more or less than the first, times `gain` about mid-grey.
export function difference_of(
  a: Uint8ClampedArray,
  b: Uint8ClampedArray,
  gain: number,
): Difference {
  const pixels = new Uint8ClampedArray(a.length);
  let sum = 0;
  let largest = 0;
  for (let i = 0; i < a.length; ++i) {
    if (i % 4 === 3) {
      pixels[i] = 255;
      continue;
    }
    const by = (b[i] ?? 0) - (a[i] ?? 0);
    sum += Math.abs(by);
    largest = Math.max(largest, Math.abs(by));
    pixels[i] = 128 + gain * by;
  }
  return { pixels, mean: sum / (0.75 * a.length), largest };
}

const kNear: readonly [number, number, number] = [226, 110, 20];
const kFar: readonly [number, number, number] = [40, 105, 225];
const kSharp: readonly [number, number, number] = [30, 170, 90];
const kStopsToFull = 5; // doublings of the limit until the colour is full

/// Blur discs as colour: near of the focused plane, beyond it, and what counts as sharp.
export function blur_colours(coc_px: Layer, limit_px: number): Uint8ClampedArray<ArrayBuffer> {
  const pixels = new Uint8ClampedArray(4 * coc_px.values.length);
  coc_px.values.forEach((blur_px, i) => {
    const times = Math.abs(blur_px) / limit_px;
    const [red, green, blue] = times <= 1 ? kSharp : blur_px < 0 ? kNear : kFar;
    const share = Math.min(Math.log2(Math.max(times, 1)) / kStopsToFull, 1);
    pixels.set([red, green, blue, times <= 1 ? 110 : 40 + 150 * share], 4 * i);
  });
  return pixels;
}
