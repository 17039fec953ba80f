/// The state of the page in the browser's address and history.
import { misread, page_fragment, page_of } from "./page_state.ts";
import type { PageState } from "./page_state.ts";

const kSameGesture_ms = 1000;

/// Writes states to the address. Settled changes within one second, as held arrow keys make
/// them, become one step of the history.
export class Address {
  private written_at_ms_ = Number.NEGATIVE_INFINITY;

  constructor(private readonly window_: Window) {}

  page(): PageState {
    return page_of(this.window_.location.hash);
  }

  /// The parts of the address that are not understood.
  misread(): string[] {
    return misread(this.window_.location.hash);
  }

  write(page: PageState): void {
    const fragment = page_fragment(page);
    if (fragment === this.window_.location.hash) return;
    const now_ms = performance.now();
    const same_gesture = now_ms - this.written_at_ms_ < kSameGesture_ms;
    this.written_at_ms_ = now_ms;
    if (same_gesture) this.window_.history.replaceState(null, "", fragment);
    else this.window_.history.pushState(null, "", fragment);
  }

  /// Calls `on_page` when back, forward or an edit of the address brings another state.
  watch(on_page: (page: PageState) => void, signal: AbortSignal): void {
    const report = (): void => {
      this.written_at_ms_ = Number.NEGATIVE_INFINITY;
      on_page(this.page());
    };
    this.window_.addEventListener("popstate", report, { signal });
  }
}
