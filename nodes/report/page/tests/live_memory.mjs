// The memory of the live page while it is open: `node tests/live_memory.mjs URL MINUTES` opens a live view and prints, each half minute, what the
// page's heap, its documents and its browser processes hold. No part of the gate, since it takes as long as it is told.

import { readdirSync, readFileSync } from "node:fs";
import { launch } from "./browser.mjs";

const [url, minutes] = process.argv.slice(2);
const SAMPLE_MS = 30_000;
const MIB = 1024 * 1024;

/** The resident memory of this process's children and their children. */
function resident_mib() {
  const processes = readdirSync("/proc").filter((name) => /^\d+$/.test(name)).flatMap((pid) => {
    try {
      const status = readFileSync(`/proc/${pid}/status`, "utf8");
      const of = (key) => Number(status.match(new RegExp(`^${key}:\\s+(\\d+)`, "m"))?.[1] ?? 0);
      return [{ pid: Number(pid), parent: of("PPid"), kib: of("VmRSS") }];
    } catch {
      return []; // it has ended
    }
  });
  const own = new Set([process.pid]);
  for (let before = 0; before !== own.size; ) {
    before = own.size;
    for (const { pid, parent } of processes) if (own.has(parent)) own.add(pid);
  }
  return processes.filter(({ pid }) => own.has(pid) && pid !== process.pid).reduce((sum, { kib }) => sum + kib, 0) / 1024;
}

const browser = await launch();
const page = await browser.newPage({ viewport: { width: 1000, height: 700 } });
await page.goto(url);
const session = await page.context().newCDPSession(page);
await session.send("Performance.enable");
for (let sample = 0; sample <= (Number(minutes) * 60_000) / SAMPLE_MS; sample += 1) {
  await session.send("HeapProfiler.collectGarbage");
  const { metrics } = await session.send("Performance.getMetrics");
  const of = (name) => metrics.find((metric) => metric.name === name).value;
  const shown = await page.evaluate(() => document.querySelector(".status")?.dataset.shown ?? 0);
  console.log(`${((sample * SAMPLE_MS) / 60_000).toFixed(1)} min: heap ${(of("JSHeapUsedSize") / MIB).toFixed(1)} MiB, ${of("Nodes")} nodes, ` +
    `${of("JSEventListeners")} listeners, browser ${resident_mib().toFixed(0)} MiB, ${shown} points`);
  await page.waitForTimeout(SAMPLE_MS);
}
await browser.close();
