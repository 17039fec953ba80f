/// Where a plot's words stand, so that they touch neither each other nor what is drawn.
export interface Box {
  left: number;
  top: number;
  right: number;
  bottom: number;
}

/// A drawn line, through its points; one point alone is a symbol.
export type Drawn = readonly (readonly [number, number])[];

const kGap_px = 4;
const kSymbol_px = 9; // from a symbol's middle to where words may begin
const kPlaces = 12; // along a line

/// Of several choices of ticks the first whose texts all stand side by side, else those of the first
/// that do.
export function fitting(
  choices: readonly (readonly number[])[],
  place: (tick: number) => number,
  width: (tick: number) => number,
): readonly number[] {
  const fits = (ticks: readonly number[]): boolean =>
    spaced(ticks, place, width).length === ticks.length;
  return choices.find(fits) ?? spaced(choices[0] ?? [], place, width);
}

/// The ticks whose texts stand side by side, from the first on.
function spaced(
  ticks: readonly number[],
  place: (tick: number) => number,
  width: (tick: number) => number,
): number[] {
  const kept: number[] = [];
  let end = Number.NEGATIVE_INFINITY;
  for (const tick of ticks) {
    const half = width(tick) / 2;
    if (place(tick) - half < end + kGap_px) continue;
    kept.push(tick);
    end = place(tick) + half;
  }
  return kept;
}

/// A word above the plot: its row, from the top, and where it begins.
export interface Above {
  row: number;
  left: number;
}

/// Words beside the upper ends of lines at `x`, each in a row of its own: to the right of them, the
/// leftmost in the uppermost row, so that no line passes through a word; the other way round where
/// one would leave the room.
export function words_above(
  marks: readonly { x: number; width: number }[],
  room: { left: number; right: number },
): Above[] {
  const to_right = marks.every(({ x, width }) => x + kGap_px + width <= room.right);
  const order = marks.map((_, i) => i);
  order.sort((i, j) => ((marks[i]?.x ?? 0) - (marks[j]?.x ?? 0)) * (to_right ? 1 : -1));
  return marks.map(({ x, width }, i) => ({
    row: order.indexOf(i),
    left: to_right ? x + kGap_px : Math.max(x - kGap_px - width, room.left),
  }));
}

/// The box beside the horizontal line at `y` that touches least, the right end first.
export function box_along(
  y: number,
  size: { width: number; height: number },
  room: Box,
  taken: { boxes: readonly Box[]; lines: readonly Drawn[] },
): Box {
  const free_px = Math.max(room.right - room.left - size.width - 2 * kGap_px, 0);
  let best: { box: Box; touched: number } | undefined;
  for (let i = 0; i <= kPlaces; ++i)
    for (const top of [y - size.height - 2, y + 2]) {
      const left = room.right - kGap_px - size.width - (free_px * i) / kPlaces;
      const box = { left, top, right: left + size.width, bottom: top + size.height };
      const touched = touches(box, room, taken);
      if (touched === 0) return box;
      if (best === undefined || touched < best.touched) best = { box, touched };
    }
  return best?.box ?? { left: room.left, top: y, right: room.left + size.width, bottom: y };
}

function touches(
  box: Box,
  room: Box,
  { boxes, lines }: { boxes: readonly Box[]; lines: readonly Drawn[] },
): number {
  const outside = box.top < room.top || box.bottom > room.bottom ? 1 : 0;
  const words = boxes.filter((other) => overlap(box, other)).length;
  // Words over words are worse than words over lines.
  return outside + 4 * words + lines.filter((line) => crosses(line, box)).length;
}

export function overlap(a: Box, b: Box): boolean {
  return a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom;
}

/// Whether a line passes through a box, or a symbol lies in it.
export function crosses(line: Drawn, box: Box): boolean {
  const [only] = line;
  if (line.length === 1 && only)
    return overlap(box, {
      left: only[0] - kSymbol_px,
      right: only[0] + kSymbol_px,
      top: only[1] - kSymbol_px,
      bottom: only[1] + kSymbol_px,
    });
  return line.slice(1).some((to, i) => segment_crosses(line[i] ?? to, to, box));
}

/// By the part of the segment that lies within the box's sides, then within its top and bottom.
function segment_crosses(
  [x0, y0]: readonly [number, number],
  [x1, y1]: readonly [number, number],
  box: Box,
): boolean {
  let [from, to] = [0, 1];
  for (const [start, by, least, most] of [
    [x0, x1 - x0, box.left, box.right],
    [y0, y1 - y0, box.top, box.bottom],
  ] as const) {
    if (by === 0) {
      if (start < least || start > most) return false;
      continue;
    }
    const ends = [(least - start) / by, (most - start) / by];
    from = Math.max(from, Math.min(...ends));
    to = Math.min(to, Math.max(...ends));
  }
  return from <= to;
}
