// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Chromium with the page of `ccslice view`, and what tests do with it and see of it.

import { chromium } from "playwright-core";

export const browser = await chromium.launch({ executablePath: "/usr/bin/chromium",
  args: ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"] });
export const context = await browser.newContext({ viewport: { width: 1500, height: 820 }, colorScheme: "light" });
export const page = await context.newPage();
/** What went wrong in pages without anybody seeing it. */
export const errors = [];
context.on("page", watch);
watch(page);

function watch(on) {
  on.on("pageerror", (error) => errors.push(String(error)));
  on.on("console", (line) => {
    if (line.type() === "error" && /Content Security|WebGL/.test(line.text())) errors.push(line.text());
  });
}

/** Polls from outside: the page's policy lets nobody make code from texts in it, which waitForFunction() would do. */
export async function until(condition, what, on = page) {
  const seconds = 60;  // Of a busy machine.
  for (let end = Date.now() + 1000 * seconds; Date.now() < end; await on.waitForTimeout(20)) {
    if (await on.evaluate(condition)) return;
  }
  throw new Error(`no ${what} within ${seconds} s; the page says: ${await on.locator("main").textContent()}; ${errors}`);
}

/** Waits until the full picture of what is asked for is there. Its pixels' sum, colours and size. */
export async function full(on = page) {
  await until(() => document.querySelector("#picture").dataset.stage === "full", "full picture", on);
  return on.evaluate(() => {
    const image = document.querySelector("#picture");
    const canvas = new OffscreenCanvas(image.naturalWidth, image.naturalHeight);
    const context = canvas.getContext("2d");
    context.drawImage(image, 0, 0);
    const { data } = context.getImageData(0, 0, canvas.width, canvas.height);
    let inside = 0, sum = 0;
    const colours = new Set();
    for (let i = 0; i < data.length; i += 4) {
      inside += data[i + 3] > 0;
      sum = (sum * 31 + data[i] + 3 * data[i + 1] + 7 * data[i + 2] + 11 * data[i + 3]) % 1000000007;
      if (data[i + 3] > 0) colours.add("#" + [0, 1, 2].map((k) => data[i + k].toString(16).padStart(2, "0")).join(""));
    }
    const box = image.getBoundingClientRect();
    return { inside, sum, colours: [...colours].sort(), width: canvas.width, height: canvas.height,
      layer: image.dataset.layer, shown: [box.width, box.height] };
  });
}

/** Does something, and waits for the picture that comes of it. */
export async function after(action, on = page) {
  await on.evaluate(() => { document.querySelector("#picture").dataset.stage = "waiting"; });
  await action();
  return full(on);
}

/** A screenshot into the folder. */
export const shot = (name) => page.screenshot({ path: `${process.argv[3]}/${name}.png` });
export const state = async () => JSON.parse(decodeURIComponent((await page.evaluate(() => location.hash)).slice("#view=".length)));
export const middle_of = async (selector) => {
  const box = await page.locator(selector).boundingBox();
  return { ...box, cx: box.x + box.width / 2, cy: box.y + box.height / 2 };
};
export async function drag(from, by) {
  await page.mouse.move(from.x, from.y);
  await page.mouse.down();
  await page.mouse.move(from.x + by.x, from.y + by.y, { steps: 6 });
  await page.mouse.up();
}
export const bars = () => page.evaluate(() => {
  const canvas = document.querySelector("#histogram"), { width, height } = canvas;
  const { data } = canvas.getContext("2d").getImageData(0, 0, width, height);
  let painted = 0;
  for (let i = 3; i < data.length; i += 4) painted += data[i] > 0;
  return { painted, text: canvas.getAttribute("aria-label") };
});
/** What the part in space looks like: how many of its pixels aren't the background's, and all of them. */
export async function space() {
  await page.waitForTimeout(150);
  const file = (await page.locator("#part").screenshot()).toString("base64");
  const painted = await page.evaluate(async (text) => {
    const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
    const image = await createImageBitmap(new Blob([bytes], { type: "image/png" }));
    const context = new OffscreenCanvas(image.width, image.height).getContext("2d");
    context.drawImage(image, 0, 0);
    const { data } = context.getImageData(0, 0, image.width, image.height);
    let other = 0;
    // Colours of a channel aren't grey; frames, shadows and the page are.
    for (let i = 0; i < data.length; i += 4) {
      const colour = data.slice(i, i + 3);
      other += Math.max(...colour) - Math.min(...colour) > 40;
    }
    return other;
  }, file);
  return { file, painted };
}
