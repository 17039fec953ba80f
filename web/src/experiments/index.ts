/// All guided experiments by the names of their files, in the order in which they are offered.
/// To add one, put its file here; its name begins with its place in the order.
import type { Experiment } from "../experiment.ts";

const kFiles = import.meta.glob<Experiment>("./*.json", { eager: true, import: "default" });

export const kExperiments: ReadonlyMap<string, Experiment> = new Map(
  Object.entries(kFiles).map(([path, experiment]) => [
    path.replace(/^\.\/\d+-(.*)\.json$/, "$1"),
    experiment,
  ]),
);
