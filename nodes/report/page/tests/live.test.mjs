// The live view in a browser, served by the made-up graph of the crate live-view: test.sh sets MADE_UP to its program. Every wait is for a
// condition.

import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { once } from "node:events";
import { createInterface } from "node:readline";
import { after, before, test } from "node:test";
import { setTimeout } from "node:timers/promises";
import { launch } from "./browser.mjs";
import { freeDomain } from "./domain.mjs";

const WAIT_MS = 120_000;
/** What hangs is to end. */
const LONGEST_MS = 900_000;
const AGAIN_MS = 500;
let browser, graph, place;

/** Starts the graph; resolves with the address of its page. */
async function start(port) {
  const env = { ...process.env, ROS_DOMAIN_ID: String(place.domain), ROS_AUTOMATIC_DISCOVERY_RANGE: "LOCALHOST" };
  // Whoever was given the port since the last graph had it lets go of it again.
  for (;;) {
    graph = spawn(process.env.MADE_UP, [`127.0.0.1:${port}`], { env, stdio: ["ignore", "pipe", "inherit"] });
    const ended = once(graph, "exit").then(() => null);
    const line = await Promise.race([once(createInterface({ input: graph.stdout }), "line"), ended]);
    if (line) return new URL(line[0]);
    await setTimeout(AGAIN_MS);
  }
}

async function stop() {
  if (graph.exitCode !== null) return graph.exitCode;
  graph.kill("SIGINT");
  const [code] = await once(graph, "exit");
  return code;
}

before(async () => {
  place = await freeDomain();
  browser = await launch();
});
after(async () => {
  await stop();
  place.guard.close();
  await browser.close();
});

const shown = (page) => page.evaluate(() => Number(document.querySelector(".status").dataset.shown ?? 0));
const grown = (page, beyond) => page.waitForFunction((least) => Number(document.querySelector(".status")?.dataset.shown) > least, beyond, { timeout: WAIT_MS });

test("the live view", { timeout: LONGEST_MS }, async (t) => {
  const url = await start(0);
  const context = await browser.newContext({ viewport: { width: 1300, height: 900 } });
  const page = await context.newPage();
  page.setDefaultTimeout(WAIT_MS);
  const faults = [];
  const others = [];
  page.on("console", (message) => ["error", "warning"].includes(message.type()) && !/GPU stall|swiftshader/i.test(message.text()) && faults.push(message.text()));
  page.on("pageerror", (error) => faults.push(error.message));
  page.on("request", (request) => new URL(request.url()).host !== url.host && others.push(request.url()));
  let confirms = true;
  const asked = [];
  page.on("dialog", (dialog) => {
    asked.push(dialog.message());
    return confirms ? dialog.accept() : dialog.dismiss();
  });
  await page.goto(url.href);

  await t.test("shows the map as it grows, and what moves", async () => {
    await grown(page, 0);
    await grown(page, await shown(page));
    await page.waitForFunction(() => document.querySelector(".scene").dataset.moment > 0);
    assert.equal(await page.locator("#connection").innerText(), "connected");
    await page.waitForFunction(() => /#3/.test(document.querySelector(".moment-facts").textContent));
    assert.match(await page.locator(".panels").innerText(), /orange moves \([1-9]/);
    assert.match(await page.locator(".moment-facts").innerText(), /zones\s+-17 to 17°/);
    const colours = await page.evaluate(() => {
      const canvas = document.querySelector(".scene");
      const copy = Object.assign(document.createElement("canvas"), { width: 200, height: 150 });
      const context = copy.getContext("2d");
      context.drawImage(canvas, 0, 0, 200, 150);
      return new Set(new Uint32Array(context.getImageData(0, 0, 200, 150).data.buffer)).size;
    });
    assert.ok(colours > 20, `the 3D view draws: ${colours} colours`);
  });

  await t.test("shows triangles while they are asked for", async () => {
    const triangles = () => page.evaluate(() => Number(document.querySelector(".status").dataset.triangles));
    assert.equal(await triangles(), 0);
    const isMade = () => page.waitForFunction(() => /mesh is made/.test(document.querySelector(".nodes").textContent));
    await page.waitForFunction(() => /no mesh/.test(document.querySelector(".nodes").textContent));
    await page.locator('[data-layer="mesh"]').check();
    await page.waitForFunction(() => Number(document.querySelector(".status").dataset.triangles) > 0);
    const before = await triangles();
    await page.waitForFunction((least) => Number(document.querySelector(".status").dataset.triangles) > least, before);
    assert.match(await page.locator(".status").innerText(), /points.* triangles$/);
    await isMade();
    await page.locator('[data-layer="mesh"]').uncheck();
    await page.waitForFunction(() => Number(document.querySelector(".status").dataset.triangles) === 0);
    await page.waitForFunction(() => /no mesh/.test(document.querySelector(".nodes").textContent));
  });

  await t.test("shows names that are markup as text", async () => {
    await page.waitForFunction(() => /onerror/.test(document.querySelector(".nodes").textContent));
    assert.ok((await page.locator(".nodes").innerText()).includes("<script>document.title='taken'</script>"));
    await page.locator(".figures details summary", { hasText: "onerror" }).click();
    await page.waitForFunction(() => document.querySelector(".figures details[open] td")?.textContent.includes("<img"));
    assert.equal(await page.locator("img").count(), 0);
    assert.match(await page.title(), /^stillmap/);
  });

  await t.test("calls the services of the nodes", async () => {
    const press = async (name, answer) => {
      await page.getByRole("button", { name }).click();
      await page.waitForFunction((text) => document.querySelector(".command-result").textContent.includes(text), answer);
    };
    await press("Save map", "saved \"><img");
    // Only the map is not emptied without being asked.
    assert.deepEqual(asked, []);
    confirms = false;
    await page.getByRole("button", { name: "Empty map" }).click();
    assert.match(asked.at(-1), /Empty the map\?/);
    assert.match(await page.locator(".command-result").innerText(), /^saved/);
    confirms = true;
    await press("Empty map", "it is <i>not</i> emptied");
    // Regression: the detection of another robot, which is paused and comes first by name, was taken for this one's.
    await page.waitForFunction(() => /another_robot/.test(document.querySelector(".nodes").textContent));
    await press("Pause detection", "detection paused");
    await press("Resume detection", "detection goes on");
    // A node that is slow to answer is left out.
    const read = page.getByRole("button", { name: "Read the parameters" });
    do {
      await read.click();
      await page.waitForFunction((button) => !button.disabled, await read.elementHandle());
    } while (!(await page.locator(".parameters summary").count()));
    await page.locator(".parameters summary").click();
    const field = page.getByLabel("detection reach_m");
    const note = (text) => page.waitForFunction((end) => [...document.querySelectorAll(".note")].some((one) => one.textContent.includes(end)), text);
    await field.fill("4.5");
    await field.press("Enter");
    await note("reach_m is set");
    await field.fill("50");
    await field.press("Enter");
    await note("must be");
    assert.ok((await page.locator(".parameters").innerText()).includes("<b>with markup</b>"));
  });

  await t.test("comes back after a restart of the program", async () => {
    assert.equal(await stop(), 0);
    await page.waitForFunction(() => document.querySelector("#connection").dataset.state === "lost");
    const before = await shown(page);
    assert.ok(before > 0, "what was shown stays");
    await start(url.port);
    await page.waitForFunction(() => document.querySelector("#connection").dataset.state === "connected");
    // The other graph begins with an empty map.
    await page.waitForFunction((former) => {
      const { shown: now } = document.querySelector(".status").dataset;
      return Number(now) > 0 && Number(now) !== former;
    }, before);
  });

  await t.test("comes back when its tab wakes after the program was started again", async () => {
    const session = await context.newCDPSession(page);
    await session.send("Page.setWebLifecycleState", { state: "frozen" });
    assert.equal(await stop(), 0);
    await start(url.port);
    await session.send("Page.setWebLifecycleState", { state: "active" });
    await page.waitForFunction(() => document.querySelector("#connection").dataset.state === "connected");
    await grown(page, await shown(page));
    await session.detach();
  });

  await t.test("is as wide as a phone", async () => {
    await page.setViewportSize({ width: 390, height: 844 });
    const [page_px, window_px] = await page.evaluate(() => [document.documentElement.scrollWidth, window.innerWidth]);
    assert.ok(page_px <= window_px, `${page_px} of ${window_px}`);
  });

  // A connection that is refused while the program is away is the browser's own line.
  assert.deepEqual(faults.filter((text) => !/WebSocket connection to .* failed/.test(text)), []);
  assert.deepEqual(others, []);
  await context.close();
});
