// A running fstop that serves the built page, and a browser to look at it.
import { spawn } from "node:child_process";
import { mkdtemp, readFile, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { setTimeout as pause } from "node:timers/promises";
import { fileURLToPath } from "node:url";
import { chromium } from "../../web/node_modules/playwright-core/index.mjs";

const kWebRoot =
  process.env.FSTOP_WEB_ROOT ?? fileURLToPath(new URL("../../web/dist", import.meta.url));
const kStart_ms = 30_000;
const kStop_ms = 10_000;
const kChromiumFlags = [
  "--disable-gpu",
  "--disable-quic",
  "--no-first-run",
  "--disable-background-networking",
  "--disable-component-update",
  "--disable-sync",
];

/// Starts `$FSTOP_BINARY serve` on a port of the loopback, 0 for any free one; `stop` ends it and
/// tidies up.
export async function start_server(port = 0) {
  const binary = process.env.FSTOP_BINARY;
  if (!binary) throw new Error("FSTOP_BINARY must name the fstop binary");
  const directory = await mkdtemp(join(tmpdir(), "fstop-page-"));
  const port_file = join(directory, "port");
  const process_ = spawn(
    binary,
    [
      ...["serve", "--port", String(port), "--port-file", port_file, "--web-root", kWebRoot],
      ...["--log-file", join(directory, "log")],
    ],
    { stdio: ["ignore", "inherit", "inherit"] },
  );
  const ended = new Promise((resolve) => process_.once("exit", resolve).once("error", resolve));
  const stop = async () => {
    process_.kill("SIGTERM");
    if ((await Promise.race([ended, pause(kStop_ms, "late", { ref: false })])) === "late")
      process_.kill("SIGKILL");
    await ended;
    await rm(directory, { recursive: true, force: true });
  };
  try {
    return { url: await ready_url(port_file, ended), stop };
  } catch (error) {
    await stop();
    throw error;
  }
}

async function ready_url(port_file, ended) {
  const deadline_ms = Date.now() + kStart_ms;
  while (Date.now() < deadline_ms) {
    const port = Number((await readFile(port_file, "utf8").catch(() => "")).trim());
    if (port > 0) {
      const url = `http://127.0.0.1:${port}/`;
      const reply = await fetch(new URL("readyz", url)).catch(() => undefined);
      if (reply?.ok) return url;
    }
    if ((await Promise.race([ended.then(() => "ended"), pause(50)])) === "ended")
      throw new Error("fstop ended before it was ready");
  }
  throw new Error(`fstop was not ready within ${kStart_ms} ms`);
}

/// Debian's chromium without a window; it keeps a fresh profile of its own.
export function start_browser() {
  return chromium.launch({
    executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
    chromiumSandbox: false,
    args: kChromiumFlags,
    timeout: kStart_ms,
  });
}
