// What the tests of the page share: a server, a browser, a page for each test, and its pixels.
import assert from "node:assert/strict";
import { after, afterEach, before, beforeEach } from "node:test";
import { start_browser, start_server } from "./served_page.mjs";

export const kPicture_ms = 60_000;
export const kAnswer_ms = 20_000;
// A draft is enough to see a difference, and quick on a busy machine.
export const kDraft =
  "#scene=still-life&camera=lens&focal_length_mm=50&f_number=1.4&focus_distance_m=2&max_error=0.03";

/// Registers the hooks; the members are there once a test runs.
export function use_page() {
  const shared = { server: undefined, browser: undefined, page: undefined };
  before(async () => {
    shared.server = await start_server();
    shared.browser = await start_browser();
  });
  after(async () => {
    await shared.browser?.close();
    await shared.server?.stop();
  });
  beforeEach(async () => {
    shared.page = await shared.browser.newPage({
      viewport: { width: 1280, height: 900 },
      reducedMotion: "reduce",
      acceptDownloads: true,
    });
    shared.page.setDefaultTimeout(kAnswer_ms);
    shared.complaints = []; // what the console and uncaught errors say
    shared.foreign = []; // what was asked of another host
    shared.page.on("pageerror", (error) => shared.complaints.push(String(error)));
    shared.page.on("console", (message) => {
      if (["error", "warning"].includes(message.type()))
        shared.complaints.push(`${message.text()} ${message.location().url}`);
    });
    shared.page.on("request", (request) => {
      const url = new URL(request.url());
      if (url.protocol !== "blob:" && url.host !== new URL(shared.server.url).host)
        shared.foreign.push(request.url());
    });
  });
  afterEach(() => shared.page?.close());
  return shared;
}

export function is_render(request) {
  return request.method() === "POST" && new URL(request.url()).pathname === "/v1/renders";
}

/// Opens the page at an address and waits for its finished picture.
export async function open({ page, server }, address) {
  await page.goto(server.url + address);
  await finished(page);
}

/// Waits until nothing is rendering; `alt` names the picture where another is still there.
export async function finished(page, alt = "") {
  const shows = alt === "" ? "" : `[alt*="${alt}"]`;
  const picture = page.locator(`fstop-picture .frame[aria-busy="false"] img${shows}`);
  const message = page.locator("fstop-picture .messages .fault");
  await picture.first().or(message.first()).first().waitFor({ timeout: kPicture_ms });
  assert.deepEqual(await message.allInnerTexts(), []);
  return picture.first();
}

/// The pixels of an image of the page: width, height and RGBA bytes.
export async function pixels_of(image) {
  const { width, height, base64 } = await image.evaluate(async (element) => {
    if (element instanceof HTMLImageElement) await element.decode();
    const width = element.naturalWidth || element.width;
    const height = element.naturalHeight || element.height;
    const context = new OffscreenCanvas(width, height).getContext("2d");
    context.drawImage(element, 0, 0);
    const { data } = context.getImageData(0, 0, width, height);
    const url = await new Promise((resolve) => {
      const reader = new FileReader();
      reader.onload = () => resolve(reader.result);
      reader.readAsDataURL(new Blob([data]));
    });
    return { width, height, base64: url.slice(url.indexOf(",") + 1) };
  });
  return { width, height, bytes: Buffer.from(base64, "base64") };
}

/// Mean absolute difference of the colour channels, levels of 255.
export function mean_difference(a, b) {
  assert.equal(a.bytes.length, b.bytes.length);
  let sum = 0;
  for (let i = 0; i < a.bytes.length; ++i) sum += Math.abs(a.bytes[i] - b.bytes[i]);
  return (sum / a.bytes.length / 3) * 4;
}

/// Mean of the linear values of the colour channels, 0 to 1.
export function mean_light({ bytes }) {
  const linear = Array.from({ length: 256 }, (_, level) => {
    const value = level / 255;
    return value <= 0.04045 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4;
  });
  let sum = 0;
  for (let i = 0; i < bytes.length; ++i) if (i % 4 !== 3) sum += linear[bytes[i]];
  return (sum / bytes.length / 3) * 4;
}

export function rgb_at({ width, height, bytes }, x, y) {
  const at = 4 * (Math.floor(y * height) * width + Math.floor(x * width));
  return [...bytes.subarray(at, at + 3)];
}

export async function press(page, key, times = 1) {
  for (let i = 0; i < times; ++i) await page.keyboard.press(key);
}

/// A number of the optics tab by its name.
export async function optics_number(page, name) {
  const text = await page
    .locator("fstop-optics dl > div", { hasText: name })
    .locator("dd")
    .innerText();
  return Number.parseFloat(text.replace("\u2212", "-"));
}

/// Waits until `read` gives something that `accept` takes, and gives it.
export async function eventually(read, accept, timeout_ms = kAnswer_ms) {
  const deadline_ms = Date.now() + timeout_ms;
  let value;
  for (;;) {
    value = await read();
    if (accept(value)) return value;
    if (Date.now() > deadline_ms) assert.fail(`still ${JSON.stringify(value)}`);
    await new Promise((resolve) => setTimeout(resolve, 50));
  }
}

export async function choose(page, name) {
  await page.getByRole("radio", { name, exact: true }).check({ force: true });
}

export async function open_tab(page, name) {
  await page.getByRole("tab", { name }).click();
}
