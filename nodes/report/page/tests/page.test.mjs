// The report page in a browser, from files and over HTTP: test.sh sets PAGES to the folder of pages. Every wait is for a condition.

import assert from "node:assert/strict";
import { createReadStream, existsSync } from "node:fs";
import { createServer } from "node:http";
import { join, resolve } from "node:path";
import { after, before, test } from "node:test";
import { pathToFileURL } from "node:url";
import { launch } from "./browser.mjs";

const PAGES = resolve(process.env.PAGES);
const DEMO = join(PAGES, "demo.html");
/** Ten million points take a fifth of a minute to be shown at rest, and a busy machine many times as long. */
const WAIT_MS = 600_000;
/** As on a machine whose frames take so long. */
const SLOW_FRAMES_MS = Number(process.env.SLOW_FRAMES_MS ?? 0);
let browser;

before(async () => (browser = await launch()));
after(() => browser.close());

/** Opens an address, and waits until the page shows all points. Whatever the page logs is an error. */
async function open(address, { from = browser, viewer = "ready", ...options } = {}) {
  const context = await from.newContext({ viewport: { width: 1000, height: 800 }, ...options });
  const page = await context.newPage();
  page.setDefaultTimeout(WAIT_MS);
  const faults = [];
  page.on("console", (message) => ["error", "warning"].includes(message.type()) && !isOfDriver(message.text()) && faults.push(message.text()));
  page.on("pageerror", (error) => faults.push(String(error)));
  page.on("request", (request) => request.url() !== page.url() && !/^(blob|data):/.test(request.url()) && !request.isNavigationRequest() &&
    !request.url().endsWith("/favicon.ico") && faults.push(`request of ${request.url()}`));
  if (SLOW_FRAMES_MS > 0) await page.addInitScript(slowFrames, SLOW_FRAMES_MS);
  await page.goto(address, { timeout: WAIT_MS });
  await page.waitForFunction((state) => document.documentElement.dataset.viewer === state, viewer);
  if (viewer === "ready") await complete(page);
  return { page, faults, close: () => context.close() };
}

/** Has each frame of a page come later. */
function slowFrames(later_ms) {
  const next = window.requestAnimationFrame.bind(window);
  window.requestAnimationFrame = (draw) => next(() => setTimeout(() => draw(performance.now()), later_ms));
}

/** The software renderer's own remarks on its speed, of which the page knows nothing. */
function isOfDriver(text) {
  return /GPU stall due to ReadPixels|GL Driver Message|favicon/.test(text);
}

const file = (name) => pathToFileURL(join(PAGES, name)).href;

/** Waits until the view shows all of its points, after all that the page was told. */
function complete(page) {
  return page.waitForSelector("canvas.scene[data-rests]");
}

/** Waits for so many frames. */
function frames(page, count) {
  return page.evaluate(async (left) => {
    for (; left > 0; left -= 1) await new Promise(requestAnimationFrame);
  }, count);
}

/** A sum over the pixels of a canvas that differs when the picture does. */
async function pixels(page, selector) {
  await complete(page);
  return page.evaluate((of) => {
    const canvas = document.querySelector(of);
    const copy = Object.assign(document.createElement("canvas"), { width: 200, height: 150 });
    const context = copy.getContext("2d");
    context.drawImage(canvas, 0, 0, 200, 150);
    return context.getImageData(0, 0, 200, 150).data.reduce((sum, value) => (Math.imul(sum, 31) + value) | 0, 7);
  }, selector);
}

/** The sum of a picture that is none of those before, once it is drawn. */
async function changed(page, before, what) {
  const began_ms = Date.now();
  for (;;) {
    const now = await pixels(page, ".scene");
    if (!before.includes(now)) return now;
    assert.ok(Date.now() - began_ms < WAIT_MS, `${what} changes the picture`);
  }
}

async function moment(page, index) {
  await page.locator(".moment").fill(String(index));
  await page.waitForFunction((at) => document.querySelector("canvas.scene").dataset.moment === at, String(index));
}

test("the page opens from a file and over HTTP without an error or a request", async () => {
  const server = createServer((request, response) => {
    if (request.url !== "/room.html") return response.writeHead(404).end();
    response.setHeader("content-type", "text/html; charset=utf-8");
    createReadStream(join(PAGES, "room.html")).pipe(response);
  });
  await new Promise((listening) => server.listen(0, "127.0.0.1", listening));
  for (const address of [file("room.html"), `http://127.0.0.1:${server.address().port}/room.html`]) {
    const { faults, close } = await open(address);
    assert.deepEqual(faults, []);
    await close();
  }
  server.close();
});

test("the picture changes when it is turned, walked through, cut, and when layers are switched", async () => {
  const { page, faults, close } = await open(file("room.html"));
  const seen = [await pixels(page, ".scene")];
  const changes = async (what) => seen.push(await changed(page, seen, what));
  const box = await page.locator(".scene").boundingBox();
  await page.mouse.move(box.x + 300, box.y + 200);
  await page.mouse.down();
  await page.mouse.move(box.x + 420, box.y + 230, { steps: 4 });
  await page.mouse.up();
  await changes("dragging");
  await page.locator(".scene").focus();
  await page.keyboard.press("BracketLeft");
  await changes("the key [");
  for (const layer of await page.locator("[data-layer]").all()) {
    const [name, shown] = [await layer.getAttribute("data-layer"), await layer.isChecked()];
    await layer.setChecked(!shown);
    // Some of what is switched is hidden by nothing at the last moment but is not there either.
    if (["map", "removed", "path", "scan", "cloud", "kept-out-moved", "kept-out-seen_through"].includes(name)) await changes(name);
    await layer.setChecked(shown);
  }
  await page.getByLabel("Not above").fill("1");
  await changes("a height");
  await page.getByLabel("Size").fill("3");
  await changes("the size");
  await page.getByRole("button", { name: "Walk" }).click();
  await changes("walking");
  await page.keyboard.down("KeyW");
  // While it goes on, a slow machine never shows all points.
  await frames(page, 5);
  await page.keyboard.up("KeyW");
  await changes("having gone");
  assert.deepEqual(faults, []);
  await close();
});

test("a map with colours is drawn in them, and by height where that is chosen", async () => {
  const coloured = await open(file("coloured.html"));
  const { page } = coloured;
  const colour = page.locator(".settings select");
  assert.deepEqual(await colour.locator("option").allTextContents(), ["as seen", "by height"]);
  // The walls are 2.4 m high, under a white ceiling.
  const height = page.getByLabel("Not above");
  assert.ok((await height.inputValue()) <= 2.4 && (await height.inputValue()) >= 2.2);
  assert.match(await page.locator(".settings").innerText(), /The ceiling is cut off/);
  const shares = () => page.evaluate(() => {
    const canvas = document.querySelector("canvas.scene");
    const copy = Object.assign(document.createElement("canvas"), { width: 200, height: 150 });
    const context = copy.getContext("2d");
    context.drawImage(canvas, 0, 0, 200, 150);
    const { data } = context.getImageData(0, 0, 200, 150);
    let [red, blue, white] = [0, 0, 0];
    for (let at = 0; at < data.length; at += 4) {
      if (data[at] > 2 * data[at + 1] + 20 && data[at] > 2 * data[at + 2] + 20) red += 1;
      if (Math.min(data[at], data[at + 1], data[at + 2]) > 150) white += 1;
      if (data[at + 2] > 2 * data[at] + 20 && data[at + 2] > 2 * data[at + 1] + 20) blue += 1;
    }
    return { red, blue, white };
  });
  await complete(page);
  const seen = await shares();
  assert.ok(seen.red > 300 && seen.blue > 300, JSON.stringify(seen));
  await height.fill("2.45");
  await complete(page);
  const under = await shares();
  assert.ok(under.white > seen.white + 500, `the ceiling is there: ${JSON.stringify([seen, under])}`);
  await height.fill("2.2");
  await complete(page);
  const before = await pixels(page, "canvas.scene");
  await colour.selectOption("0");
  assert.notEqual(await pixels(page, "canvas.scene"), before);
  assert.ok((await shares()).red < seen.red / 4);
  assert.deepEqual(coloured.faults, []);
  await coloured.close();
  const plain = await open(file("room.html"));
  assert.equal(await plain.page.locator(".settings select").count(), 0);
  assert.doesNotMatch(await plain.page.locator(".settings").innerText(), /ceiling/);
  await plain.close();
});

test("triangles are a layer that is switched on, and say that they are coarser than the map's", async () => {
  const { page, faults, close } = await open(file("meshed.html"));
  const layer = page.locator("[data-layer=mesh]");
  assert.equal(await layer.isChecked(), false);
  const [, carried, total] = (await page.locator("label", { has: layer }).innerText()).match(/triangles: ([\d,]+), made coarser from ([\d,]+)/);
  const number = (text) => Number(text.replaceAll(",", ""));
  assert.equal(number(total), 20_000);
  assert.ok(number(carried) > 5000 && number(carried) <= 15_000, carried);
  // Nothing else is shown: the floor fills the middle of the view from above without a gap.
  for (const other of await page.locator("[data-layer]").all()) await other.setChecked(false);
  await page.getByRole("button", { name: "From above" }).click();
  // Without points the status says nothing of what is drawn.
  const drawn = () => page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
  await drawn();
  const empty = await pixels(page, ".scene");
  await layer.setChecked(true);
  const withTriangles = await changed(page, [empty], "the triangles");
  const background = await page.evaluate(() => {
    const canvas = document.querySelector("canvas.scene");
    const copy = Object.assign(document.createElement("canvas"), { width: 40, height: 40 });
    const context = copy.getContext("2d");
    context.drawImage(canvas, canvas.width / 2 - 20, canvas.height / 2 - 20, 40, 40, 0, 0, 40, 40);
    const { data } = context.getImageData(0, 0, 40, 40);
    return data.filter((value, at) => at % 4 === 2 && value < 60).length;
  });
  assert.equal(background, 0);
  await layer.setChecked(false);
  assert.equal(await changed(page, [withTriangles], "no triangles"), empty);
  assert.deepEqual(faults, []);
  await close();
});

test("a moment is shown in the view, the scan, the depth image, the figures and the charts", async () => {
  const { page, faults, close } = await open(file("room.html"));
  const state = async () => [
    await pixels(page, ".panels canvas"), await pixels(page, ".depth"),
    await page.locator(".moment-facts").innerText(), await page.locator("svg .cursor").first().getAttribute("x1"),
  ];
  const scenes = [await pixels(page, ".scene")];
  await moment(page, 10);
  scenes.push(await changed(page, scenes, "the moment"));
  const ten = await state();
  await moment(page, 25);
  await changed(page, scenes, "another moment");
  const other = await state();
  ten.forEach((shown, n) => assert.notEqual(shown, other[n], `part ${n} follows the moment`));
  await moment(page, 10);
  assert.deepEqual(await state(), ten, "and comes back to what it was");

  // Pointing at one chart marks the moment in all of them.
  const charts = page.locator("svg[data-time]");
  await charts.first().scrollIntoViewIfNeeded();
  const box = await charts.first().boundingBox();
  await page.mouse.move(box.x + box.width * 0.8, box.y + box.height / 2);
  await page.waitForFunction(() => document.querySelector("canvas.scene").dataset.moment > 25);
  const cursors = await page.locator("svg .cursor").evaluateAll((lines) => lines.map((line) => line.getAttribute("x1")));
  assert.equal(new Set(cursors).size, 1);
  assert.equal(cursors.length, await charts.count());

  // Played to its end.
  await page.getByLabel("Speed").selectOption("30");
  await page.locator(".play").click();
  await page.waitForFunction(() => document.querySelector("canvas.scene").dataset.moment === "39");
  assert.equal(await page.locator(".play").innerText(), "Play");
  assert.deepEqual(faults, []);
  await close();
});

test("a distance is measured by the keyboard and the pointer", async () => {
  const { page, faults, close } = await open(file("room.html"));
  await page.getByRole("button", { name: "From above" }).click();
  await complete(page);
  await page.getByRole("button", { name: "Measure" }).click();
  await page.keyboard.press("Enter");
  await page.waitForFunction(() => document.querySelector(".result").textContent.startsWith("From"));
  const box = await page.locator(".scene").boundingBox();
  await page.mouse.click(box.x + box.width / 2 - 100, box.y + box.height / 2);
  const text = await page.locator(".result").innerText();
  // Both on the floor, seen from straight above.
  const [, length, level, height] = text.match(/^([\d.]+) m \(([\d.]+) m on the level, ([\d.]+) m in height\)$/).map(Number);
  assert.ok(length > 0.3 && length < 5 && Math.abs(length - level) < 0.05 && height < 0.1, text);
  assert.deepEqual(faults, []);
  await close();
});

test("the view is saved as a picture", async () => {
  const { page, close } = await open(file("room.html"));
  const [download] = await Promise.all([page.waitForEvent("download"), page.getByRole("button", { name: "Picture" }).click()]);
  assert.equal(download.suggestedFilename(), "room.mcap.png");
  await close();
});

test("names that are markup are shown as text", async () => {
  const { page, faults, close } = await open(file("hostile.html"));
  assert.ok((await page.title()).includes("<script>"));
  assert.equal(await page.locator("img[src='x']").count(), 0);
  assert.ok((await page.locator("h1").innerText()).includes("<script>document.title='taken'</script>"));
  const width = await page.evaluate(() => [document.documentElement.scrollWidth, document.documentElement.clientWidth]);
  assert.ok(width[0] <= width[1], `the page is not wider than the window: ${width}`);
  assert.deepEqual(faults, []);
  await close();
});

test("without WebGL the pictures and tables are there", async () => {
  const without = await launch({ webgl: false });
  const { page, faults, close } = await open(file("room.html"), { from: without, viewer: "none" });
  assert.match(await page.locator("#viewer").innerText(), /no 3D/);
  assert.equal(await page.locator("canvas").count(), 0);
  assert.ok((await page.locator("figure img").count()) >= 6);
  for (const image of await page.locator("figure img").all()) {
    assert.ok(await image.evaluate((picture) => picture.complete && picture.naturalWidth > 0 && picture.alt.length > 10));
  }
  assert.deepEqual(faults.filter((text) => !/WebGL/.test(text)), []);
  await close();
  await without.close();
});

test("ten million points are turned with fewer, and shown all at rest", async () => {
  const { page, faults, close } = await open(file("large.html"));
  const total = Number(await page.locator(".status").getAttribute("data-total"));
  assert.ok(total >= 10_000_000);
  const frames = await page.evaluate(async () => {
    const scene = document.querySelector(".scene");
    const drawn = [];
    for (let frame = 0; frame < 40; frame += 1) {
      scene.dispatchEvent(new KeyboardEvent("keydown", { code: "BracketLeft" }));
      await new Promise(requestAnimationFrame);
      drawn.push({ at_ms: performance.now(), points: Number(document.querySelector(".status").dataset.drawn) });
    }
    return drawn;
  });
  const last = frames.slice(-11);
  // How fast it is depends on the machine; `detail.test.mjs` has what the page makes of it.
  const rate = (10_000 / (last.at(-1).at_ms - last[0].at_ms)).toFixed(1);
  console.log(`ten million points: ${rate} frames a second with ${last.at(-1).points} points while it is turned`);
  assert.ok(last.every(({ points }) => points < total && points >= 5000), "detail is lower in motion");
  await complete(page);
  assert.deepEqual(faults, []);
  await close();
});

// Regression: a table without a scroll bar made the page wider than a narrow phone.
test("a phone gets fewer points and a page as wide as itself", async () => {
  // The narrowest that WCAG 2.1 asks for (1.4.10, reflow).
  const phone = { viewport: { width: 320, height: 844 }, hasTouch: true, isMobile: true };
  const { page, faults, close } = await open(file("large.html"), phone);
  const total = Number(await page.locator(".status").getAttribute("data-total"));
  assert.ok(total > 100_000 && total < 1_300_000, String(total));
  const width = await page.evaluate(() => [document.documentElement.scrollWidth, window.innerWidth]);
  assert.ok(width[0] <= width[1], `${width}`);
  assert.equal(await page.locator(".scroll:not([tabindex='0'])").count(), 0, "the keyboard scrolls, too");
  assert.deepEqual(faults, []);
  await close();
});

test("the demo's page opens", { skip: !existsSync(DEMO) }, async () => {
  const { faults, close } = await open(file("demo.html"));
  assert.deepEqual(faults, []);
  await close();
});
