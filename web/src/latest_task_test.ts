import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { LatestTask } from "./latest_task.ts";

interface Run {
  input: number;
  signal: AbortSignal;
}

/// A task whose runs last `duration_ms` unless aborted, with a count of those at work.
function watched_task(duration_ms: number) {
  const runs: Run[] = [];
  const seen = { at_work: 0, most_at_work: 0 };
  const task = new LatestTask<number>(async (input, signal) => {
    runs.push({ input, signal });
    seen.most_at_work = Math.max(seen.most_at_work, ++seen.at_work);
    await new Promise<void>((resolve) => {
      const timer = setTimeout(resolve, duration_ms);
      signal.addEventListener("abort", () => (clearTimeout(timer), resolve()));
    });
    --seen.at_work;
  });
  return { task, runs, seen };
}

describe("latest task", () => {
  beforeEach(() => void vi.useFakeTimers());
  afterEach(() => void vi.useRealTimers());

  it("joins the inputs of one gesture", async () => {
    const { task, runs } = watched_task(10);
    for (const input of [1, 2, 3]) task.submit(input);
    await vi.advanceTimersByTimeAsync(39);
    expect(runs).toHaveLength(0);
    await vi.advanceTimersByTimeAsync(1);
    expect(runs.map((run) => run.input)).toEqual([3]);
  });

  it("aborts the stale run and starts the newest input, one at a time", async () => {
    const { task, runs, seen } = watched_task(1000);
    task.submit(1);
    await vi.advanceTimersByTimeAsync(100);
    task.submit(2);
    await vi.advanceTimersByTimeAsync(100);
    expect(runs.map((run) => run.signal.aborted)).toEqual([true, false]);
    await vi.advanceTimersByTimeAsync(2000);
    expect(runs.map((run) => run.input)).toEqual([1, 2]);
    expect(seen).toEqual({ at_work: 0, most_at_work: 1 });
  });

  it("keeps showing something while inputs never rest", async () => {
    const { task, runs } = watched_task(10);
    for (let input = 0; input < 60; ++input) {
      task.submit(input);
      await vi.advanceTimersByTimeAsync(10);
    }
    expect(runs.length).toBeGreaterThanOrEqual(4);
    await vi.advanceTimersByTimeAsync(200);
    expect(runs.at(-1)?.input).toBe(59);
  });

  it("stops: nothing waits, what runs is aborted", async () => {
    const { task, runs } = watched_task(1000);
    task.submit(1);
    await vi.advanceTimersByTimeAsync(50);
    task.submit(2);
    task.stop();
    await vi.advanceTimersByTimeAsync(2000);
    expect(runs.map((run) => [run.input, run.signal.aborted])).toEqual([[1, true]]);
  });
});
