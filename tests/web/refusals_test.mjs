// What the page says where something is not taken: by the server, from a link, or as it is typed.
import assert from "node:assert/strict";
import { describe, it } from "node:test";
import { eventually, finished, kDraft, kPicture_ms, open, open_tab, use_page } from "./harness.mjs";

const kPointer = /#?\/[a-z_]+\//; // "#/camera/", "/lens/"

describe("what the server refuses", { timeout: 600_000 }, () => {
  const shared = use_page();
  const messages = () => shared.page.locator("fstop-picture .messages .fault");

  it("is said in words where no control shows it, without a button that cannot help", async () => {
    const { page, server } = shared;
    await page.goto(`${server.url}${kDraft}&subject_m=-1`);
    await messages().first().waitFor({ timeout: kPicture_ms });
    assert.match(await messages().first().innerText(), /^Distance of the subject: must/);
    assert.doesNotMatch((await messages().allInnerTexts()).join(" "), kPointer);
    assert.equal(await page.getByRole("button", { name: "Try again" }).count(), 0);

    // A look at a place out of reach is the camera's own place on this page.
    await page.goto("about:blank");
    await page.goto(`${server.url}${kDraft}&camera_z_m=1e300`);
    const place = page.locator("#camera_z_m-fault .fault");
    await place.first().waitFor({ timeout: kPicture_ms });
    assert.doesNotMatch((await messages().allInnerTexts()).join(" "), kPointer);
    assert.equal(await page.getByRole("button", { name: "Try again" }).count(), 0);
  });

  it("can be tried again where the server failed", async () => {
    const { page, server } = shared;
    const body = JSON.stringify({ title: "Internal error", status: 500 });
    const headers = { "Content-Type": "application/problem+json" };
    await page.route("**/v1/renders", (route) => route.fulfill({ status: 500, headers, body }));
    await page.goto(server.url + kDraft);
    await messages().first().waitFor();
    assert.match(await messages().first().innerText(), /^Internal error\s*Try again$/);
    await page.unroute("**/v1/renders");
    await page.getByRole("button", { name: "Try again" }).click();
    await eventually(() => messages().count(), (count) => count === 0);
    await finished(page);
  });

  it("is not called the last valid settings where there are none", async () => {
    const { page, server } = shared;
    await page.goto(server.url + kDraft.replace("0.03", "-1"));
    await page.locator("#max_error-fault .fault").first().waitFor({ timeout: kPicture_ms });
    const caption = page.locator("fstop-picture figcaption");
    await eventually(() => caption.innerText(), (text) => /the picture itself is refused/.test(text));
    assert.doesNotMatch(await caption.innerText(), /last valid/);
    // Settings that were valid are called so.
    await page.getByRole("radio", { name: "Draft" }).check();
    await finished(page);
    const focus = page.getByRole("textbox", { name: /Focus distance/ });
    await focus.fill("0.02");
    await focus.press("Enter");
    await eventually(() => caption.innerText(), (text) => /Picture of the last valid settings/.test(text));
  });

  it("has no files and no commands to share, until it is mended", async () => {
    const { page } = shared;
    await open(shared, kDraft);
    await open_tab(page, "Share");
    const files = page.locator("fstop-share a.button");
    await eventually(() => files.count(), (count) => count === 5);
    const before = await files.first().getAttribute("href");
    const focus = page.getByRole("textbox", { name: /Focus distance/ });
    await focus.fill("0.02");
    await focus.press("Enter");
    const waits = page.locator("fstop-share .waits");
    await eventually(() => waits.allInnerTexts(), (texts) => /refuses these settings/.test(texts[0]));
    assert.equal(await files.count(), 0);
    assert.equal(await page.locator("fstop-share pre.curl, fstop-share pre.python").count(), 0);
    assert.equal(await page.getByRole("button", { name: "CSV of the optics" }).count(), 0);
    await focus.fill("1.5");
    await focus.press("Enter");
    await eventually(() => files.count(), (count) => count === 5, kPicture_ms);
    assert.notEqual(await files.first().getAttribute("href"), before);
    assert.match(await page.locator("fstop-share pre.curl").innerText(), /"focus_distance_m":1\.5/);
  });
});

describe("what is no value", { timeout: 600_000 }, () => {
  const shared = use_page();

  it("of a link is named, and gone once the link is the page's own", async () => {
    const { page, server } = shared;
    const link = `${kDraft.replace("1.4", "abc")}&shutter=1/7&sharpness=9`;
    await page.goto(server.url + link);
    const message = page.locator("fstop-picture .messages .fault");
    await message.first().waitFor();
    assert.match(
      await message.first().innerText(),
      /does not understand.*: f_number=abc, shutter=1\/7, sharpness=9\./,
    );
    await page.locator("fstop-stage img").first().waitFor({ timeout: kPicture_ms });
    assert.equal(await message.count(), 1);
    await page.getByRole("slider", { name: /Aperture, f-number/ }).focus();
    await page.keyboard.press("ArrowRight");
    await eventually(() => message.count(), (count) => count === 0);
    assert.doesNotMatch(page.url(), /abc|sharpness/);
  });

  it("of an experiment's name is named too", async () => {
    const { page, server } = shared;
    await page.goto(`${server.url}${kDraft}&experiment=levitation&step=1`);
    const fault = page.locator("fstop-experiments .fault");
    await fault.first().waitFor();
    assert.match(await fault.first().innerText(), /not here: levitation/);
  });

  it("as it is typed stays in its field, with what is wrong with it", async () => {
    const { page } = shared;
    await open(shared, kDraft);
    await page.getByText("Iris, light, place").click();
    await page.locator("fstop-camera-controls summary", { hasText: "Motion, light" }).click();
    for (const [name, field] of [
      [/^Wavelength/, "wavelength_nm"],
      [/^Camera stands back/, "camera_z_m"],
      [/^Camera moves to the right/, "velocity_m_s"],
    ]) {
      const input = page.getByRole("textbox", { name });
      const before = await input.inputValue();
      await input.fill("nonsense");
      await input.press("Enter");
      const fault = page.locator(`#${field}-fault .fault`);
      await fault.waitFor();
      assert.equal(await fault.innerText(), '"nonsense" is not a number');
      assert.equal(await input.getAttribute("aria-invalid"), "true");
      assert.equal(await input.inputValue(), "nonsense");
      await input.fill(before);
      await input.press("Enter");
      await fault.waitFor({ state: "detached" });
      assert.equal(await input.getAttribute("aria-invalid"), "false");
    }
  });
});
