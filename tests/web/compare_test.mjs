// Two requests, and the settings of the camera as pictures show them.
import assert from "node:assert/strict";
import { describe, it } from "node:test";
import { choose, eventually, finished, kDraft, kPicture_ms, mean_difference, mean_light } from "./harness.mjs";
import { open, open_tab, optics_number, pixels_of, press, use_page } from "./harness.mjs";

const kDim = "#scene=still-life&camera=lens&focal_length_mm=50&focus_distance_m=2&max_error=0.03";
const kB = "&b.scene=still-life&b.camera=lens&b.focal_length_mm=50&b.f_number=8&b.focus_distance_m=2&b.max_error=0.03";

async function picture(page, alt = "") {
  return pixels_of(await finished(page, alt));
}

describe("two requests", { timeout: 600_000 }, () => {
  const shared = use_page();

  it("are in one link, and a wipe shows one on either side", async () => {
    const { page } = shared;
    await open(shared, `${kDraft}${kB}&compare=wipe`);
    const a = await picture(page, "f/1.4");
    const b = await picture(page, "f/8");
    assert.ok(mean_difference(a, b) > 1);
    const other = page.locator("fstop-stage img.other");
    const clip = () => other.evaluate((image) => getComputedStyle(image).clipPath);
    assert.equal(await clip(), "inset(0px 0px 0px 50%)");
    await page.getByRole("slider", { name: /Wipe/ }).focus();
    await press(page, "End");
    await eventually(clip, (text) => text === "inset(0px 0px 0px 100%)");

    // What the screen shows with the line in the middle: left of it A, right of it B, to the pixel.
    const seen = async () => {
      const png = (await page.locator("fstop-stage .frame").screenshot()).toString("base64");
      const [width, height, text] = await page.evaluate(async (base64) => {
        const bytes = Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0));
        const bitmap = await createImageBitmap(new Blob([bytes]));
        const context = new OffscreenCanvas(bitmap.width, bitmap.height).getContext("2d");
        context.drawImage(bitmap, 0, 0);
        const { data } = context.getImageData(0, 0, bitmap.width, bitmap.height);
        let letters = "";
        for (let i = 0; i < data.length; i += 8192)
          letters += String.fromCharCode(...data.subarray(i, i + 8192));
        return [bitmap.width, bitmap.height, btoa(letters)];
      }, png);
      return { width, height, bytes: Buffer.from(text, "base64") };
    };
    // The browser scales images again, and better, once it has time.
    const screen = async () => {
      let last = await seen();
      for (let i = 0; i < 20; ++i) {
        const next = await seen();
        if (next.bytes.equals(last.bytes)) return next;
        last = next;
      }
      return assert.fail("the screen does not come to rest");
    };
    const of_a = await screen();
    await press(page, "Home");
    await eventually(clip, (text) => text === "inset(0px 0px 0px 0%)");
    const of_b = await screen();
    await press(page, "PageUp", 5);
    await eventually(clip, (text) => text === "inset(0px 0px 0px 50%)");
    const both = await screen();
    const part = ({ width, height, bytes }, from, to) => {
      const rows = [];
      // Without the letters above and the handle below.
      for (let y = Math.floor(0.1 * height); y < 0.85 * height; ++y)
        rows.push(bytes.subarray(4 * (y * width + from * width), 4 * (y * width + to * width)));
      return { bytes: Buffer.concat(rows) };
    };
    const halves = [
      [0.05, 0.45],
      [0.55, 0.95],
    ].map(([from, to]) => [
      Math.round(from * both.width) / both.width,
      Math.round(to * both.width) / both.width,
    ]);
    const differ = (one, [from, to]) =>
      mean_difference(part(both, from, to), part(one, from, to));
    assert.equal(differ(of_a, halves[0]), 0);
    assert.equal(differ(of_b, halves[1]), 0);
    assert.ok(differ(of_b, halves[0]) > 1 && differ(of_a, halves[1]) > 1);

    await page.reload();
    assert.equal(mean_difference(b, await picture(page, "f/8")), 0);
    assert.equal(mean_difference(a, await picture(page, "f/1.4")), 0);
  });

  it("are focused each by a click on its own side", async () => {
    const { page } = shared;
    const at = "camera=lens&focal_length_mm=50&f_number=2&focus_distance_m=2&max_error=0.03";
    const b = at.replaceAll("&", "&b.").replace("camera", "b.camera");
    await open(shared, `#scene=charts&${at}&b.scene=charts&${b}`);
    const touch = page.locator("fstop-stage .touch");
    const { width, height } = await touch.boundingBox();
    const parameter = (name) => Number(new URLSearchParams(new URL(page.url()).hash.slice(1)).get(name));
    // The cards at 1 m and at 7 m.
    await touch.click({ position: { x: (120 / 480) * width, y: (225 / 320) * height } });
    await eventually(async () => parameter("focus_distance_m"), (m) => Math.abs(m - 1) < 0.002);
    assert.equal(parameter("b.focus_distance_m"), 2);
    await finished(page, "focused at 1");
    await touch.click({ position: { x: (430 / 480) * width, y: (75 / 320) * height } });
    await eventually(async () => parameter("b.focus_distance_m"), (m) => Math.abs(m - 7) < 0.01);
    assert.ok(Math.abs(parameter("focus_distance_m") - 1) < 0.002);
    assert.ok(await page.getByRole("radio", { name: "B", exact: true }).isChecked());
  });

  it("keep their shapes: B of another sensor stands in A's frame between bars", async () => {
    const { page } = shared;
    await open(shared, `${kDraft}${kB}&b.sensor=phone&compare=wipe`);
    await finished(page, "f/8");
    const other = page.locator("fstop-stage img.other");
    const shape = await other.evaluate((image) => image.naturalWidth / image.naturalHeight);
    assert.equal(shape, 4 / 3);
    const slider = page.getByRole("slider", { name: /Wipe/ });
    await slider.focus();
    await press(page, "Home"); // B everywhere
    // Where the page has the picture, by its own pixels: the middle of its left half is there at a
    // quarter of 8/9 of the frame's width, behind the bar of 1/18.
    const { width, height } = await page.locator("fstop-stage .touch").boundingBox();
    const seen = async (x, y) => {
      const frame = page.locator("fstop-stage .frame");
      const png = (await frame.screenshot()).toString("base64");
      return page.evaluate(
        async ([base64, x, y]) => {
          const bytes = Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0));
          const bitmap = await createImageBitmap(new Blob([bytes]));
          const context = new OffscreenCanvas(bitmap.width, bitmap.height).getContext("2d");
          context.drawImage(bitmap, 0, 0);
          const { data } = context.getImageData(x * bitmap.width, y * bitmap.height, 1, 1);
          return [...data.slice(0, 3)];
        },
        [png, x, y],
      );
    };
    const mat = await seen(0.02, 0.5);
    assert.deepEqual(await seen(0.98, 0.5), mat, "bars on both sides");
    assert.deepEqual(mat, [230, 230, 228]); // the mat, and nothing of A
    assert.notDeepEqual(await seen(1 / 18 + 0.02, 0.5), mat);
    // Nothing is read on the bars; in the picture x counts its own pixels.
    const touch = page.locator("fstop-stage .touch");
    const { x, y } = await touch.boundingBox();
    const reading = page.locator("#reading");
    await page.mouse.move(x + 0.03 * width, y + 0.5 * height);
    await eventually(() => reading.innerText(), (text) => /^Point at the picture/.test(text));
    await page.mouse.move(x + (1 / 18 + (8 / 9) * 0.25) * width, y + 0.25 * height);
    const text = await eventually(() => reading.innerText(), (said) => /depth/.test(said));
    const [, px, py] = /x (\d+), y (\d+)/.exec(text);
    assert.ok(Math.abs(px - 220) <= 2 && Math.abs(py - 165) <= 2, text);
    // Pictures of two shapes have no difference: the page says so.
    await choose(page, "difference");
    const why = page.locator("fstop-stage .why");
    await why.waitFor();
    assert.match(await why.innerText(), /no difference.*1\.5 times.*1\.333 times/s);
    assert.equal(await page.locator("fstop-stage canvas.difference").count(), 0);
    assert.doesNotMatch(await page.locator("fstop-picture figcaption").innerText(), /B less A/);
    assert.deepEqual(shared.complaints, []);
  });

  it("tell each its own progress and refusal, and keep them when they are swapped", async () => {
    const { page } = shared;
    await open(shared, `${kDraft}${kB}&compare=wipe`);
    await finished(page, "f/8");
    const status = page.locator("fstop-picture [role=status]");
    // The server is slow at B alone.
    let held = [];
    const is_b = (request) => request.postDataJSON().camera.lens?.focal_length_mm === 85;
    await page.route("**/v1/renders", (route) =>
      is_b(route.request()) ? void held.push(route) : route.continue(),
    );
    await page.getByRole("radio", { name: "B", exact: true }).check({ force: true });
    await choose(page, "85");
    await eventually(() => status.innerText(), (text) => /^B: rendering a preview/.test(text));
    await eventually(async () => held.length, (count) => count > 0);
    await page.getByRole("button", { name: "Swap" }).click();
    await eventually(() => status.innerText(), (text) => /^A: rendering a preview/.test(text));
    assert.match(
      await page.locator("fstop-stage img:not(.other)").getAttribute("alt"),
      /f\/8,/,
      "the picture goes with its request",
    );
    await page.unroute("**/v1/renders");
    for (const route of held.splice(0)) await route.continue().catch(() => undefined);
    await finished(page, "85 mm");
    await page.locator('fstop-stage img:not(.other)[alt*="85 mm"]').waitFor();
    assert.equal(await status.innerText(), "");

    // B (f/1.4 now) is refused: focused within its focal length.
    await page.getByRole("radio", { name: "B", exact: true }).check({ force: true });
    const focus = page.getByRole("textbox", { name: /Focus distance/ });
    await focus.fill("0.02");
    await focus.press("Enter");
    const facts = page.locator("fstop-picture figcaption");
    await eventually(() => status.innerText(), (text) => text.trim() === "B: refused by the server");
    assert.match(await facts.innerText(), /B\s*Picture of the last valid settings/);
    assert.match(await facts.innerText(), /A\s*method/);
    await page.locator("#focus_distance_m-fault .fault").first().waitFor();
    // Of the other request, whose controls are not shown, the refusal is said in words.
    await page.getByRole("radio", { name: "A", exact: true }).check({ force: true });
    const message = page.locator("fstop-picture .messages .fault");
    await message.first().waitFor();
    assert.match(await message.first().innerText(), /^B: Camera, lens, focus distance: must/);
    assert.equal(await page.locator("#focus_distance_m-fault .fault").count(), 0);
    await page.getByRole("button", { name: "Swap" }).click();
    await eventually(() => status.innerText(), (text) => text.trim() === "A: refused by the server");
    assert.match(await facts.innerText(), /A\s*Picture of the last valid settings/);
    await page.locator("#focus_distance_m-fault .fault").first().waitFor();
  });

  it("differ by as much as the page says, with the same seed", async () => {
    const { page } = shared;
    await open(shared, `${kDraft}${kB}&compare=wipe`);
    const a = await picture(page, "f/1.4");
    const b = await picture(page, "f/8");
    await choose(page, "difference");
    const caption = page.locator("fstop-picture figcaption");
    const text = await eventually(() => caption.innerText(), (said) => /B less A/.test(said));
    const [, mean] = /mean ([\d.]+)/.exec(text);
    assert.ok(Math.abs(mean - mean_difference(a, b)) < 0.02, `${mean}, ${mean_difference(a, b)}`);
    // Mid-grey where both are alike, four times the difference elsewhere.
    const shown = await pixels_of(page.locator("fstop-stage canvas.difference"));
    for (const at of [1000, 500_001, 1_500_002]) {
      const wanted = Math.min(Math.max(128 + 4 * (b.bytes[at] - a.bytes[at]), 0), 255);
      assert.equal(shown.bytes[at], wanted);
    }
    assert.match(page.url(), /compare=difference/);
  });

  it("begin as copies, can be changed, swapped and left", async () => {
    const { page } = shared;
    await open(shared, kDraft);
    const a = await picture(page);
    await page.getByRole("button", { name: "Compare A and B" }).click();
    await page.getByRole("slider", { name: /Aperture, f-number/ }).focus();
    await press(page, "ArrowRight", 15);
    await page.locator('fstop-stage img.other[alt*="f/8,"]').waitFor({ timeout: kPicture_ms });
    assert.match(page.url(), /b\.f_number=8/);
    assert.match(page.url(), /[#&]f_number=1\.4/);
    await page.getByRole("button", { name: "Swap" }).click();
    const swapped = page.locator('fstop-stage img:not(.other)[alt*="f/8,"]');
    await swapped.waitFor({ timeout: kPicture_ms });
    await page.getByRole("button", { name: "Keep only A" }).click();
    assert.doesNotMatch(page.url(), /b\./);
    assert.ok(mean_difference(a, await picture(page, "f/8,")) > 0.5);
  });
});

describe("settings", { timeout: 600_000 }, () => {
  const shared = use_page();

  it("darken the picture by the stop, or make up for it by time or ISO", async () => {
    const { page } = shared;
    // Dark enough that hardly anything is clipped, at the same shutter time.
    const exposure = (mode, f, t) => `${kDim}&f_number=${f}&exposure=${mode}&shutter=${t}`;
    await open(shared, exposure("manual", 4, "1/1000"));
    const bright = mean_light(await picture(page, "f/4,"));
    const aperture = page.getByRole("slider", { name: /Aperture, f-number/ });
    await aperture.focus();
    await press(page, "ArrowRight", 3);
    const dark = mean_light(await picture(page, "f/5.6,"));
    // Half of the light, but for what is clipped, quantized and noise.
    assert.ok(dark / bright > 0.46 && dark / bright < 0.6, `${dark / bright}`);

    await page.getByRole("combobox", { name: "Exposure" }).selectOption("time");
    await aperture.focus();
    await press(page, "ArrowRight", 3);
    const same = mean_light(await picture(page, "f/8,"));
    assert.ok(Math.abs(same / dark - 1) < 0.03, `${same / dark}`);
    assert.match(page.url(), /shutter=1%2F500/);
    await page.getByRole("combobox", { name: "Exposure" }).selectOption("iso");
    await aperture.focus();
    await press(page, "ArrowRight", 3);
    await eventually(async () => page.url(), (url) => /iso=200/.test(url));
  });

  it("keep the subject's size when framing is locked, and the view when breathing is off", async () => {
    const { page } = shared;
    await open(shared, kDraft);
    const size = await optics_number(page, "Magnification");
    await page.getByRole("checkbox", { name: "Lock framing" }).check();
    await choose(page, "85");
    await finished(page, "85 mm");
    assert.ok(Math.abs((await optics_number(page, "Magnification")) / size - 1) < 1e-3);
    assert.match(page.url(), /focus_distance_m=3\.4&.*camera_z_m=1\.4/);

    await page.getByRole("checkbox", { name: "Focus breathing" }).uncheck();
    const fixed = (360 / Math.PI) * Math.atan(36 / 2 / 85);
    const view = await eventually(
      () => optics_number(page, "View angle"),
      (angle) => Math.abs(angle - fixed) < 0.006,
    );
    await page.getByRole("slider", { name: /Focus distance, from near/ }).focus();
    await press(page, "ArrowLeft", 10);
    await eventually(() => optics_number(page, "Sharp to"), (far_m) => far_m < 3);
    assert.equal(await optics_number(page, "View angle"), view);
  });

  it("take other sensors, in their own shape, and blades", async () => {
    const { page } = shared;
    await open(shared, kDraft);
    await page.getByRole("combobox", { name: "Sensor" }).selectOption("four-thirds");
    await eventually(
      async () => (await picture(page)).height,
      (height) => height === 650,
    );
    const view = await optics_number(page, "View angle");
    const v_mm = 1 / (1 / 50 - 1 / 2000);
    assert.ok(Math.abs(view - (360 / Math.PI) * Math.atan(17.3 / 2 / v_mm)) < 0.01, `${view}`);
    await page.getByText("Iris, light, place").click();
    const round = await picture(page);
    await page.getByRole("combobox", { name: "Blades of the iris" }).selectOption("5");
    await page.waitForTimeout(500);
    const bladed = await picture(page);
    assert.ok(mean_difference(round, bladed) > 0.05);
    assert.match(page.url(), /sensor=four-thirds.*blades=5/);
    await open_tab(page, "Share");
    const command = await page.locator("fstop-share pre.curl").innerText();
    assert.match(command, /"sensor_mm":\[17\.3,13\].*"blades":5/);
  });
});
