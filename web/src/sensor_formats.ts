/// Sensor formats by their names, and the picture sizes that divide each into square pixels.
import type { ImageSize } from "./contract.ts";

export interface SensorFormat {
  caption: string;
  sensor_mm: [number, number];
  /// Of previews, from the smallest to about 640 pixels wide.
  previews: readonly [ImageSize, ...ImageSize[]];
  picture: ImageSize;
}

const kThreeToTwo = sizes_of(3, 2, [80, 120, 160, 214], 320);
const kFourToThree = sizes_of(4, 3, [55, 80, 110, 160], 220);

const kFormats = {
  "full-frame": { caption: "Full frame, 36 × 24 mm", sensor_mm: [36, 24], ...kThreeToTwo },
  "medium-format": {
    caption: "Medium format, 44 × 33 mm",
    sensor_mm: [44, 33],
    ...kFourToThree,
  },
  "large-format": {
    caption: "4 × 5 inch film, 120 × 96 mm",
    sensor_mm: [120, 96],
    ...sizes_of(5, 4, [42, 64, 84, 128], 164),
  },
  "aps-c": {
    caption: "APS-C, 23.5 × 15.6 mm",
    sensor_mm: [23.5, 15.6],
    ...sizes_of(235, 156, [1, 2, 3], 4),
  },
  "four-thirds": {
    caption: "Four Thirds, 17.3 × 13 mm",
    sensor_mm: [17.3, 13],
    ...sizes_of(173, 130, [1, 2, 3, 4], 5),
  },
  "one-inch": { caption: "1 inch, 13.2 × 8.8 mm", sensor_mm: [13.2, 8.8], ...kThreeToTwo },
  phone: { caption: "Phone, 9.6 × 7.2 mm", sensor_mm: [9.6, 7.2], ...kFourToThree },
} as const satisfies Record<string, SensorFormat>;

export type SensorName = keyof typeof kFormats;
export const kSensorNames = Object.keys(kFormats) as SensorName[];

export function sensor_format(name: SensorName): SensorFormat {
  return kFormats[name];
}

/// The size of the finished picture.
export function picture_size(name: SensorName): ImageSize {
  return kFormats[name].picture;
}

/// The largest preview: what a change shows first.
export function preview_size(name: SensorName): ImageSize {
  const { previews } = sensor_format(name);
  return previews.at(-1) ?? previews[0];
}

/// For charts that render many pictures: about 100 pixels wide where the format divides so.
export function chart_size(name: SensorName): ImageSize {
  const { width, height } = kFormats[name].previews[0];
  const divisor = [5, 4, 3, 2].find((by) => width % by === 0 && height % by === 0 && width / by > 40);
  return divisor === undefined ? { width, height } : { width: width / divisor, height: height / divisor };
}

function sizes_of(
  across: number,
  down: number,
  [smallest, ...larger]: readonly [number, ...number[]],
  full: number,
): Pick<SensorFormat, "previews" | "picture"> {
  const size = (pixels: number): ImageSize => ({ width: across * pixels, height: down * pixels });
  return { previews: [size(smallest), ...larger.map(size)], picture: size(full) };
}
