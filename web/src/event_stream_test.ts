import { describe, expect, it } from "vitest";
import { events_of } from "./event_stream.ts";
import type { ServerEvent } from "./event_stream.ts";

function body_of(...parts: string[]): ReadableStream<Uint8Array<ArrayBuffer>> {
  return new ReadableStream({
    start: (to) => {
      for (const part of parts) to.enqueue(new TextEncoder().encode(part));
      to.close();
    },
  });
}

describe("events of a stream", () => {
  it("come whole, wherever the parts are cut", async () => {
    const seen: ServerEvent[] = [];
    const body = body_of('id: 7\nevent: progress\nda', 'ta: {"progress":0.5}\r\n\r\n: note\ndata: a\nda', "ta: b\n\ndata: cut off");
    for await (const event of events_of(body)) seen.push(event);
    expect(seen).toEqual([
      { event: "progress", data: '{"progress":0.5}', id: "7" },
      { event: "message", data: "a\nb", id: "7" },
    ]);
  });
});
