/// F-numbers, shutter times and ISO speeds in third stops. The true value of the f-number of step
/// n is 2^(n/6), so that three steps halve the light exactly; the label is the rounded number that
/// cameras engrave (f/5.6 is 5.657). So it is with 2^(-n/3) s (1/125 is 1/128) and 100 * 2^(n/3).
/// Source of the labels: the one-third-stop scales in use on cameras.
export interface StopScale {
  labels: readonly string[];
  value: (step: number) => number; // without check: steps are indices of `labels`
}

const kNominalLabels: readonly string[] = [
  ..."1 1.1 1.2 1.4 1.6 1.8 2 2.2 2.5 2.8 3.2 3.5 4 4.5 5 5.6 6.3 7.1".split(" "),
  ..."8 9 10 11 13 14 16 18 20 22 25 29 32 36 40 45 51 57 64".split(" "),
];

export const kShutterTimes: StopScale = {
  labels: [
    ..."1 0.8 0.6 1/2 0.4 0.3 1/4 1/5 1/6 1/8 1/10 1/13 1/15 1/20 1/25 1/30 1/40".split(" "),
    ..."1/50 1/60 1/80 1/100 1/125 1/160 1/200 1/250 1/320 1/400 1/500 1/640 1/800".split(" "),
    ..."1/1000 1/1250 1/1600 1/2000 1/2500 1/3200 1/4000 1/5000 1/6400 1/8000".split(" "),
  ],
  value: (step) => 2 ** (-step / 3),
};

export const kIsoSpeeds: StopScale = {
  labels: [
    ..."100 125 160 200 250 320 400 500 640 800 1000 1250 1600 2000 2500 3200".split(" "),
    ..."4000 5000 6400 8000 10000 12800 16000 20000 25600".split(" "),
  ],
  value: (step) => 100 * 2 ** (step / 3),
};

/// The last step, f/64; the first is 0, f/1.
export const kLastThirdStop = kNominalLabels.length - 1;

/// The f-number to ask the server for. Throws: RangeError unless 0 <= step <= kLastThirdStop.
export function f_number_of_step(step: number): number {
  nominal_label(step);
  return 2 ** (step / 6);
}

/// The engraved number without the "f/". Throws: RangeError unless 0 <= step <= kLastThirdStop.
export function nominal_label(step: number): string {
  const label = kNominalLabels[step];
  if (label === undefined) throw new RangeError(`no third stop ${step}`);
  return label;
}

/// The step with this engraved number, if there is one.
export function step_of_label(label: string): number | undefined {
  const step = kNominalLabels.indexOf(label);
  return step < 0 ? undefined : step;
}

/// The step whose f-number is nearest in stops; beyond the scale its ends.
export function nearest_step(f_number: number): number {
  return within(Math.round(6 * Math.log2(f_number)), kLastThirdStop);
}

/// The index of a label on a scale, if it is there.
export function index_on(scale: StopScale, label: string): number | undefined {
  const step = scale.labels.indexOf(label);
  return step < 0 ? undefined : step;
}

/// A step moved by `by`, stopped at the ends of its scale.
export function moved_on(scale: StopScale, step: number, by: number): number {
  return within(step + by, scale.labels.length - 1);
}

function within(step: number, last: number): number {
  return Math.min(Math.max(step, 0), last);
}
