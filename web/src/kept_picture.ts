/// The finished picture of the present settings, or what it waits for.
import { kNoComplaint } from "./faults.ts";
import type { OpticsView } from "./optics_updates.ts";
import type { PictureView } from "./picture_updates.ts";
import { fragment_of } from "./state.ts";
import type { PlaygroundState } from "./state.ts";

/// `id`: of the render that the server keeps; `waits_for`: a sentence, where there is none yet.
export type KeptPicture = { id: string } | { waits_for: string };

export function kept_picture(view: PictureView, present: PlaygroundState): KeptPicture {
  const { activity, complaint, image, report, shown } = view;
  if (complaint !== kNoComplaint)
    return { waits_for: "The server refuses these settings: there is no picture of them to save." };
  if (activity === "away") return { waits_for: "The server does not answer; files come when it does." };
  const is_present = shown !== undefined && fragment_of(shown) === fragment_of(present);
  const is_finished = activity === "idle" && image !== undefined && report?.id === image.id;
  return is_present && is_finished && image.id !== ""
    ? { id: image.id }
    : { waits_for: "The picture's files come when it is finished." };
}

/// The optics of the present settings, if they have come.
export function present_optics(
  { optics, of, complaint }: OpticsView,
  present: PlaygroundState,
): OpticsView["optics"] {
  const is_present = of !== undefined && fragment_of(of) === fragment_of(present);
  return is_present && complaint === kNoComplaint ? optics : undefined;
}
