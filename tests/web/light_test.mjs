// Light and pictures on the page: the gallery, and settings of motion, shading, textures, halftone.
import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { fileURLToPath } from "node:url";
import { describe, it } from "node:test";
import { eventually, finished, kPicture_ms, mean_difference, open, open_tab } from "./harness.mjs";
import { pixels_of, use_page } from "./harness.mjs";

const kSpheres =
  "#scene=spheres&camera=lens&focal_length_mm=50&f_number=8&focus_distance_m=2&max_error=0.03";
const kLooks = JSON.parse(
  await readFile(fileURLToPath(new URL("../../web/src/gallery.json", import.meta.url)), "utf8"),
);

const kAxe = new URL("../../web/node_modules/axe-core/axe.min.js", import.meta.url);

async function axe_violations(page) {
  await page.evaluate(await readFile(kAxe, "utf8"));
  const { violations } = await page.evaluate(() => globalThis.axe.run(document));
  return violations.map(({ id, nodes }) => [id, nodes.map((node) => node.html.slice(0, 200))]);
}

describe("gallery", { timeout: 600_000 }, () => {
  const shared = use_page();

  it("shows every scene and every look as the server renders it, and opens what is chosen", async () => {
    const { page, server } = shared;
    await open(shared, kSpheres);
    await open_tab(page, "Gallery");
    const entries = page.locator("fstop-gallery li");
    const { scenes } = await (await fetch(new URL("v1/scenes", server.url))).json();
    await eventually(() => entries.count(), (count) => count === scenes.length + kLooks.length);
    const images = page.locator("fstop-gallery li img");
    await eventually(
      () => images.count(),
      (count) => count === scenes.length + kLooks.length,
      4 * kPicture_ms,
    );
    const picture = (title) =>
      pixels_of(page.locator("fstop-gallery li", { hasText: title }).first().locator("img"));
    // Looks differ where they say they do: of flat polygons and of Phong's, of dots and of diffusion.
    for (const [one, other] of [
      ["Flat polygons", "Phong"],
      ["Nearest texels", "Mip maps"],
      ["Newspaper", "Error diffusion"],
    ]) {
      const off = mean_difference(await picture(one), await picture(other));
      assert.ok(off > 0.3, `${one} and ${other}: ${off}`);
    }
    assert.deepEqual(await axe_violations(page), []);
    await page.locator("fstop-gallery li", { hasText: "Error diffusion" }).locator("button").click();
    await eventually(async () => page.url(), (url) => /halftone=error-diffusion/.test(url));
    const shown = await pixels_of(await finished(page, "Still life"));
    const levels = new Set(shown.bytes.filter((_, i) => i % 4 !== 3));
    assert.deepEqual([...levels].sort((a, b) => a - b), [0, 255]);
  });
});

describe("settings of light", { timeout: 600_000 }, () => {
  const shared = use_page();
  const opened = async () => {
    await shared.page.locator("fstop-camera-controls summary", { hasText: "Motion, light" }).click();
    await shared.page.locator("fstop-light-controls select").first().waitFor();
  };
  const select = (name) => shared.page.locator("fstop-light-controls").getByLabel(name);

  it("are loaded when they are opened, and each is in the picture and in the address", async () => {
    const { page } = shared;
    await open(shared, kSpheres);
    assert.equal(await page.locator("fstop-light-controls select").count(), 0);
    const before = await pixels_of(await finished(page));
    await opened();
    await select("Shading across polygons").selectOption("flat");
    await eventually(async () => page.url(), (url) => /interpolation=flat/.test(url));
    const flat = await pixels_of(await finished(page));
    assert.ok(mean_difference(before, flat) > 0.05, `${mean_difference(before, flat)}`);
    await select("Shading across polygons").selectOption("");
    await select("Illumination").selectOption("local");
    await eventually(async () => page.url(), (url) => /illumination=local/.test(url));
    const local = await pixels_of(await finished(page));
    assert.ok(mean_difference(flat, local) > 0.05);
    assert.deepEqual(await axe_violations(page), []);
  });

  it("smears what a moving camera sees, more the longer the shutter is open", async () => {
    const { page } = shared;
    const address = kSpheres.replace("spheres", "charts");
    await open(shared, address);
    const still = await pixels_of(await finished(page));
    await opened();
    const speed = page.locator("fstop-light-controls").getByLabel(/moves to the right/);
    await speed.fill("0.2");
    await speed.press("Enter");
    await eventually(async () => page.url(), (url) => /velocity_m_s=0\.2/.test(url));
    const short = await pixels_of(await finished(page));
    const shutter = page.locator("fstop-light-controls").getByRole("slider", { name: "Shutter time" });
    await shutter.fill("0"); // one second
    await shutter.dispatchEvent("change");
    await eventually(async () => page.url(), (url) => /shutter=1(&|$)/.test(url));
    const long = await pixels_of(await finished(page));
    const [a, b] = [mean_difference(still, short), mean_difference(still, long)];
    assert.ok(b > 2 * a && b > 2, `${a}, ${b}`);
  });

  it("tell at their place what the server refuses", async () => {
    const { page, complaints } = shared;
    await open(shared, `${kSpheres}&halftone=clustered-dot`);
    const cell = page.locator("fstop-light-controls").getByLabel(/Cell of the halftone/);
    await cell.fill("1");
    await cell.press("Enter");
    const fault = page.locator("fstop-light-controls .fault");
    await fault.first().waitFor();
    assert.match(await fault.first().innerText(), /2/);
    assert.equal(await cell.getAttribute("aria-invalid"), "true");
    complaints.length = 0; // the refusals, which the console tells of
  });
});
