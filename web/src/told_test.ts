import { describe, expect, it } from "vitest";
import { told } from "./told.ts";

const rest = (): Promise<void> => new Promise((resolve) => setTimeout(resolve, 1));

describe("what a task tells", () => {
  it("comes in order, newest only where the reader is slow, then the answer", async () => {
    const seen: number[] = [];
    const task = told<number, string>(async (tell) => {
      tell(1);
      await rest();
      tell(2);
      tell(3);
      await rest();
      return "done";
    });
    for (;;) {
      const { done, value } = await task.next();
      if (done) {
        expect(value).toBe("done");
        break;
      }
      seen.push(value);
    }
    expect(seen).toEqual([1, 3]);
  });

  it("passes the error on", async () => {
    const task = told<number, string>(() => Promise.reject(new Error("broken")));
    await expect(task.next()).rejects.toThrow("broken");
  });
});
