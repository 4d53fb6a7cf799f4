// Pictures of pages as a user sees them: `node tests/pictures.mjs DIR PAGE...` writes, for each page, its top and the whole of it, 1300 and 390 pixels
// wide, light and dark. A page is a file, or the address of a live view, of which the map is shown once it has grown to a wall.

import { mkdirSync } from "node:fs";
import { basename, join, resolve } from "node:path";
import { pathToFileURL } from "node:url";
import { launch } from "./browser.mjs";

/** Points of a live map that are worth a picture. */
const LIVE_POINTS = 4_000;

const [folder, ...pages] = process.argv.slice(2);
mkdirSync(folder, { recursive: true });
const browser = await launch();
for (const page of pages) {
  const isLive = page.startsWith("http:");
  for (const width of [1300, 390]) {
    for (const colorScheme of ["light", "dark"]) {
      const isPhone = width < 500;
      const context = await browser.newContext({ viewport: { width, height: isPhone ? 844 : 900 }, colorScheme, hasTouch: isPhone, isMobile: isPhone });
      const tab = await context.newPage();
      await tab.goto(isLive ? page : pathToFileURL(resolve(page)).href);
      if (isLive) {
        await tab.waitForFunction((least) => Number(document.querySelector(".status")?.dataset.shown) > least, LIVE_POINTS, { timeout: 120_000 });
        await tab.waitForFunction(() => document.querySelector(".scene").dataset.moment > 0);
      } else if (await tab.locator("#viewer").count()) {
        await tab.waitForFunction(() => document.documentElement.dataset.viewer);
        // A page without WebGL has no canvas.
        await tab.waitForFunction(() => !document.querySelector("canvas.scene:not([data-rests])"));
      }
      const name = (part) => join(folder, `${isLive ? "live" : basename(page, ".html")}-${width}-${colorScheme}-${part}.png`);
      await tab.screenshot({ path: name("top") });
      await tab.screenshot({ path: name("whole"), fullPage: true });
      await context.close();
    }
  }
}
await browser.close();
