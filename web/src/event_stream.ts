/// Server-sent events of a reply's body, as they come.
export interface ServerEvent {
  event: string;
  data: string;
  id: string; // the newest that was told
}

/// Lines end with LF or CRLF; comments and members other than `event`, `data` and `id` are passed over.
export async function* events_of(
  body: ReadableStream<Uint8Array<ArrayBuffer>>,
): AsyncGenerator<ServerEvent, void> {
  const reader = body.pipeThrough(new TextDecoderStream()).getReader();
  let rest = "";
  let next: ServerEvent = { event: "message", data: "", id: "" };
  try {
    for (;;) {
      const { value, done } = await reader.read();
      if (done) return;
      const lines = (rest + value).split(/\r?\n/);
      rest = lines.pop() ?? "";
      for (const line of lines) {
        const [, name, text] = /^([^:]*):? ?(.*)$/.exec(line) ?? [];
        if (line === "") {
          if (next.data !== "") yield next;
          next = { event: "message", data: "", id: next.id };
        } else if (name === "event") next.event = text ?? "";
        else if (name === "id") next.id = text ?? "";
        else if (name === "data") next.data += (next.data === "" ? "" : "\n") + (text ?? "");
      }
    }
  } finally {
    // Not waited for: who gives a stream up goes on at once.
    void reader.cancel().catch(() => undefined);
  }
}
