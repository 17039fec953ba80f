// The playground in a browser, against the server that FSTOP_BINARY names.
import assert from "node:assert/strict";
import { after, afterEach, before, beforeEach, describe, it } from "node:test";
import { start_browser, start_server } from "./served_page.mjs";

const kPicture_ms = 120_000;
const kAnswer_ms = 30_000;
// A draft is enough to see a difference, and quick on a busy machine.
const kDraft = "#camera=lens&focal_length_mm=50&f_number=1.4&focus_distance_m=2&max_error=0.03";

let server;
let browser;
let page;
let complaints; // what the console and uncaught errors say

before(async () => {
  server = await start_server();
  browser = await start_browser();
});
after(async () => {
  await browser?.close();
  await server?.stop();
});
beforeEach(async () => {
  page = await browser.newPage({ viewport: { width: 1280, height: 800 } });
  page.setDefaultTimeout(kAnswer_ms);
  complaints = [];
  page.on("pageerror", (error) => complaints.push(String(error)));
  page.on("console", (message) => {
    if (["error", "warning"].includes(message.type()))
      complaints.push(`${message.text()} ${message.location().url}`);
  });
});
afterEach(() => page?.close());

function is_render(request) {
  return request.method() === "POST" && new URL(request.url()).pathname === "/v1/renders";
}

/// Waits for the finished picture of the f-number with this label and gives its pixels.
async function picture_at(label) {
  const picture = page.locator(`fstop-picture .frame[aria-busy="false"] img[alt*="f/${label},"]`);
  const message = page.locator("fstop-picture .messages .fault");
  await picture.or(message).first().waitFor({ timeout: kPicture_ms });
  assert.deepEqual(await message.allInnerTexts(), []);
  const { width, height, base64 } = await picture.evaluate(async (image) => {
    await image.decode();
    const canvas = new OffscreenCanvas(image.naturalWidth, image.naturalHeight);
    const context = canvas.getContext("2d");
    context.drawImage(image, 0, 0);
    const { width, height, data } = context.getImageData(0, 0, canvas.width, canvas.height);
    const url = await new Promise((resolve) => {
      const reader = new FileReader();
      reader.onload = () => resolve(reader.result);
      reader.readAsDataURL(new Blob([data]));
    });
    return { width, height, base64: url.slice(url.indexOf(",") + 1) };
  });
  return { width, height, bytes: Buffer.from(base64, "base64") };
}

function mean_difference(a, b) {
  assert.equal(a.bytes.length, b.bytes.length);
  let sum = 0;
  for (let i = 0; i < a.bytes.length; ++i) sum += Math.abs(a.bytes[i] - b.bytes[i]);
  return sum / a.bytes.length;
}

async function press(key, times) {
  for (let i = 0; i < times; ++i) await page.keyboard.press(key);
}

function optics_number(name) {
  return page.locator("fstop-optics dl > div", { hasText: name }).locator("dd").innerText();
}

describe("playground", { timeout: 600_000 }, () => {
  it("changes picture and numbers with the f-stop and keeps them in the address", async () => {
    await page.goto(server.url + kDraft);
    const open = await picture_at("1.4");
    assert.deepEqual([open.width, open.height], [960, 640]);
    // H = f + f^2/(N c): f = 50 mm, N = sqrt(2), c = sensor diagonal / 1442.
    const hyperfocal_m = (f_number) =>
      0.05 + 0.05 ** 2 / ((f_number * Math.hypot(0.036, 0.024)) / 1442);
    const shown_m = async () => Number.parseFloat(await optics_number("Hyperfocal distance"));
    assert.ok(Math.abs((await shown_m()) / hyperfocal_m(Math.SQRT2) - 1) < 1e-3);

    await page.getByRole("slider", { name: /Aperture, f-number/ }).focus();
    await press("ArrowRight", 15); // five stops
    const closed = await picture_at("8");
    assert.ok(mean_difference(open, closed) > 0.5, `only ${mean_difference(open, closed)} of 255`);
    assert.ok(Math.abs((await shown_m()) / hyperfocal_m(8) - 1) < 1e-3);
    assert.match(
      await page.locator("fstop-picture figcaption").innerText(),
      /error.*95 %.*rendered/s,
    );
    await page.getByRole("tab", { name: "How it was made" }).click();
    await page.locator("fstop-report li").first().waitFor();

    await page.reload();
    assert.equal(mean_difference(closed, await picture_at("8")), 0);
    await page.goBack();
    assert.equal(mean_difference(open, await picture_at("1.4")), 0);
    await page.goForward();
    assert.equal(mean_difference(closed, await picture_at("8")), 0);
    assert.deepEqual(complaints, []);
  });

  it("cancels the stale request", async () => {
    const refinement = page.waitForRequest(
      (request) => is_render(request) && request.postDataJSON().image.width === 960,
      { timeout: kPicture_ms },
    );
    await page.goto(server.url + kDraft.replace("0.03", "0.002"));
    const stale = await refinement;
    // Given up as a reply that is still to come, or, where the server made it a job, withdrawn.
    const given_up = Promise.race([
      page.waitForEvent("requestfailed", { predicate: (request) => request === stale }),
      page.waitForRequest((request) => request.method() === "DELETE"),
    ]);
    await page.getByRole("slider", { name: /Aperture, f-number/ }).focus();
    await press("ArrowRight", 1);
    await given_up;

    await page.getByRole("radio", { name: "Draft" }).check();
    await picture_at("1.6");
    assert.deepEqual(complaints, []);
  });

  it("shows the server's fault at the field that it names, and recovers", async () => {
    await page.goto(server.url + kDraft);
    await picture_at("1.4");
    assert.deepEqual(complaints, []);

    const refusal = page.waitForResponse(
      (reply) => is_render(reply.request()) && reply.status() === 422,
    );
    const focus = page.getByRole("textbox", { name: /Focus distance/ });
    await focus.fill("0.02"); // inside the focal length
    await focus.press("Enter");
    const { errors } = await (await refusal).json();
    const fault = errors.find(({ pointer }) => pointer === "#/camera/lens/focus_distance_m");
    assert.ok(fault, JSON.stringify(errors));
    const note = page.locator("#focus_distance_m-fault .fault");
    await note.first().waitFor();
    assert.equal(
      await note.first().innerText(),
      fault.detail.replace("focal_length_mm", "focal length"),
    );
    assert.equal(await focus.getAttribute("aria-invalid"), "true");

    await focus.fill("1.5");
    await focus.press("Enter");
    await page.locator('img[alt$="focused at 1.5 m"]').waitFor({ timeout: kPicture_ms });
    assert.equal(await note.count(), 0);
    // Chromium itself logs replies with an error status; nothing else may be there.
    assert.deepEqual(
      complaints.filter((text) => !/status of 422 .*\/v1\//.test(text)),
      [],
    );
  });

  it("shows a pinhole's picture and numbers", async () => {
    await page.goto(server.url + kDraft);
    await page.getByRole("radio", { name: "Pinhole" }).check();
    await page.locator('img[alt$="through a pinhole"]').waitFor({ timeout: kPicture_ms });
    assert.match(await optics_number("Image distance"), /^50\s*mm$/);
    assert.deepEqual(complaints, []);
  });
});
