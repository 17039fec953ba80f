/// The parts of the HTTP contract that the page reads and writes, by their names in openapi.json
/// (`npm run types` makes api_types.ts from it).
import type { components } from "./api_types.ts";

type Schemas = components["schemas"];

/// JSON has no infinity: an infinite value is the string "infinity", in and out.
export type Distance = Schemas["Number"];

export type Camera = Schemas["Camera"];
export type RenderRequest = Schemas["RenderRequest"];
export type OpticsRequest = Schemas["OpticsRequest"];

export type Scene = Schemas["Scene"];
export type SceneList = Schemas["SceneList"];
export type SceneSummary = Schemas["SceneSummary"];
export type RenderReport = Schemas["RenderReport"];
export type ModelledEffect = Schemas["ModelledEffect"];
export type OpticsReport = Schemas["OpticsReport"];
export type OpticsAtDistance = Schemas["OpticsAtDistance"];
export type PinholeCriterion = Schemas["PinholeCriterion"];
export type PsfRequest = Schemas["PsfRequest"];
export type PsfReport = Schemas["PsfReport"];
export type ChartRequest = Schemas["ChartRequest"];
export type ChartReport = Schemas["ChartReport"];
export type ChartPoint = Schemas["ChartPoint"];
export type MeasurementRequest = Schemas["MeasurementRequest"];
export type MeasurementReport = Schemas["MeasurementReport"];
export type PinholeOptics = Schemas["PinholeOptics"];

/// A render that goes on by itself (202), where the server makes such jobs; what the page reads of
/// it.
export interface Job {
  job: string;
  state: "queued" | "running" | "done" | "failed" | "cancelled";
  fraction: number;
  queue_place?: number;
  upper_95?: number; // of the preview's error
  remaining_ms?: number;
  links: { preview?: string };
  problem?: Problem;
}

/// One fault of a refused request: where it is and what is wrong with it.
export type Fault = Schemas["FieldFault"];
/// RFC 9457; what a reply that is none of fstop's own lacks, is absent.
export type Problem = Partial<Schemas["Problem"]>;

export interface ImageSize {
  width: number;
  height: number;
}
