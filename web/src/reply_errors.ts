/// Why a call has no answer.
import type { Problem } from "./contract.ts";

/// The server refuses the request or fails at it, and says why.
export class RefusedError extends Error {
  constructor(
    readonly status: number,
    readonly problem: Problem,
  ) {
    super(problem.detail ?? problem.title ?? `The server answered with status ${status}.`);
  }
}

/// The server has no room now and names the time after which it may.
export class BusyError extends Error {
  constructor(readonly retry_after_ms: number) {
    super("The server is busy.");
  }
}

/// No answer came: the server is away or the connection broke.
export class UnreachableError extends Error {
  constructor(cause: unknown) {
    super("The fstop server does not answer.", { cause });
  }
}
