/// How large a preview may be so that it comes in time, by what the last ones took.
import type { ImageSize } from "./contract.ts";

/// Twenty pictures a second, less what their way to the screen takes.
const kBudget_ms = 40;
/// What a preview takes however small it is: the way to the server and back.
const kFixed_ms = 8;
/// Of the newest measurement in the running mean: a burst of other work is soon forgotten.
const kNewest = 0.4;

export class PreviewPace {
  private ms_per_pixel_ = 0;

  learn({ width, height }: ImageSize, took_ms: number): void {
    const newest = Math.max(took_ms - kFixed_ms, 0) / (width * height);
    this.ms_per_pixel_ += (this.ms_per_pixel_ === 0 ? 1 : kNewest) * (newest - this.ms_per_pixel_);
  }

  /// The largest that is expected in time, or the smallest. `sizes` ascend.
  size_among(sizes: readonly [ImageSize, ...ImageSize[]]): ImageSize {
    const in_time = ({ width, height }: ImageSize): boolean =>
      kFixed_ms + width * height * this.ms_per_pixel_ <= kBudget_ms;
    return sizes.findLast(in_time) ?? sizes[0];
  }
}
