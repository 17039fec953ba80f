/// Runs an asynchronous task for the newest of a stream of inputs: waits until the inputs rest
/// for a moment, aborts the run of an older input, and never has two runs at once.

export interface Pace {
  rest_ms: number; // start after the inputs have rested so long ...
  patience_ms: number; // ... or after the first one has waited so long
}

/// Short enough to feel immediate, long enough to join the events of one gesture.
export const kDraggingPace: Pace = { rest_ms: 40, patience_ms: 120 };

export class LatestTask<Input> {
  private waiting_since_ms_: number | undefined;
  private timer_: ReturnType<typeof setTimeout> | undefined;
  private current_: { abort: AbortController; done: Promise<void> } | undefined;
  private next_: { input: Input } | undefined;

  /// `run` must end soon after its signal aborts; it reports its own errors.
  constructor(
    private readonly run_: (input: Input, signal: AbortSignal) => Promise<void>,
    private readonly pace_: Pace = kDraggingPace,
  ) {}

  submit(input: Input): void {
    this.next_ = { input };
    this.waiting_since_ms_ ??= performance.now();
    const waited_ms = performance.now() - this.waiting_since_ms_;
    const wait_ms = Math.min(this.pace_.rest_ms, Math.max(this.pace_.patience_ms - waited_ms, 0));
    clearTimeout(this.timer_);
    this.timer_ = setTimeout(() => void this.start_(), wait_ms);
  }

  /// Drops what waits and aborts what runs.
  stop(): void {
    clearTimeout(this.timer_);
    this.next_ = undefined;
    this.waiting_since_ms_ = undefined;
    this.current_?.abort.abort();
  }

  private async start_(): Promise<void> {
    this.waiting_since_ms_ = undefined;
    this.current_?.abort.abort();
    await this.current_?.done;
    // Of several starts that waited for the same run, the first takes the newest input.
    const next = this.next_;
    if (next === undefined) return;
    this.next_ = undefined;
    const abort = new AbortController();
    const done = this.run_(next.input, abort.signal);
    this.current_ = { abort, done };
    await done;
    if (this.current_?.done === done) this.current_ = undefined;
  }
}
