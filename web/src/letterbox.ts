/// A picture within a frame of another shape: as large as fits, in the middle, bars beside it.
import type { ImageSize } from "./contract.ts";
import type { PicturePoint } from "./page_state.ts";

export function same_shape(a: ImageSize, b: ImageSize): boolean {
  return a.width * b.height === a.height * b.width;
}

/// The place in a picture of the size `inner` that lies at `at` in a frame of the shape of `outer`;
/// undefined on the bars.
export function place_within(
  { x, y }: PicturePoint,
  outer: ImageSize,
  inner: ImageSize,
): PicturePoint | undefined {
  const wider = (inner.width * outer.height) / (inner.height * outer.width);
  const share_x = Math.min(wider, 1); // of the frame's width that the picture takes
  const share_y = Math.min(1 / wider, 1);
  const place = { x: (x - 0.5) / share_x + 0.5, y: (y - 0.5) / share_y + 0.5 };
  const inside = [place.x, place.y].every((value) => value >= 0 && value <= 1);
  return inside ? place : undefined;
}
