import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { LatestTask } from "./latest_task.ts";

interface Run {
  input: number;
  signal: AbortSignal;
}

/// A task whose runs last `duration_ms` unless aborted, with a count of those at work. Their first
/// result comes after `result_ms`.
function watched_task(duration_ms: number, result_ms = duration_ms) {
  const runs: Run[] = [];
  const seen = { at_work: 0, most_at_work: 0 };
  const task = new LatestTask<number>(async (input, signal, has_result) => {
    runs.push({ input, signal });
    setTimeout(has_result, result_ms);
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

  it("starts at once for an input that comes alone", async () => {
    const { task, runs } = watched_task(10);
    task.submit(1);
    await vi.advanceTimersByTimeAsync(0);
    expect(runs.map((run) => run.input)).toEqual([1]);
    await vi.advanceTimersByTimeAsync(500);
    task.submit(2);
    await vi.advanceTimersByTimeAsync(0);
    expect(runs.map((run) => run.input)).toEqual([1, 2]);
  });

  it("starts at once for a key: held and let go in one moment", async () => {
    const { task, runs } = watched_task(10);
    task.submit(1, "patient");
    task.hurry();
    await vi.advanceTimersByTimeAsync(0);
    expect(runs.map((run) => run.input)).toEqual([1]);
  });

  it("keeps showing something while a key repeats", async () => {
    const { task, runs } = watched_task(100);
    for (let input = 0; input < 30; ++input) {
      task.submit(input, "patient");
      task.hurry();
      await vi.advanceTimersByTimeAsync(33);
    }
    // At once, then as often as patience lasts: 120 ms, in steps of the key.
    expect(runs.length).toBeGreaterThan(5);
    expect(runs.length).toBeLessThan(11);
    expect(runs.filter((run) => !run.signal.aborted).length).toBeGreaterThan(5);
  });

  it("keeps to its pace while a hand holds what changes, and hurries when it lets go", async () => {
    const started_ms: number[] = [];
    const task = new LatestTask<number>(
      async () => void started_ms.push(performance.now()),
      { rest_ms: 40, patience_ms: 120, held_ms: 50 },
    );
    const begun_ms = performance.now();
    for (let input = 0; input < 50; ++input) {
      task.submit(input, "patient");
      await vi.advanceTimersByTimeAsync(16);
    }
    expect(started_ms.length).toBeGreaterThan(10); // of 800 ms, one in 50 to 66
    expect(started_ms.length).toBeLessThanOrEqual(16);
    expect((started_ms[0] ?? 0) - begun_ms).toBeGreaterThanOrEqual(50);
    await vi.advanceTimersByTimeAsync(500);
    const before = started_ms.length;
    task.submit(99, "patient");
    task.hurry();
    await vi.advanceTimersByTimeAsync(0);
    expect(started_ms.length).toBe(before + 1);
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

  it("leaves a run alone whose input a start that waited has taken", async () => {
    const { task, runs } = watched_task(1000, 300);
    task.submit(1, "patient");
    await vi.advanceTimersByTimeAsync(250);
    task.submit(2, "patient"); // waits for the first result, at 300 ms
    await vi.advanceTimersByTimeAsync(40);
    task.submit(3); // rests until 330 ms
    await vi.advanceTimersByTimeAsync(200);
    expect(runs.map((run) => run.input)).toEqual([1, 3]);
    expect(runs.map((run) => run.signal.aborted)).toEqual([true, false]);
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

  it("lets a run come to its first result while a slider is held", async () => {
    const { task, runs, seen } = watched_task(1000, 300);
    for (let input = 0; input < 100; ++input) {
      task.submit(input, "patient");
      await vi.advanceTimersByTimeAsync(10);
    }
    expect(runs.length).toBe(4); // after 40 ms the first, then one every 300 ms
    expect(runs.map((run) => run.signal.aborted)).toEqual([true, true, true, false]);
    await vi.advanceTimersByTimeAsync(2000);
    expect(runs.at(-1)?.input).toBe(99);
    expect(seen.most_at_work).toBe(1);
  });

  it("aborts at once for an urgent input, also while a patient one waits", async () => {
    const { task, runs } = watched_task(1000, 300);
    task.submit(1);
    await vi.advanceTimersByTimeAsync(100);
    task.submit(2, "patient");
    await vi.advanceTimersByTimeAsync(100);
    expect(runs.map((run) => run.signal.aborted)).toEqual([false]);
    task.submit(3);
    await vi.advanceTimersByTimeAsync(40);
    task.submit(4, "patient");
    await vi.advanceTimersByTimeAsync(100);
    task.hurry();
    await vi.advanceTimersByTimeAsync(40);
    expect(runs.map((run) => [run.input, run.signal.aborted])).toEqual([
      [1, true],
      [3, true],
      [4, false],
    ]);
    task.hurry(); // nothing waits: the run goes on
    await vi.advanceTimersByTimeAsync(40);
    expect(runs.at(-1)?.signal.aborted).toBe(false);
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
