// How soon a picture follows the hand: first pictures after single changes, and a drag of ten
// seconds with its trace. Prints what it measures; asserts nothing.
//   node page_bench.mjs FOLDER [scene ...]
import { mkdir, readFile, writeFile } from "node:fs/promises";
import { cpus, loadavg } from "node:os";
import { join } from "node:path";
import { setTimeout as sleep } from "node:timers/promises";
import { start_browser, start_server } from "./served_page.mjs";

const kChanges = 40;
const kPause_ms = 400; // a change comes while the picture of the last is being refined
const kOpening_ms = 120_000;
const kSettling_ms = 3000;
const kDrag_ms = 10_000;
const kSweep_ms = 3000; // there and back
const kMove_ms = 16; // a mouse's pace, as pages hear of it
const kLongTask_ms = 50;
const kFrame_ms = 1000 / 60;

const [folder = "build/bench/page", ...wanted] = process.argv.slice(2);
const scenes = wanted.length > 0 ? wanted : ["still-life", "spheres", "charts"];

function quantile(values, share) {
  const sorted = [...values].sort((a, b) => a - b);
  return sorted[Math.min(Math.floor(share * sorted.length), sorted.length - 1)] ?? Number.NaN;
}

function summary(values) {
  const at = (share) => `${quantile(values, share).toFixed(0)} ms`;
  return `median ${at(0.5)}, 90 % ${at(0.9)}, worst ${at(1)}, n = ${values.length}`;
}

/// Runs in the page: notes when inputs come, when pictures are painted, frames and long tasks.
function watch() {
  const seen = { inputs: [], paints: [], frames: [], long: [], requests: [] };
  globalThis.seen = seen;
  const note = (event) => seen.inputs.push(event.timeStamp);
  for (const type of ["keydown", "pointermove"]) addEventListener(type, note, { capture: true });
  const stage = document
    .querySelector("fstop-app")
    .shadowRoot.querySelector("fstop-picture")
    .shadowRoot.querySelector("fstop-stage").shadowRoot;
  let shown;
  const look = () => {
    const picture = stage.querySelector("canvas.picture") ?? stage.querySelector("img");
    const key = picture?.dataset?.shown ?? picture?.src;
    if (key !== undefined && key !== shown) {
      shown = key;
      const painted = () =>
        requestAnimationFrame(() => {
          const { port1, port2 } = new MessageChannel();
          port1.onmessage = () =>
            seen.paints.push({
              at: performance.now(),
              width: picture.naturalWidth ?? picture.width,
            });
          port2.postMessage(0);
        });
      if (picture.decode) void picture.decode().then(painted, () => undefined);
      else painted();
    }
  };
  new MutationObserver(look).observe(stage, { attributes: true, childList: true, subtree: true });
  look();
  const frame = (at) => {
    seen.frames.push(at);
    requestAnimationFrame(frame);
  };
  requestAnimationFrame(frame);
  new PerformanceObserver((list) => {
    for (const { startTime, duration } of list.getEntries()) seen.long.push([startTime, duration]);
  }).observe({ type: "longtask" });
}

const forget = () => {
  for (const list of Object.values(globalThis.seen)) list.length = 0;
};

async function opened(browser, server, scene) {
  const page = await browser.newPage({ viewport: { width: 1280, height: 900 } });
  await page.goto(
    `${server.url}#scene=${scene}&camera=lens&focal_length_mm=50&f_number=2&focus_distance_m=2&max_error=0.01`,
  );
  await page.locator("fstop-picture img").first().waitFor({ timeout: kOpening_ms });
  await page.waitForTimeout(kSettling_ms);
  await page.evaluate(watch);
  return page;
}

/// Milliseconds from each key to the first picture of it on the screen.
async function first_pictures(page) {
  const slider = page.getByRole("slider", { name: /Focus distance, from near/ });
  await slider.focus();
  const waits = [];
  for (let i = 0; i < kChanges; ++i) {
    await page.evaluate(forget);
    await page.keyboard.press(i % 20 < 10 ? "ArrowRight" : "ArrowLeft");
    await page.waitForFunction(() => globalThis.seen.paints.length > 0, undefined, { timeout: 20_000 });
    const { inputs, paints } = await page.evaluate(() => globalThis.seen);
    waits.push({ wait: paints[0].at - inputs[0], width: paints[0].width });
    await page.waitForTimeout(kPause_ms + 13 * (i % 7));
  }
  return waits;
}

/// Moves the focus slider for ten seconds and records a trace of it.
async function drag(browser, page, file) {
  const box = await page.getByRole("slider", { name: /Focus distance, from near/ }).boundingBox();
  const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
  await page.mouse.move(x, y);
  await page.mouse.down();
  await browser.startTracing(page, {
    path: file,
    categories: ["devtools.timeline", "disabled-by-default-devtools.timeline", "toplevel", "cc"],
  });
  await page.evaluate(forget);
  const start_ms = Date.now();
  // A hand does not wait for the page: moves come at a steady pace, to and fro.
  const moves = [];
  for (let at_ms = 0; at_ms < kDrag_ms; at_ms = Date.now() - start_ms) {
    const turns = at_ms / kSweep_ms;
    const share = 2 * Math.abs(turns - Math.floor(turns + 0.5)); // 0 to 1 to 0
    moves.push(page.mouse.move(x + 0.6 * box.width * (share - 0.5), y));
    await sleep(kMove_ms);
  }
  await Promise.all(moves);
  const seconds = (Date.now() - start_ms) / 1000;
  const seen = await page.evaluate(() => globalThis.seen);
  await browser.stopTracing();
  await page.mouse.up();
  return { ...seen, seconds };
}

/// Tasks of the page's main thread from the trace: what they took, and of it on a processor; the
/// rest they waited for one, where other programs run.
async function tasks_of(file) {
  const { traceEvents: events } = JSON.parse(await readFile(file, "utf8"));
  const threads = new Set(
    events
      .filter(({ name, args }) => name === "thread_name" && args.name === "CrRendererMain")
      .map(({ pid, tid }) => `${pid} ${tid}`),
  );
  return events
    .filter(({ name, pid, tid }) => name === "RunTask" && threads.has(`${pid} ${tid}`))
    .map(({ dur = 0, tdur = 0 }) => ({ ms: dur / 1000, cpu_ms: tdur / 1000 }));
}

function dropped(frames) {
  let missed = 0;
  for (let i = 1; i < frames.length; ++i)
    missed += Math.max(Math.round((frames[i] - frames[i - 1]) / kFrame_ms) - 1, 0);
  return missed;
}

await mkdir(folder, { recursive: true });
const server = await start_server();
const browser = await start_browser();
try {
  console.log(`${cpus().length} processors, load ${loadavg()[0].toFixed(1)} at the start`);
  const rows = [];
  for (const scene of scenes) {
    const page = await opened(browser, server, scene);
    const waits = await first_pictures(page);
    const widths = [...new Set(waits.map(({ width }) => width))].join(", ");
    console.log(`${scene}: key to first picture, ${widths} px wide: ${summary(waits.map((w) => w.wait))}`);
    const file = join(folder, `drag-${scene}.json`);
    const { paints, frames, long, seconds } = await drag(browser, page, file);
    const intervals = paints.slice(1).map(({ at }, i) => at - paints[i].at);
    const tasks = await tasks_of(file);
    const long_by = (key) => tasks.filter((task) => task[key] > kLongTask_ms).length;
    const worst_by = (key) => Math.max(...tasks.map((task) => task[key])).toFixed(0);
    const rate = paints.length / seconds;
    const drag_widths = [...new Set(paints.map(({ width }) => width))].join(", ");
    console.log(
      `${scene}: ${seconds.toFixed(1)} s of dragging: ${rate.toFixed(1)} pictures a second, ` +
        `${drag_widths} px wide; between them ${summary(intervals)}; ` +
        `${dropped(frames)} of ${Math.round(seconds * 60)} frames dropped; ` +
        `tasks over ${kLongTask_ms} ms: ${long_by("ms")} by the clock (worst ${worst_by("ms")} ms; ` +
        `${long.length} by the page), ${long_by("cpu_ms")} by processor time ` +
        `(worst ${worst_by("cpu_ms")} ms); load ${loadavg()[0].toFixed(1)}`,
    );
    rows.push({ scene, waits, rate, load: loadavg()[0] });
    await page.close();
  }
  await writeFile(join(folder, "page.json"), `${JSON.stringify(rows, undefined, 2)}\n`);
} finally {
  await browser.close();
  await server.stop();
}
