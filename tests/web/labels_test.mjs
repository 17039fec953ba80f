// The letters of drawings: large enough to be read, and apart from each other and from the lines.
import assert from "node:assert/strict";
import { describe, it } from "node:test";
import { choose, eventually, kDraft, kPicture_ms, open, open_tab, use_page } from "./harness.mjs";

const kLeast_px = 11;
const kWidths = [1200, 360];

/// Every text of a drawing by its box, every mark's words that a series or symbol passes through,
/// and texts that leave the drawing.
function faults_of_plot(page) {
  return page.locator("fstop-plot").evaluate((host) => {
    const svg = host.shadowRoot.querySelector("svg.plot");
    const frame = svg.getBoundingClientRect();
    const texts = [...svg.querySelectorAll("text")].map((text) => ({
      said: text.textContent.trim(),
      is_mark: text.classList.contains("mark"),
      box: text.getBoundingClientRect(),
    }));
    const apart = (a, b) =>
      a.right <= b.left || b.right <= a.left || a.bottom <= b.top || b.bottom <= a.top;
    const faults = [];
    for (const { said, box } of texts)
      if (box.left < frame.left - 1 || box.right > frame.right + 1 || box.top < frame.top - 1)
        faults.push(`"${said}" leaves the drawing`);
    texts.forEach((one, i) => {
      for (const other of texts.slice(i + 1))
        if (!apart(one.box, other.box)) faults.push(`"${one.said}" touches "${other.said}"`);
    });
    // A letter's box is taller than the letter: by a quarter at either end.
    const inner = ({ left, right, top, bottom, height }) => ({
      left,
      right,
      top: top + height / 4,
      bottom: bottom - height / 4,
    });
    const at = (path, length) => {
      const { x, y } = path.getPointAtLength(length).matrixTransform(path.getScreenCTM());
      return { left: x, right: x, top: y, bottom: y };
    };
    for (const { said, box } of texts.filter(({ is_mark }) => is_mark)) {
      for (const path of svg.querySelectorAll("path.line"))
        for (let length = 0; length < path.getTotalLength(); length += 2)
          if (!apart(inner(box), at(path, length))) {
            faults.push(`"${said}" lies on the line of ${path.dataset.series}`);
            break;
          }
      for (const symbol of svg.querySelectorAll("path.dots, path.rings"))
        if (!apart(inner(box), symbol.getBoundingClientRect()))
          faults.push(`"${said}" lies on a symbol of ${symbol.dataset.series}`);
      for (const line of svg.querySelectorAll("line.mark"))
        if (!apart(inner(box), line.getBoundingClientRect()))
          faults.push(`"${said}" lies on another mark's line`);
    }
    return faults;
  });
}

/// The smallest letters on the page, as large as they are on the screen, and what they say.
function smallest_letters(page) {
  return page.evaluate(() => {
    let smallest = { px: Number.POSITIVE_INFINITY, said: "" };
    const visit = (root) => {
      for (const element of root.querySelectorAll("*")) {
        if (element.shadowRoot) visit(element.shadowRoot);
        const said = [...element.childNodes]
          .filter((node) => node.nodeType === Node.TEXT_NODE)
          .map((node) => node.data.trim())
          .join("");
        if (said === "" || element.getClientRects().length === 0) continue;
        const scale = element.ownerSVGElement ? (element.getScreenCTM()?.a ?? 1) || 1 : 1;
        const turned = element.ownerSVGElement ? Math.abs(element.getScreenCTM()?.b ?? 0) : 0;
        const px = Number.parseFloat(getComputedStyle(element).fontSize) * Math.max(scale, turned);
        if (px < smallest.px) smallest = { px, said };
      }
    };
    visit(document);
    return smallest;
  });
}

describe("letters", { timeout: 600_000 }, () => {
  const shared = use_page();

  for (const width of kWidths)
    it(`of plots touch nothing, ${width} px wide`, async () => {
      const { page } = shared;
      await page.setViewportSize({ width, height: 900 });
      await open(shared, kDraft.replace("1.4", "2"));
      await open_tab(page, "Plots");
      await page.locator("fstop-plot svg.plot").waitFor();
      const told = page.locator("fstop-plots").getByRole("status");
      await eventually(() => told.innerText(), (text) => /Measured at/.test(text), kPicture_ms);
      assert.deepEqual(await faults_of_plot(page), [], "blur");
      const caption = page.locator("fstop-plot figcaption");
      for (const [name, title] of [
        ["Contrast (MTF)", /Contrast that is left/],
        ["Pinhole size", /Spot of a point/],
      ]) {
        await choose(page, name);
        await eventually(() => caption.innerText(), (text) => title.test(text));
        assert.deepEqual(await faults_of_plot(page), [], name);
        assert.ok((await smallest_letters(page)).px >= kLeast_px);
      }
      await choose(page, "Speed and accuracy");
      await page.getByRole("button", { name: /every method/ }).click();
      await page.locator("fstop-plots .reasons").waitFor({ timeout: kPicture_ms });
      assert.deepEqual(await faults_of_plot(page), [], "speed");
    });

  for (const width of [...kWidths, 2100])
    it(`are nowhere smaller than ${kLeast_px} px, ${width} px wide`, async () => {
      const { page } = shared;
      await page.setViewportSize({ width, height: 900 });
      await open(shared, kDraft);
      for (const name of ["Optics", "Gallery", "Plots", "Experiments", "How it was made", "Share"]) {
        await open_tab(page, name);
        if (name === "Plots") await page.locator("fstop-plot svg.plot").waitFor();
        const { px, said } = await smallest_letters(page);
        assert.ok(px >= kLeast_px, `${name}: "${said}" has ${px} px`);
      }
    });

  it("of the side view's scale stand side by side", async () => {
    const { page } = shared;
    for (const [width, height] of [...kWidths.map((width) => [width, 900]), [3840, 2160]]) {
      await page.setViewportSize({ width, height });
      await open(shared, kDraft);
      const [lens, end] = await page.locator("fstop-side-view").evaluate((host) => {
        const svg = host.shadowRoot.querySelector("svg");
        return [svg.querySelector("text.name"), svg].map((one) => one.getBoundingClientRect().top);
      });
      assert.ok(lens >= end - 3, `${width}: the lens's name begins ${end - lens} px above`);
      const gaps = await page.locator("fstop-side-view").evaluate((host) => {
        const boxes = [...host.shadowRoot.querySelectorAll(".tick")].map((text) =>
          text.getBoundingClientRect(),
        );
        boxes.sort((a, b) => a.left - b.left);
        return boxes.slice(1).map((box, i) => box.left - boxes[i].right);
      });
      assert.ok(gaps.length > 3 && Math.min(...gaps) >= 4, `${width}: ${gaps}`);
    }
  });
});
