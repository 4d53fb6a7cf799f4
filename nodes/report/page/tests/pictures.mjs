// Pictures of report pages as a user sees them: `node tests/pictures.mjs DIR PAGE.html...` writes, for each page, its top and the whole of it,
// 1300 and 390 pixels wide, light and dark.

import { mkdirSync } from "node:fs";
import { basename, join, resolve } from "node:path";
import { pathToFileURL } from "node:url";
import { launch } from "./browser.mjs";

const [folder, ...pages] = process.argv.slice(2);
mkdirSync(folder, { recursive: true });
const browser = await launch();
for (const page of pages) {
  for (const width of [1300, 390]) {
    for (const colorScheme of ["light", "dark"]) {
      const isPhone = width < 500;
      const context = await browser.newContext({ viewport: { width, height: isPhone ? 844 : 900 }, colorScheme, hasTouch: isPhone, isMobile: isPhone });
      const tab = await context.newPage();
      await tab.goto(pathToFileURL(resolve(page)).href);
      if (await tab.locator("#viewer").count()) {
        await tab.waitForFunction(() => document.documentElement.dataset.viewer);
        await tab.waitForFunction(() => {
          const status = document.querySelector(".status");
          return !status || status.dataset.drawn === status.dataset.total;
        });
      }
      const name = (part) => join(folder, `${basename(page, ".html")}-${width}-${colorScheme}-${part}.png`);
      await tab.screenshot({ path: name("top") });
      await tab.screenshot({ path: name("whole"), fullPage: true });
      await context.close();
    }
  }
}
await browser.close();
