// For everyone: axe on every view, keys alone, sizes, colours, no foreign host; and a server that
// is full, slow or gone.
import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { describe, it } from "node:test";
import { choose, eventually, finished, is_render, kDraft, kPicture_ms, open } from "./harness.mjs";
import { open_tab, optics_number, press, use_page } from "./harness.mjs";
import { start_server } from "./served_page.mjs";

const kAxe = new URL("../../web/node_modules/axe-core/axe.min.js", import.meta.url);
const kTabs = ["Optics", "Gallery", "Plots", "Experiments", "How it was made", "Share and export"];

async function faults_of(page) {
  const { violations } = await page.evaluate(() => globalThis.axe.run(document));
  return violations.map(({ id, nodes }) => [id, nodes.map((node) => node.html.slice(0, 200))]);
}

describe("access", { timeout: 600_000 }, () => {
  const shared = use_page();

  for (const [colorScheme, width] of [
    ["light", 1280],
    ["dark", 360],
  ])
    it(`has no fault that axe finds in any view, ${colorScheme}, ${width} px wide`, async () => {
      const { page } = shared;
      await page.emulateMedia({ colorScheme, reducedMotion: "reduce" });
      await page.setViewportSize({ width, height: 800 });
      const b = "&b.camera=lens&b.scene=still-life&b.f_number=8&b.max_error=0.03";
      await open(shared, `${kDraft}${b}&exposure=manual&shutter=1/4000&blades=5`);
      await page.evaluate(await readFile(kAxe, "utf8"));
      for (const name of kTabs) {
        await open_tab(page, name);
        if (name === "Plots") await page.locator("fstop-plot svg.plot").waitFor();
        if (name === "Experiments") {
          assert.deepEqual(await faults_of(page), [], "list of experiments");
          await page.getByRole("button", { name: /F-stop and depth/ }).click();
          await page.locator("fstop-experiments .choices button").first().click();
          await page.locator("fstop-experiments td").first().waitFor();
        }
        assert.deepEqual(await faults_of(page), [], name);
        const beyond = await page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
        assert.ok(beyond <= 0, `${name}: ${beyond} px beyond the window`);
      }
      assert.deepEqual(shared.complaints, []);
      assert.deepEqual(shared.foreign, []);
    });

  it("fills a 4K screen and stays within it, in its own contrast", async () => {
    const { page } = shared;
    await page.setViewportSize({ width: 3840, height: 2160 });
    await open(shared, kDraft);
    const frame = await page.locator("fstop-stage .frame").boundingBox();
    assert.ok(frame.width > 900, `${frame.width} px`);
    const side = await page.locator("fstop-side-view").boundingBox();
    assert.ok(side.x >= frame.x + frame.width, "side view beside the picture");
    assert.ok((await page.evaluate(() => document.documentElement.scrollWidth)) <= 3840);
  });

  it("can be used by keys alone: scene to picture to plots", async () => {
    const { page } = shared;
    await open(shared, kDraft);
    const focused = () =>
      page.evaluate(() => {
        let at = document.activeElement;
        while (at?.shadowRoot?.activeElement) at = at.shadowRoot.activeElement;
        return `${at.getAttribute("aria-label") ?? ""} ${at.id} ${at.textContent}`.trim();
      });
    const reach = async (what) => {
      for (let i = 0; i < 60; ++i) {
        await press(page, "Tab");
        const at = await focused();
        if (what.test(at)) return at;
      }
      return assert.fail(`no way by Tab to ${what}`);
    };
    await reach(/Picture: arrow keys/);
    await press(page, "ArrowDown", 3);
    await press(page, "Enter");
    await reach(/Aperture, f-number/);
    await press(page, "ArrowRight", 3);
    await eventually(async () => page.url(), (url) => /f_number=2&/.test(url));
    await reach(/^Focused plane/);
    await press(page, "ArrowUp");
    await reach(/tab-optics/);
    await press(page, "ArrowRight", 2); // by the gallery
    await eventually(
      () => page.getByRole("tab", { name: "Plots" }).getAttribute("aria-selected"),
      (selected) => selected === "true",
    );
    assert.match(await focused(), /tab-plots/);
    // What happened is said: the summary is a live region.
    assert.equal(await page.locator(".summary").getAttribute("role"), "status");
    assert.match(await page.locator(".summary").innerText(), /50\s*mm at f\/2, focused at/);
  });

  it("stands still where motion is to be reduced", async () => {
    const { page } = shared;
    await page.goto(shared.server.url + kDraft.replace("0.03", "0.002"));
    const frame = page.locator('fstop-stage .frame[aria-busy="true"]');
    await frame.waitFor();
    const moving = () => frame.evaluate((one) => getComputedStyle(one, "::after").animationName);
    assert.equal(await moving(), "none");
    await page.emulateMedia({ reducedMotion: "no-preference" });
    await eventually(moving, (name) => name === "sweep"); // not yet of the preview
    await choose(page, "Draft");
  });

  it("loads less than 200 kB, and plots only when they are wanted", async (t) => {
    const { page } = shared;
    const sizes = new Map();
    page.on("response", (reply) => {
      const { pathname } = new URL(reply.url());
      if (!/^\/$|assets|favicon/.test(pathname)) return;
      sizes.set(pathname, reply.body().then((body) => body.length));
    });
    await open(shared, kDraft);
    const bytes = (await Promise.all(sizes.values())).reduce((sum, size) => sum + size, 0);
    const names = [...sizes.keys()];
    t.diagnostic(`first load ${bytes} bytes before compression`);
    assert.ok(bytes > 50_000 && bytes < 200_000, `${bytes}`);
    assert.ok(!names.some((name) => /plots_panel|experiments/.test(name)), `${names}`);
  });
});

describe("a server in trouble", { timeout: 600_000 }, () => {
  const shared = use_page();

  it("that is full is waited for as long as it asks", async () => {
    const { page } = shared;
    await open(shared, kDraft);
    let refused = 0; // more than there are keys, each of which may ask
    await page.route("**/v1/renders", (route) => {
      if (++refused > 4) return route.continue();
      return route.fulfill({ status: 503, headers: { "Retry-After": "1" }, body: "" });
    });
    await page.getByRole("slider", { name: /Aperture, f-number/ }).focus();
    await press(page, "ArrowRight", 3);
    const status = page.locator("fstop-picture [role=status]");
    await eventually(() => status.innerText(), (text) => /busy; trying again/.test(text));
    await finished(page, "f/2,");
    assert.ok(refused > 4);
  });

  it("that is slow is told of, and how long it takes already", async () => {
    const { page } = shared;
    await open(shared, kDraft);
    await page.route("**/v1/renders", async (route) => {
      await new Promise((resolve) => setTimeout(resolve, 5500));
      await route.continue().catch(() => undefined);
    });
    await page.getByRole("slider", { name: /Aperture, f-number/ }).focus();
    await press(page, "ArrowRight", 3);
    const caption = page.locator("fstop-picture figcaption");
    await eventually(() => caption.innerText(), (text) => /rendering a preview/.test(text));
    await eventually(() => caption.innerText(), (text) => /\b[45] s/.test(text));
    await page.unroute("**/v1/renders");
  });

  it("that is gone is told of; settings stay, and the picture comes when it is back", async () => {
    const { page } = shared;
    await open(shared, kDraft);
    const { port } = new URL(shared.server.url);
    await shared.server.stop();
    await page.getByRole("slider", { name: /Aperture, f-number/ }).focus();
    await press(page, "ArrowRight", 15);
    const status = page.locator("fstop-picture [role=status]");
    await eventually(() => status.innerText(), (text) => /does not answer; trying again/.test(text));
    assert.match(page.url(), /f_number=8/);
    assert.equal(await page.locator("fstop-stage img").count(), 1, "the old picture stays");
    shared.server = await start_server(Number(port));
    const again = page.waitForResponse((reply) => is_render(reply.request()), {
      timeout: kPicture_ms,
    });
    await again;
    await finished(page, "f/8,");
    await eventually(() => optics_number(page, "Working f-number"), (n) => Math.abs(n - 8.205) < 0.01);
    assert.equal(await status.innerText(), "");
  });

  it("that is away is told of by an experiment, which goes on when it is back", async () => {
    const { page } = shared;
    await open(shared, kDraft);
    await open_tab(page, "Experiments");
    await page.getByRole("button", { name: /Hyperfocal/ }).click();
    await finished(page, "focused at infinity");
    await page.route("**/v1/optics", (route) => route.abort());
    const choices = page.locator("fstop-experiments .choices button");
    await choices.last().click();
    const activity = page.locator("fstop-experiments .activity");
    await eventually(
      () => activity.innerText(),
      (text) => text === "The server does not answer; measuring goes on when it is back.",
    );
    await eventually(() => activity.innerText(), (text) => / [56] s$/.test(text));
    await page.unroute("**/v1/optics");
    await page.locator('fstop-experiments td[data-name="near"]').waitFor();
    assert.equal(await activity.count(), 0);
    assert.ok(await choices.last().isEnabled());
  });
});
