// The HTML report of fstop verify: a file on its own that everyone can read.
import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { mkdtemp, readFile, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, describe, it } from "node:test";
import { pathToFileURL } from "node:url";
import { start_browser } from "./served_page.mjs";

const kAxe = new URL("../../web/node_modules/axe-core/axe.min.js", import.meta.url);
const kSuite = {
  format: "fstop-suite/1",
  title: "One of <each> colour",
  cameras: {
    a: { lens: { focal_length_mm: 50, f_number: 2, focus_distance_m: 2 }, shutter_s: 0.01, exposure: { iso: 100 } },
  },
  checks: [
    { name: "green", kind: "brightness", camera: "a", f_numbers: [2, 4, 8] },
    { name: "red", kind: "brightness", camera: "a", f_numbers: [2], expected: [1.5] },
  ],
};

describe("report of fstop verify", { timeout: 120_000 }, () => {
  let folder;
  let browser;
  before(async () => {
    folder = await mkdtemp(join(tmpdir(), "fstop-report-"));
    await writeFile(join(folder, "suite.json"), JSON.stringify(kSuite));
    const run = spawnSync(process.env.FSTOP_BINARY, [
      ...["verify", "--suite", join(folder, "suite.json"), "--report", join(folder, "report.html")],
    ]);
    assert.equal(run.status, 1, String(run.stdout) + run.stderr); // one result is red
    browser = await start_browser();
  });
  after(async () => {
    await browser?.close();
    await rm(folder, { recursive: true });
  });

  for (const [colorScheme, width] of [
    ["light", 1280],
    ["dark", 360],
  ])
    it(`has no fault that axe finds and asks no host, ${colorScheme}, ${width} px wide`, async () => {
      const page = await browser.newPage({ viewport: { width, height: 800 }, colorScheme, bypassCSP: true });
      const asked = [];
      page.on("request", (request) => asked.push(request.url()));
      await page.goto(pathToFileURL(join(folder, "report.html")).href);
      assert.deepEqual(asked.filter((url) => !/^(file|data):/.test(url)), []);
      assert.match(await page.locator("h1").innerText(), /One of <each> colour/);
      assert.equal(await page.locator("td.green").count(), 4);
      assert.equal(await page.locator("td.red").count(), 1);
      for (const image of await page.locator("img").all()) {
        assert.ok(await image.evaluate((one) => one.complete && one.naturalWidth > 10));
      }
      const beyond = await page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
      assert.ok(beyond <= 0, `${beyond} px beyond the window`);
      await page.evaluate(await readFile(kAxe, "utf8"));
      const { violations } = await page.evaluate(() => globalThis.axe.run(document));
      assert.deepEqual(violations.map(({ id, nodes }) => [id, nodes.map((node) => node.html)]), []);
      await page.close();
    });
});
