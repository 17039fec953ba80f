// The side view and the picture as things to point at.
import assert from "node:assert/strict";
import { describe, it } from "node:test";
import { choose, eventually, finished, is_render, kDraft, kPicture_ms, mean_difference } from "./harness.mjs";
import { open, optics_number, pixels_of, press, rgb_at, use_page } from "./harness.mjs";

const kCssPxPerMm = 96 / 25.4;
const kCharts = "#scene=charts&camera=lens&focal_length_mm=50&f_number=2&focus_distance_m=2&max_error=0.03";
// In the picture of the charts from the origin: the middle of the star of the card at 3 m.
const kStarAt3m = [58 / 480, 75 / 320];

/// c = A v |1/s - 1/d| in mm, of a lens in mm focused at s, a point at d.
function blur_mm(f, n, s, d) {
  const v = 1 / (1 / f - 1 / s);
  return (f / n) * v * Math.abs(1 / s - 1 / d);
}

async function drag(page, from, to, steps = 8) {
  await page.mouse.move(from.x, from.y);
  await page.mouse.down();
  await page.mouse.move(to.x, to.y, { steps });
  await page.mouse.up();
}

async function middle(locator) {
  await locator.scrollIntoViewIfNeeded();
  const box = await locator.boundingBox();
  return { x: box.x + box.width / 2, y: box.y + box.height / 2 };
}

describe("side view", { timeout: 600_000 }, () => {
  const shared = use_page();
  const handle = (part) => shared.page.locator(`fstop-side-view .handle.${part} .hit`);
  const slider = (name) => shared.page.getByRole("slider", { name });

  /// Drags the focused plane onto the subject, which is at 1 m; where the focus is then.
  async function focus_dragged_to_subject() {
    const { page } = shared;
    const plane = await middle(handle("focus"));
    const subject = await middle(handle("subject"));
    await drag(page, plane, { x: subject.x, y: plane.y });
    const focus_m = await eventually(
      async () => Number(await page.getByRole("textbox", { name: /Focus distance/ }).inputValue()),
      (value) => value < 1.9,
    );
    assert.ok(Math.abs(focus_m - 1) < 0.02, `${focus_m} m`);
    return focus_m;
  }

  it("draws the blur disc on the sensor to the scale that it states", async () => {
    const { page } = shared;
    await open(shared, kDraft);
    const figure = page.locator("fstop-blur-on-sensor figure");
    const shown_mm = async () => {
      const magnification = Number(await figure.getAttribute("data-magnification"));
      const { width } = await figure.locator("circle.disc").boundingBox();
      return (width - 1) / kCssPxPerMm / magnification; // less the stroke
    };
    const wanted_mm = blur_mm(50, Math.SQRT2, 2000, 1000);
    assert.ok(Math.abs((await shown_mm()) / wanted_mm - 1) < 0.02, `${await shown_mm()} mm`);
    assert.match(await figure.innerText(), /On the sensor, 20 : 1/);
    // The rays of the subject meet the sensor as far apart as the disc is wide, in its own scale.
    const [px_per_mm, spread_px] = await page.locator("fstop-side-view").evaluate((host) => {
      const ends = [...host.shadowRoot.querySelectorAll(".ray:not(.beyond)")].map((ray) =>
        Number(ray.getAttribute("d").split(" ").at(-1)),
      );
      const sensor = host.shadowRoot.querySelector(".sensor");
      const tall_px = sensor.getAttribute("y2") - sensor.getAttribute("y1");
      return [tall_px / 24, Math.abs(ends[0] - ends[1])];
    });
    assert.ok(Math.abs(spread_px / px_per_mm / wanted_mm - 1) < 1e-3, `${spread_px / px_per_mm} mm`);
  });

  it("draws what counts as sharp from its near to its far limit", async () => {
    const { page } = shared;
    await open(shared, kDraft.replace("1.4", "8"));
    const [band, one, ten] = await page.locator("fstop-side-view").evaluate((host) => {
      const bench = host.shadowRoot;
      const tick = (text) =>
        Number([...bench.querySelectorAll(".tick")].find((t) => t.textContent === text).getAttribute("x"));
      const rect = bench.querySelector(".sharp");
      const left = Number(rect.getAttribute("x"));
      return [[left, left + Number(rect.getAttribute("width"))], tick("1"), tick("10")];
    });
    const at_m = (x) => 10 ** ((x - one) / (ten - one));
    // 1/u = 1/s +- c/(A v), c the sensor's diagonal / 1442.
    const c_mm = Math.hypot(36, 24) / 1442;
    const by = c_mm / ((50 / 8) * (1 / (1 / 50 - 1 / 2000)));
    const [far_m, near_m] = [-1, 1].map((side) => 1e-3 / (1 / 2000 + side * by));
    assert.ok(Math.abs(at_m(band[0]) / far_m - 1) < 2e-3, `${at_m(band[0])}, ${far_m}`);
    assert.ok(Math.abs(at_m(band[1]) / near_m - 1) < 2e-3, `${at_m(band[1])}, ${near_m}`);
  });

  it("moves the focus when its plane is dragged, and its plane when the focus moves", async () => {
    const { page } = shared;
    await open(shared, kDraft);
    const before = await pixels_of(await finished(page, "focused at 2 m"));
    const focus_m = await focus_dragged_to_subject();
    const after = await pixels_of(await finished(page, `focused at ${focus_m} m`));
    assert.ok(mean_difference(before, after) > 1);
    // The subject is in focus now: its disc is gone.
    assert.match(await page.locator(".summary").innerText(), /disc (0|< 0\.001|0\.\d+)\s*px/);

    const x_before = (await middle(handle("focus"))).x;
    await slider(/Focus distance, from near/).focus();
    await press(page, "ArrowRight", 10);
    await eventually(
      async () => (await handle("focus").boundingBox()).x,
      (x) => x < x_before - 20, // farther is to the left
    );
    // By key too: the handle is a slider.
    await page.locator("fstop-side-view .handle.focus").focus();
    await press(page, "PageDown", 1);
    await eventually(
      async () => page.locator("fstop-side-view .handle.focus").getAttribute("aria-valuenow"),
      (now) => Number(now) === 45, // 40 steps to 1 m, 10 farther, 5 back
    );
  });

  it("follows the hand where the page is larger, on a 4K screen", async () => {
    const { page } = shared;
    await page.setViewportSize({ width: 3840, height: 2160 });
    await open(shared, kDraft);
    await focus_dragged_to_subject();
    // What is behind the lens is drawn to the scale that is told.
    const text = await page.locator("fstop-side-view .note").innerText();
    const [, times] = /Behind the lens ([\d.]+) : 1/.exec(text);
    const tall_px = await page.locator("fstop-side-view line.sensor").evaluate((line) => {
      const units = line.getAttribute("y2") - line.getAttribute("y1");
      return units * line.getScreenCTM().a; // without the stroke
    });
    assert.ok(Math.abs(tall_px / kCssPxPerMm / (24 * times) - 1) < 1e-3, `${tall_px} px, ${times}`);
  });

  it("opens and closes the aperture by its edge", async () => {
    const { page } = shared;
    await open(shared, kDraft);
    const before = await pixels_of(await finished(page, "f/1.4"));
    await page.locator("fstop-side-view .note").scrollIntoViewIfNeeded();
    const edge = await middle(handle("aperture"));
    const axis = await middle(handle("subject"));
    await drag(page, edge, { x: edge.x, y: axis.y - 0.4 * (axis.y - edge.y) });
    // The address has what the hand settled for, not what it passed.
    const closed = await eventually(
      async () => Number(/[#&]f_number=([\d.]+)/.exec(page.url())?.[1] ?? 1.4),
      (f_number) => f_number !== 1.4,
    );
    assert.ok(closed > 2 && closed < 64, `${closed}`);
    const label = page.locator("fstop-side-view .handle.aperture");
    await eventually(
      () => label.getAttribute("aria-valuetext"),
      (text) => text === `f/${closed}`,
    );
    const after = await pixels_of(await finished(page, `f/${closed}`));
    assert.ok(mean_difference(before, after) > 0.5);
  });

  it("moves the camera when the subject is dragged", async () => {
    const { page } = shared;
    await open(shared, kDraft);
    const before = await pixels_of(await finished(page));
    const subject = await middle(handle("subject"));
    const render = page.waitForRequest(
      (request) => is_render(request) && request.postDataJSON().camera.position_m !== undefined,
    );
    await drag(page, subject, { x: subject.x - 25, y: subject.y });
    const { position_m, look_at_m } = (await render).postDataJSON().camera;
    assert.ok(position_m[2] > 0 && look_at_m[2] === position_m[2] - 1, `${position_m}`);
    await page.waitForTimeout(300);
    const after = await pixels_of(await finished(page));
    assert.ok(mean_difference(before, after) > 3);
  });
});

describe("picture", { timeout: 600_000 }, () => {
  const shared = use_page();

  it("focuses where it is clicked, by the server's depth", async () => {
    const { page } = shared;
    await open(shared, kCharts);
    const touch = page.locator("fstop-stage .touch");
    const { width, height } = await touch.boundingBox();
    const [x, y] = kStarAt3m;
    await touch.click({ position: { x: x * width, y: y * height } });
    const focus = page.getByRole("textbox", { name: /Focus distance/ });
    const focus_m = await eventually(async () => Number(await focus.inputValue()), (m) => m > 2.1);
    assert.ok(Math.abs(focus_m - 3) < 0.003, `${focus_m} m`); // cards stand to a millimetre
    const near_m = await eventually(() => optics_number(page, "Sharp from"), (m) => m > 2.2);
    assert.ok(near_m < 3 && (await optics_number(page, "Sharp to")) > 3);
    await finished(page, `focused at ${focus_m} m`);
    assert.match(await page.locator("#reading").innerText(), /depth 3(\.0\d*)?\s*m, blur (0|< 0\.001)/);
  });

  it("focuses by key alone, at the cross that arrows move", async () => {
    const { page } = shared;
    await open(shared, kCharts);
    const touch = page.locator("fstop-stage .touch");
    await touch.focus();
    await press(page, "Shift+ArrowLeft", 4); // to a tenth of the width from the left
    await press(page, "ArrowRight", 2);
    await press(page, "Shift+ArrowUp", 2);
    await press(page, "ArrowUp", 6); // and about a quarter down
    assert.match(await page.locator("#reading").innerText(), /depth 3(\.0\d*)?\s*m/);
    assert.equal(await page.locator("#reading").getAttribute("aria-live"), "polite");
    await press(page, "Enter");
    const focus = page.getByRole("textbox", { name: /Focus distance/ });
    const focus_m = await eventually(async () => Number(await focus.inputValue()), (m) => m > 2.1);
    assert.ok(Math.abs(focus_m - 3) < 0.003, `${focus_m} m`);
  });

  it("tells depth, blur and values under the pointer, and magnifies them", async () => {
    const { page } = shared;
    await open(shared, kCharts);
    const picture = await pixels_of(await finished(page));
    const touch = page.locator("fstop-stage .touch");
    await choose(page, "4:1");
    const { x, y, width, height } = await touch.boundingBox();
    const at = [0.253, 0.23]; // the bright square of the card at 3 m
    await page.mouse.move(x + at[0] * width, y + at[1] * height);
    const reading = await eventually(
      () => page.locator("#reading").innerText(),
      (text) => /sRGB/.test(text),
    );
    const [, px, py, depth, blur, rgb] =
      /x (\d+), y (\d+): depth ([\d.]+)\s*m, blur ([\d.]+)\s*px.*sRGB ([\d ]+)/.exec(reading);
    assert.ok(Math.abs(px - at[0] * 960) <= 2 && Math.abs(py - at[1] * 640) <= 2, reading);
    assert.ok(Math.abs(depth - 3) < 0.003, reading);
    const wanted_px = (blur_mm(50, 2, 2000, 3000) / 36) * 960;
    assert.ok(Math.abs(blur / wanted_px - 1) < 0.01, `${blur} of ${wanted_px}`);
    const place = [(Number(px) + 0.5) / 960, (Number(py) + 0.5) / 640];
    assert.deepEqual(rgb.split(" ").map(Number), rgb_at(picture, ...place));
    // The loupe shows four pixels of the page for one of the picture: the same values again.
    const loupe = await pixels_of(page.locator("fstop-stage .loupe"));
    const near = rgb_at(loupe, 0.5, 0.5).map((value, i) => value - rgb_at(picture, ...place)[i]);
    assert.ok(Math.max(...near.map(Math.abs)) < 40, `${near}`);
    assert.deepEqual([loupe.width, loupe.height], [176, 176]);
  });

  it("maps blur in colour: near, sharp and far", async () => {
    const { page } = shared;
    await open(shared, kCharts);
    await page.getByRole("checkbox", { name: "Blur map" }).check();
    const map = page.locator("fstop-stage canvas.overlay");
    await map.waitFor();
    const colours = await pixels_of(map);
    const dominant = (at) => rgb_at(colours, ...at).indexOf(Math.max(...rgb_at(colours, ...at)));
    assert.equal(dominant([58 / 480, 235 / 320]), 0, "card at 1 m: near, orange");
    assert.equal(dominant([430 / 480, 225 / 320]), 1, "card at 2 m: sharp, green");
    assert.equal(dominant([430 / 480, 75 / 320]), 2, "card at 7 m: far, blue");
  });

  it("comes quickly, then sharpens to the error that was asked for, one render at a time", async (t) => {
    const { page, server } = shared;
    const replies = [];
    const under_way = new Set();
    let most = 0;
    page.on("request", (request) => {
      if (is_render(request)) most = Math.max(most, under_way.add(request).size);
    });
    const end = (request) => under_way.delete(request);
    page.on("requestfinished", end);
    page.on("requestfailed", end);
    page.on("response", (reply) => {
      if (is_render(reply.request())) replies.push(reply);
    });
    await page.goto(server.url + kDraft.replace("0.03", "0.02"));
    await finished(page);
    const widths = replies.map((reply) => reply.request().postDataJSON().image.width);
    assert.deepEqual(widths, [642, 642, 960]);
    const caption = await page.locator("fstop-picture figcaption").innerText();
    const told = /below\s*([\d.]+)\s*at 95/.exec(caption);
    assert.ok(Number(told[1]) <= 0.02, caption);
    assert.match(caption, /method.*error.*below.*95 %.*rendered/s);

    // Hold the focus slider and move it for three seconds.
    const from = replies.length;
    const thumb = page.getByRole("slider", { name: /Focus distance, from near/ });
    await thumb.scrollIntoViewIfNeeded();
    const box = await thumb.boundingBox();
    const updates = await page.evaluate(() => {
      const stage = document
        .querySelector("fstop-app")
        .shadowRoot.querySelector("fstop-picture")
        .shadowRoot.querySelector("fstop-stage");
      globalThis.updates = 0;
      new MutationObserver(() => ++globalThis.updates).observe(stage.shadowRoot, {
        attributes: true,
        attributeFilter: ["src"],
        subtree: true,
      });
      return globalThis.updates;
    });
    assert.equal(updates, 0);
    await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
    await page.mouse.down();
    const start_ms = Date.now();
    for (let i = 0; Date.now() - start_ms < 3000; ++i) {
      await page.mouse.move(
        box.x + box.width * (0.5 + 0.3 * Math.sin(i / 8)),
        box.y + box.height / 2,
      );
      await page.waitForTimeout(15);
    }
    const seconds = (Date.now() - start_ms) / 1000;
    const seen = await page.evaluate(() => globalThis.updates);
    await page.mouse.up();
    t.diagnostic(
      `${(seen / seconds).toFixed(1)} picture updates per second while dragging, ` +
        `${replies.length - from} replies`,
    );
    assert.ok(seen >= 3, `only ${seen} updates`);
    assert.ok(most <= 2, `${most} renders at once`); // one, and one that is being given up
    await finished(page);
    assert.deepEqual(shared.complaints, []);
    assert.deepEqual(shared.foreign, []);
  });
});
