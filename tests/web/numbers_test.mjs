// Plots, experiments and exports, each against numbers that are computed here or by the server.
import assert from "node:assert/strict";
import { execFile } from "node:child_process";
import { mkdtemp, readFile, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { describe, it } from "node:test";
import { promisify } from "node:util";
import { choose, eventually, finished, kDraft, kPicture_ms, open, open_tab } from "./harness.mjs";
import { pixels_of, rgb_at, use_page } from "./harness.mjs";

const run = promisify(execFile);

/// All text inside a component.
function text_of(component) {
  return component.evaluate((host) => host.shadowRoot.textContent.replace(/\s+/g, " "));
}

/// Until the plot of this caption is there: the one before is shown until then.
function shows_plot(page, caption) {
  return eventually(() => page.locator("fstop-plot figcaption").innerText(), (text) => caption.test(text));
}

/// The table of the plot that is shown: an object for each row.
async function table_of(page) {
  const kMostTries = 4; // a plot may be drawn anew between two looks at it
  for (let tries = 1; ; ++tries) {
    await page.locator("fstop-plot:not(.dim) svg.plot").waitFor({ timeout: kPicture_ms });
    const download = page.waitForEvent("download");
    await page.locator("fstop-plot").getByRole("button", { name: "CSV" }).click();
    const text = await readFile(await (await download).path(), "utf8");
    const cells = (line) =>
      [...line.matchAll(/(?:^|,)(?:"((?:[^"]|"")*)"|([^,]*))/g)].map((m) => m[1] ?? m[2]);
    const [head, ...lines] = text.trim().split("\n").map(cells);
    // The same as the table behind the plot.
    const shown = await page.locator("fstop-plot tbody tr").count();
    if (shown !== lines.length && tries < kMostTries) continue;
    assert.equal(shown, lines.length);
    return { head, rows: lines.map((line) => line.map(Number)), lines };
  }
}

describe("plots", { timeout: 600_000 }, () => {
  const shared = use_page();

  it("of blur follow the closed form, and the wave spot both limits", async () => {
    const { page } = shared;
    await open(shared, kDraft.replace("1.4", "8"));
    await open_tab(page, "Plots");
    const { head, lines } = await table_of(page);
    assert.deepEqual(head.length, 4);
    const of = (name) =>
      lines.filter(([series]) => series.startsWith(name)).map((line) => line.slice(1).map(Number));
    const [geometric, airy, wave] = ["geometric", "diffraction", "both"].map(of);
    const v_mm = 1 / (1 / 50 - 1 / 2000);
    for (const [at_m, blur_um] of geometric) {
      const wanted = 1000 * (50 / 8) * v_mm * Math.abs(1 / 2000 - 1 / (1000 * at_m));
      assert.ok(Math.abs(blur_um - wanted) <= 1e-3 * wanted + 1e-3, `${at_m} m: ${blur_um}`);
    }
    const airy_um = 2.4393 * 0.55 * 8 * (v_mm / 50); // 2 * 1.2197 lambda N_w
    assert.ok(Math.abs(airy[0][1] / airy_um - 1) < 1e-3, `${airy[0][1]}, ${airy_um}`);
    const at_focus = wave.find(([at_m]) => at_m === 2)[1];
    // The share of light is flat about the first dark ring: its radius is not sharply told.
    assert.ok(Math.abs(at_focus / airy_um - 1) < 0.05, `${at_focus}`);
    const far = wave.at(-1)[1] / geometric.at(-1)[1]; // 83.8 % of a disc's area
    assert.ok(Math.abs(far - Math.sqrt(0.838)) < 0.03, `${far}`);
    // The line is drawn where the numbers are: it dips to its lowest at the focused plane.
    const lowest = await page.locator("fstop-plot path.s2.line").first().evaluate((path) => {
      const svg = path.ownerSVGElement.getBoundingClientRect();
      const box = path.getBoundingClientRect();
      return (box.bottom - svg.top) / svg.height;
    });
    assert.ok(lowest > 0.4, `${lowest}`);
  });

  it("of blur are held against pictures, by what is measured in them", async () => {
    const { page } = shared;
    const asked = [];
    page.on("response", (reply) => {
      if (/v1\/measurements/.test(reply.url())) asked.push(reply);
    });
    // A seven-bladed iris at f/2.8 and one third: its discs are counted by their area.
    const address = kDraft.replace("1.4", "3.2").replace("still-life", "charts");
    await page.goto(shared.server.url + address.replace("#", "#blades=7&"));
    await open_tab(page, "Plots");
    const told = page.locator("fstop-plots").getByRole("status");
    await eventually(
      () => told.innerText(),
      (text) => /Measured at 10 distances/.test(text),
      3 * kPicture_ms,
    );
    const { lines } = await table_of(page);
    const measured = lines.filter(([series]) => /^measured in rendered/.test(series));
    assert.equal(measured.length, 10);
    // f/3.2 is 2^(10/6). Sampling by pixels leaves 0.23 % of a disc of ten pixels, the smallest one.
    // Its pixels have an error of 6 % of their value at most, the diameter half of the mean of 80 of
    // them: 0.34 %. A lamp of a twentieth of it is taken off. 0.6 % in all.
    const v_mm = 1 / (1 / 50 - 1 / 2000);
    for (const [, at_m, measured_um, percent] of measured) {
      const wanted = 1000 * (50 / 2 ** (10 / 6)) * v_mm * Math.abs(1 / 2000 - 1 / (1000 * at_m));
      const off = 100 * (measured_um / wanted - 1);
      assert.ok(Math.abs(off) < 0.6, `${at_m} m: ${measured_um} of ${wanted} um`);
      assert.ok(Math.abs(off - percent) < 0.02, `${off} told as ${percent} %`);
    }
    assert.ok(asked.length === 10 && asked.every((reply) => reply.status() === 200), `${asked.length}`);
    // The points are drawn, and all that was asked for was answered.
    assert.equal(await page.locator("fstop-plot path.s3.dots[data-series]").count(), 10);
    assert.deepEqual(shared.complaints, []);
  });

  it("of contrast have the diffraction limit in focus", async () => {
    const { page } = shared;
    await open(shared, kDraft.replace("1.4", "16").replace("#", "#subject_m=1.5&"));
    await open_tab(page, "Plots");
    await choose(page, "Contrast (MTF)");
    await shows_plot(page, /Contrast that is left/);
    const { head, rows } = await table_of(page);
    assert.match(head[1], /1\.5\s*m/);
    const n = 16 * (1 + 50 / 1950);
    for (const [per_mm, subject, focus] of rows) {
      const s = per_mm * 0.00055 * n;
      const limit = (2 / Math.PI) * (Math.acos(s) - s * Math.sqrt(1 - s * s));
      assert.ok(Math.abs(focus - limit) < 2e-3, `${per_mm} per mm: ${focus}, ${limit}`);
      assert.ok(subject <= focus + 1e-6);
    }
  });

  it("of pinholes have their optimum between shadow and diffraction, by wavelength", async () => {
    const { page } = shared;
    await open(shared, "#scene=pinhole-series&camera=pinhole&diameter_mm=0.35&subject_m=2&max_error=0.05");
    await open_tab(page, "Plots");
    await choose(page, "Pinhole size");
    await shows_plot(page, /Spot of a point/);
    const best = async () => {
      const { rows } = await table_of(page);
      const [first, last] = [rows[0], rows.at(-1)];
      assert.ok(Math.abs(first[3] / first[2] - 1) < 0.1, "narrow: the Airy disc");
      assert.ok(Math.abs(last[3] / last[1] - Math.sqrt(0.838)) < 0.04, "wide: the shadow");
      return rows.reduce((a, b) => (b[3] < a[3] ? b : a))[0];
    };
    // Near c = 1.8 of d = c sqrt(f' lambda), f' = 50 mm and 2 m together; the samples are coarse.
    const wanted = (nm) => 1.8 * Math.sqrt((1 / (1 / 50 + 1 / 2000)) * nm * 1e-6);
    const green = await best();
    assert.ok(Math.abs(green / wanted(550) - 1) < 0.3, `${green}`);
    assert.equal(await page.locator("fstop-plot text.mark").count(), 3);
    await choose(page, "450");
    await shows_plot(page, /450/);
    assert.ok((await best()) <= green);
    await page.getByRole("button", { name: /row of holes/ }).click();
    const row = page.locator("fstop-pinhole-row .row[aria-busy=false] img");
    await row.nth(4).waitFor({ timeout: kPicture_ms });
  });

  it("of speed and accuracy show every method and why the planner chose", async () => {
    const { page } = shared;
    await open(shared, kDraft.replace("still-life", "spheres"));
    await open_tab(page, "Plots");
    await choose(page, "Speed and accuracy");
    const asked = page.waitForResponse((reply) => /v1\/charts/.test(reply.url()));
    await page.getByRole("button", { name: /every method/ }).click();
    await asked;
    const { lines } = await table_of(page);
    const methods = new Set(lines.map(([name]) => name));
    for (const name of ["pinhole", "gather", "lens-sampling"]) assert.ok(methods.has(name), name);
    assert.equal([...methods].filter((name) => /^chosen for/.test(name)).length, 2);
    const lens = lines.filter(([name]) => name === "lens-sampling").map((line) => Number(line[2]));
    assert.ok(lens.at(-1) < lens[0] / 4, `${lens}`); // 64 times the samples: an eighth of the noise
    assert.ok((await page.locator("fstop-plot path.rings").count()) >= 2);
    assert.match(await text_of(page.locator("fstop-plots")), /For an error of 0\.01: .*costs more/s);

    // With other settings plot and reasons are both marked as old, and say so.
    const stale = page.locator("fstop-plots .dim .stale");
    assert.equal(await stale.count(), 0);
    await page.getByRole("slider", { name: /Aperture, f-number/ }).focus();
    await page.keyboard.press("ArrowRight");
    await stale.waitFor();
    assert.match(await stale.innerText(), /Of the settings before/);
    assert.equal(await page.locator("fstop-plots .dim .reasons").count(), 1);
    assert.equal(await page.locator("fstop-plots .dim fstop-plot.dim").count(), 1);
    await page.keyboard.press("ArrowLeft");
    await stale.waitFor({ state: "detached" });
    assert.equal(await page.locator("fstop-plots .reasons").count(), 1);
  });
});

describe("experiments", { timeout: 600_000 }, () => {
  const shared = use_page();
  const kBackground = [205, 225, 240]; // of the spheres, (0.62, 0.76, 0.88) in sRGB

  it("answer every step by what the server measures", async () => {
    const { page } = shared;
    await open(shared, kDraft);
    await open_tab(page, "Experiments");
    const list = page.locator("fstop-experiments .list button");
    await list.first().waitFor();
    const count = await list.count();
    assert.ok(count >= 6, `${count}`);
    let steps = 0;
    for (let i = 0; i < count; ++i) {
      await list.nth(i).click();
      for (;;) {
        const [, at, all] = /Step (\d+) of (\d+)/.exec(
          await text_of(page.locator("fstop-experiments")),
        );
        await page.locator("fstop-experiments .choices button").last().click();
        const verdict = page.locator("fstop-experiments [aria-live] b");
        await verdict.waitFor({ timeout: kPicture_ms });
        assert.match(await verdict.innerText(), /^(Right\.|No: .+\.)$/);
        const values = await page.locator("fstop-experiments td").allInnerTexts();
        assert.ok(values.length >= 2 && values.every((text) => /\d|∞/.test(text)), `${values}`);
        const right = await page.locator("fstop-experiments .choices .right").count();
        assert.equal(right, 1, await text_of(page.locator("fstop-experiments")));
        ++steps;
        if (at === all) break;
        await page.getByRole("button", { name: "Next step" }).click();
      }
      await page.getByRole("button", { name: "All experiments" }).click();
    }
    assert.ok(steps >= 12, `${steps} steps`);
  });

  it("keep their step's camera in the address, and measure what it is", async () => {
    const { page } = shared;
    await open(shared, kDraft);
    await open_tab(page, "Experiments");
    await page.getByRole("button", { name: /Hyperfocal/ }).click();
    assert.match(page.url(), /focus_distance_m=infinity.*experiment=hyperfocal-focusing/);
    // The sky is a card: no corner of the picture shows what is beside it, the background.
    const shown = await pixels_of(await finished(page, "35 mm"));
    for (const [x, y] of [[0, 0], [0.999, 0], [0, 0.4], [0.999, 0.4]]) {
      const off = rgb_at(shown, x, y).map((value, i) => Math.abs(value - kBackground[i]));
      assert.ok(Math.max(...off) > 12, `${x}, ${y}: ${rgb_at(shown, x, y)}`);
    }
    await page.getByRole("button", { name: "From 5 m" }).click();
    const cell = page.locator('fstop-experiments td[data-name="near"]');
    await cell.waitFor();
    // Near limit at infinity: f^2/(N c), c = diagonal / 1442.
    const wanted_m = 0.035 ** 2 / ((8 * Math.hypot(0.036, 0.024)) / 1442);
    assert.ok(Math.abs(Number.parseFloat(await cell.innerText()) / wanted_m - 1) < 5e-3);
    assert.match(await text_of(page.locator("fstop-experiments")), /Right\./);
    await page.getByRole("button", { name: "Next step" }).click();
    await page.reload();
    await page.locator("fstop-experiments .choices").waitFor();
    assert.match(await text_of(page.locator("fstop-experiments")), /Step 2 of 2/);
    assert.match(page.url(), /focus_distance_m=5\.14.*step=2/);
  });
});

describe("exports", { timeout: 600_000 }, () => {
  const shared = use_page();

  it("are the same picture: PNG, EXR, and by curl and Python", async () => {
    const { page } = shared;
    await open(shared, kDraft);
    await finished(page);
    await open_tab(page, "Share");
    const file = async (name) => {
      const download = page.waitForEvent("download");
      await page.locator("fstop-share").getByText(name, { exact: true }).click();
      return readFile(await (await download).path());
    };
    const png = await file("PNG");
    assert.equal(png.subarray(1, 4).toString(), "PNG");
    const exr = await file("EXR");
    assert.equal(exr.readInt32LE(0), 20000630);
    for (const name of ["R\0", "Z\0", "coc.signed\0"]) assert.ok(exr.includes(name), name);
    assert.match((await file("CSV of the optics")).toString(), /^object_distance_m,.*\n0\.5,/);

    const folder = await mkdtemp(join(tmpdir(), "fstop-share-"));
    try {
      const command = await page.locator("fstop-share pre.curl").innerText();
      await run("sh", ["-c", command], { cwd: folder, timeout: kPicture_ms });
      assert.ok(png.equals(await readFile(join(folder, "picture.png"))), "curl");
      await rm(join(folder, "picture.png"));
      await writeFile(join(folder, "call.py"), await page.locator("fstop-share pre.python").innerText());
      const { stdout } = await run("python3", ["call.py"], { cwd: folder, timeout: kPicture_ms });
      assert.match(stdout, /lens-reconstruction estimate=/);
      assert.ok(png.equals(await readFile(join(folder, "picture.png"))), "Python");
    } finally {
      await rm(folder, { recursive: true, force: true });
    }
    const link = await page.locator("fstop-share pre.link").innerText();
    const text = new URLSearchParams(new URL(link).hash.slice(1));
    for (const [name, value] of new URLSearchParams(new URL(page.url()).hash.slice(1)))
      assert.equal(text.get(name), value);
  });

  it("of a plot are an SVG file that stands alone", async () => {
    const { page } = shared;
    await open(shared, kDraft);
    await open_tab(page, "Plots");
    await page.locator("fstop-plot svg.plot").waitFor();
    const download = page.waitForEvent("download");
    await page.locator("fstop-plot").getByRole("button", { name: "SVG" }).click();
    const svg = await readFile(await (await download).path(), "utf8");
    // Not `match`: a failure would print the whole file.
    assert.ok(/^<svg [^>]*xmlns="http:\/\/www\.w3\.org\/2000\/svg"/.test(svg));
    assert.ok(!/class=|var\(/.test(svg));
    assert.ok(/stroke="rgb\(31, 111, 159\)"/.test(svg));
  });
});
