/// One request's picture: the newest of it that has come, how far the next one is, or why there is
/// none. It stays together when A and B change places.
import { LatestTask } from "./latest_task.ts";
import type { Urgency } from "./latest_task.ts";
import { kNoPicture, picture_updates } from "./picture_updates.ts";
import type { PictureSource, PictureView } from "./picture_updates.ts";
import type { PreviewPace } from "./preview_pace.ts";
import { fragment_of } from "./state.ts";
import type { PlaygroundState } from "./state.ts";

export class PictureSide {
  private view_: PictureView = kNoPicture;
  private asked_ = "";
  private readonly task_: LatestTask<PlaygroundState>;

  /// `on_change` hears of every new view.
  constructor(
    source: PictureSource,
    pace: PreviewPace,
    private readonly on_change_: () => void,
  ) {
    this.task_ = new LatestTask<PlaygroundState>(async (wanted, signal, has_result, urgency) => {
      const hand = { pace, is_held: urgency === "patient" };
      for await (const update of picture_updates(source, wanted, signal, hand)) {
        if (signal.aborted) break; // it came in the moment of the next question
        this.take(update);
        if (update.image) has_result();
      }
    });
  }

  get view(): PictureView {
    return this.view_;
  }

  take(update: Partial<PictureView>): void {
    this.view_ = { ...this.view_, ...update };
    this.on_change_();
  }

  /// Asks only for what is not already asked for.
  ask(wanted: PlaygroundState, urgency: Urgency): void {
    const key = fragment_of(wanted);
    if (this.asked_ === key) return;
    this.asked_ = key;
    this.task_.submit(wanted, urgency);
  }

  hurry(): void {
    this.task_.hurry();
  }

  /// Shows `view` from now on, of which nothing is under way here.
  begin_with(view: PictureView): void {
    this.stop();
    this.take({ ...view, activity: "idle", progress: undefined });
  }

  /// What is asked next is asked in any case.
  forget(): void {
    this.asked_ = "";
  }

  stop(): void {
    this.task_.stop();
    this.forget();
  }
}
