/// Runs an asynchronous task for the newest of a stream of inputs: the first one after a pause at
/// once, those that follow closely when they rest for a moment; aborts the run of an older input,
/// and never has two runs at once.

export interface Pace {
  rest_ms: number; // start after the inputs have rested so long ...
  patience_ms: number; // ... or after the first one has waited so long
  held_ms: number; // so long after the first one, while a hand holds what changes
}

/// Short enough to feel immediate, long enough to join the events of one gesture.
export const kDraggingPace: Pace = { rest_ms: 40, patience_ms: 120, held_ms: 0 };

/// An urgent input aborts the run under way at once. A patient one, of a slider that is still
/// held, lets it come to its first result: else a fast hand would never see one.
export type Urgency = "urgent" | "patient";

/// The task itself. It calls `has_result` at its first result, must end soon after its signal
/// aborts, and reports its own errors.
export type Run<Input> = (
  input: Input,
  signal: AbortSignal,
  has_result: () => void,
  urgency: Urgency,
) => Promise<void>;

export class LatestTask<Input> {
  private waiting_since_ms_: number | undefined;
  private last_input_ms_ = Number.NEGATIVE_INFINITY;
  private is_alone_ = false; // the newest input came after a pause
  private timer_: ReturnType<typeof setTimeout> | undefined;
  private next_: { input: Input; urgency: Urgency } | undefined;
  private current_:
    { abort: AbortController; result: Promise<void>; done: Promise<void> } | undefined;

  constructor(
    private readonly run_: Run<Input>,
    private readonly pace_: Pace = kDraggingPace,
  ) {}

  submit(input: Input, urgency: Urgency = "urgent"): void {
    this.next_ = { input, urgency };
    const now_ms = performance.now();
    const is_alone = now_ms - this.last_input_ms_ > this.pace_.patience_ms;
    this.last_input_ms_ = now_ms;
    this.is_alone_ = is_alone;
    this.waiting_since_ms_ ??= now_ms;
    const waited_ms = now_ms - this.waiting_since_ms_;
    const rest_ms = Math.min(this.pace_.rest_ms, Math.max(this.pace_.patience_ms - waited_ms, 0));
    // What waits for the run under way need not wait for the hand to rest too.
    const held_ms = Math.max(this.pace_.held_ms - waited_ms, 0);
    this.start_in_(urgency === "patient" ? held_ms : is_alone ? 0 : rest_ms);
  }

  /// Makes the input that waits urgent, if one waits. One that came alone starts at once: a key is
  /// held and let go in one moment. Keys that repeat are joined like other inputs.
  hurry(): void {
    if (this.next_ === undefined) return;
    if (!this.is_alone_) return this.submit(this.next_.input);
    this.next_.urgency = "urgent";
    clearTimeout(this.timer_);
    // Now, not by a timer: the page would be drawn anew before it.
    void this.start_();
  }

  /// Drops what waits and aborts what runs.
  stop(): void {
    clearTimeout(this.timer_);
    this.next_ = undefined;
    this.waiting_since_ms_ = undefined;
    this.current_?.abort.abort();
  }

  private start_in_(wait_ms: number): void {
    clearTimeout(this.timer_);
    this.timer_ = setTimeout(() => void this.start_(), wait_ms);
  }

  private async start_(): Promise<void> {
    this.waiting_since_ms_ = undefined;
    // A start that waited for the run before may have taken the input: what runs now is its own.
    if (this.next_ === undefined) return;
    const stale = this.current_;
    if (this.next_.urgency === "patient") await Promise.race([stale?.result, stale?.done]);
    stale?.abort.abort();
    await stale?.done;
    // Of several starts that waited for the same run, the first takes the newest input.
    const next = this.next_;
    if (next === undefined) return;
    this.next_ = undefined;
    const abort = new AbortController();
    const { promise: result, resolve: has_result } = promise_with_resolver();
    const done = this.run_(next.input, abort.signal, has_result, next.urgency);
    this.current_ = { abort, result, done };
    await done;
    if (this.current_?.done === done) this.current_ = undefined;
  }
}

function promise_with_resolver(): { promise: Promise<void>; resolve: () => void } {
  let resolve = (): void => undefined;
  const promise = new Promise<void>((settle) => (resolve = settle));
  return { promise, resolve };
}
