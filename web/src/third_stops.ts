/// F-numbers in third stops. The true value of step n is 2^(n/6), so that three steps halve the
/// light exactly; the label is the rounded number that cameras engrave (f/5.6 is 5.657).
/// Source of the labels: the one-third-stop scale in use on cameras, f/1 to f/64.
const kNominalLabels: readonly string[] = [
  ..."1 1.1 1.2 1.4 1.6 1.8 2 2.2 2.5 2.8 3.2 3.5 4 4.5 5 5.6 6.3 7.1".split(" "),
  ..."8 9 10 11 13 14 16 18 20 22 25 29 32 36 40 45 51 57 64".split(" "),
];

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
