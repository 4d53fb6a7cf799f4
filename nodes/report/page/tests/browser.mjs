// Debian's Chromium, on a machine without a graphics card.

import { chromium } from "playwright-core";

const PATH = process.env.CHROMIUM ?? "/usr/bin/chromium";
const OFFLINE = ["--disable-quic", "--no-first-run", "--disable-background-networking", "--disable-component-update", "--disable-sync"];

/** A browser with WebGL 2 by software, or without it. Its profile is new. */
export function launch({ webgl = true } = {}) {
  const graphics = webgl
    ? ["--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"]
    : ["--disable-gpu", "--disable-3d-apis", "--disable-software-rasterizer"];
  return chromium.launch({ executablePath: PATH, headless: true, args: ["--no-sandbox", ...OFFLINE, ...graphics] });
}
