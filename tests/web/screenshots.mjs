// Pictures of the page for the README, in three sizes: node tests/web/screenshots.mjs FOLDER
import { join } from "node:path";
import { start_browser, start_server } from "./served_page.mjs";

const kPicture_ms = 120_000;
const kAddress =
  "#scene=still-life&camera=lens&focal_length_mm=50&f_number=2&focus_distance_m=2" +
  "&breathing=true&max_error=0.01";
const kViews = [
  { name: "playground-phone", width: 360, height: 780, colorScheme: "light", scale: 2 },
  { name: "playground", width: 1280, height: 1080, colorScheme: "light", scale: 1 },
  { name: "playground-4k", width: 3840, height: 2160, colorScheme: "dark", scale: 1 },
];

const folder = process.argv[2] ?? ".";
const wanted = process.argv.slice(3);
const server = await start_server();
const browser = await start_browser();
try {
  for (const { name, width, height, colorScheme, scale } of kViews) {
    if (wanted.length > 0 && !wanted.includes(name)) continue;
    const page = await browser.newPage({
      viewport: { width, height },
      deviceScaleFactor: scale,
      colorScheme,
      reducedMotion: "reduce",
    });
    await page.goto(server.url + kAddress);
    await page
      .locator('fstop-picture .frame[aria-busy="false"] img')
      .waitFor({ timeout: kPicture_ms });
    await page.screenshot({ path: join(folder, `${name}.jpg`), quality: 82 });
    await page.close();
  }
} finally {
  await browser.close();
  await server.stop();
}
