/// The state in the browser's address and history.
import { fragment_of, state_of } from "./state.ts";
import type { PlaygroundState } from "./state.ts";

const kSameGesture_ms = 1000;

/// Writes states to the address. Settled changes within one second, as held arrow keys make
/// them, become one step of the history.
export class Address {
  private written_at_ms_ = Number.NEGATIVE_INFINITY;

  constructor(private readonly window_: Window) {}

  state(): PlaygroundState {
    return state_of(this.window_.location.hash);
  }

  write(state: PlaygroundState): void {
    const fragment = fragment_of(state);
    if (fragment === this.window_.location.hash) return;
    const now_ms = performance.now();
    const same_gesture = now_ms - this.written_at_ms_ < kSameGesture_ms;
    this.written_at_ms_ = now_ms;
    if (same_gesture) this.window_.history.replaceState(null, "", fragment);
    else this.window_.history.pushState(null, "", fragment);
  }

  /// Calls `on_state` when back, forward or an edit of the address brings another state.
  watch(on_state: (state: PlaygroundState) => void, signal: AbortSignal): void {
    const report = (): void => {
      this.written_at_ms_ = Number.NEGATIVE_INFINITY;
      on_state(this.state());
    };
    this.window_.addEventListener("popstate", report, { signal });
  }
}
