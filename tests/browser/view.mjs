// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The page of `ccslice view` as somebody uses it: with the mouse, with the keyboard alone, and while its server dies and
// comes back. Screenshots go into a folder.
//
//   node view.mjs ADDRESS FOLDER < commands     Prints "kill" when the server is to die; reads a line when it is back.

import assert from "node:assert/strict";
import readline from "node:readline";
import { chromium } from "playwright-core";

const [address, folder] = process.argv.slice(2);
const answers = readline.createInterface({ input: process.stdin })[Symbol.asyncIterator]();
const browser = await chromium.launch({ executablePath: "/usr/bin/chromium", args: ["--no-sandbox"] });
const page = await browser.newPage({ viewport: { width: 1100, height: 720 } });
const errors = [];
page.on("pageerror", (error) => errors.push(String(error)));

/** Polls from outside: the page's policy lets nobody make code from texts in it, which waitForFunction() would do. */
async function until(condition, what) {
  for (let end = Date.now() + 20000; Date.now() < end; await page.waitForTimeout(20)) {
    if (await page.evaluate(condition)) return;
  }
  throw new Error(`no ${what} within 20 s; the page says: ${await page.locator("main").textContent()}; ${errors}`);
}

/** Waits until the full picture of what is asked for is there, and gives its pixels' sum. */
async function full() {
  await until(() => document.querySelector("#picture").dataset.stage === "full", "full picture");
  return page.evaluate(() => {
    const image = document.querySelector("#picture");
    const canvas = new OffscreenCanvas(image.naturalWidth, image.naturalHeight);
    const context = canvas.getContext("2d");
    context.drawImage(image, 0, 0);
    const { data } = context.getImageData(0, 0, canvas.width, canvas.height);
    let inside = 0, sum = 0;
    for (let i = 0; i < data.length; i += 4) {
      inside += data[i + 3] > 0;
      sum = (sum * 31 + data[i] + 3 * data[i + 1] + 7 * data[i + 2] + 11 * data[i + 3]) % 1000000007;
    }
    return { inside, sum, width: canvas.width };
  });
}

/** Does something, and waits for the picture that comes of it. */
async function after(action) {
  await page.evaluate(() => { document.querySelector("#picture").dataset.stage = "waiting"; });
  await action();
  return full();
}
const shot = (name) => page.screenshot({ path: `${folder}/${name}.png` });

// Open. The token leaves the address; the first picture is there within a second.
const begin = Date.now();
await page.goto(address);
const first = await full();
const opened = Date.now() - begin;
assert.ok(first.inside > 10000, `the part is in the picture: ${first.inside}`);
assert.ok(!page.url().includes("token"), page.url());
await shot("opened");

// Drag the plane.
const height = page.locator("#height");
const dragged = await after(() => height.fill("200"));
assert.notEqual(dragged.sum, first.sum);
for (let value = 200; value <= 800; value += 20) await height.fill(String(value));
await full();
await shot("dragged");

// Another direction, channel, colours.
const across = await after(() => page.locator("#axis").selectOption("y"));
assert.notEqual(across.inside, dragged.inside);
await after(() => page.locator("#axis").selectOption("free"));
await after(() => page.locator("#elevation").fill("20"));
await shot("oblique");
const grey = await after(() => page.locator("#colours").selectOption("COLOUR_MAP_NAME_GREY"));
const plain = await after(() => page.locator("#channel").selectOption(""));
assert.equal(plain.inside, grey.inside);
assert.notEqual(plain.sum, grey.sum);
await after(() => page.locator("#channel").selectOption({ index: 0 }));
await after(() => page.locator("#fixed").uncheck());

// Zoom and move with the mouse.
await after(() => page.locator("#axis").selectOption("z"));
const zoomed = await after(() => page.locator("#larger").click());
const stage = await page.locator("#stage").boundingBox();
const middle = { x: stage.x + stage.width / 2, y: stage.y + stage.height / 2 };
const panned = await after(async () => {
  await page.mouse.move(middle.x, middle.y);
  await page.mouse.down();
  await page.mouse.move(middle.x + 120, middle.y + 40, { steps: 6 });
  await page.mouse.up();
});
assert.notEqual(panned.sum, zoomed.sum);

// Ask what is there.
await after(() => page.locator("#fit").click());
await page.mouse.click(middle.x, middle.y);
await until(() => document.querySelector("#probe").textContent.includes(") mm"), "answer about a point");
assert.match(await page.locator("#probe").textContent(), /cell \d+, \(u, v, w\)|outside/);
await shot("probed");

// The keyboard alone.
await page.locator("#mesh").focus();
for (let i = 0; i < 30 && (await page.evaluate(() => document.activeElement.id)) !== "stage"; ++i) {
  await page.keyboard.press("Tab");
}
assert.equal(await page.evaluate(() => document.activeElement.id), "stage", "reached by Tab");
const keyed = await full();
const up = await after(() => page.keyboard.press("PageUp"));
assert.notEqual(up.sum, keyed.sum);
const near = await after(() => page.keyboard.press("+"));
assert.notEqual(near.sum, up.sum);
await after(() => page.keyboard.press("ArrowRight"));
await page.keyboard.press("Enter");
await until(() => document.querySelector("#probe").textContent.includes(") mm"), "answer about a point");

// The address brings the view back.
const kept = await full();
await page.reload();
const again = await full();
assert.equal(again.sum, kept.sum);

// The server goes away, and comes back.
process.stdout.write("kill\n");
await answers.next();
await page.locator("#height").fill("450");
await until(() => document.querySelector("#status").classList.contains("away"), "word of the server's absence");
await shot("away");
process.stdout.write("restart\n");
await answers.next();
await after(() => page.locator("#height").fill("455"));
assert.ok(!(await page.locator("#status").getAttribute("class"))?.includes("away"));

assert.deepEqual(errors, []);
await browser.close();
process.stdout.write(`first picture after ${opened} ms\n`);
process.exit(0);
