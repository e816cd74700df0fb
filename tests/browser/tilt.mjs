// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Tilting the plane in the part: by its ball, and with the keyboard.

import assert from "node:assert/strict";
import { after, full, middle_of, page, shot, space, state } from "./page.mjs";

const dot = (a, b) => a.reduce((sum, x, i) => sum + x * b[i], 0);
function normal_of({ azimuth, elevation }) {
  const [a, e] = [azimuth, elevation].map((x) => x * Math.PI / 180);
  return [Math.cos(e) * Math.cos(a), Math.cos(e) * Math.sin(a), Math.sin(e)];
}
const box = () => page.evaluate(async () => {
  const { meshes } = await (await fetch("api/meshes")).json();
  const { min_mm: low, max_mm: high } = meshes.find((m) => m.mesh_id === document.querySelector("#mesh").value).bounding_box;
  return [[low.x, low.y, low.z], [high.x, high.y, high.z]];
});
/** Millimetres of a plane along its normal. */
function height_of(shown, normal, [low, high]) {
  const middle = low.map((x, i) => (x + high[i]) / 2), half = high.map((x, i) => (x - low[i]) / 2);
  return dot(middle, normal) + (2 * shown.height - 1) * dot(half, normal.map(Math.abs));
}

async function hold(by) {
  await page.locator("#tilt").waitFor();
  const ball = await middle_of("#tilt");
  await page.mouse.move(ball.cx, ball.cy);
  await page.mouse.down();
  await page.mouse.move(ball.cx + by.x, ball.cy + by.y, { steps: 12 });
  await page.waitForTimeout(200);  // Until the page has had the last of it.
  return { x: ball.cx + by.x, y: ball.cy + by.y };
}

async function by_mouse() {
  await after(() => page.locator("#axis").selectOption("z"));
  await page.locator("#part").press("Home");
  const level = await after(() => page.locator("#height").fill("700"));
  const before = await state(), part = await box();
  assert.match(await page.locator("#tilt").getAttribute("title"), /tilt/, "a tooltip teaches it");
  await page.evaluate(() => {
    window.stages = [];
    new MutationObserver((changes) => changes.forEach((change) => change.addedNodes.forEach((node) =>
      window.stages.push(node.dataset.stage)))).observe(document.querySelector("#stage"), { childList: true });
  });
  await page.locator("#tilt").click();
  assert.deepEqual(await state(), before, "a click moves nothing");
  let pointer = null;
  const tilted = await after(async () => { pointer = await hold({ x: 60, y: 45 }); });
  const held = await state(), ball = await middle_of("#tilt");
  assert.ok(Math.hypot(ball.cx - pointer.x, ball.cy - pointer.y) < 2, "the ball is under the pointer");
  await space();
  await shot("tilting");
  await page.mouse.up();
  assert.notEqual(tilted.sum, level.sum);
  assert.ok(await page.evaluate(() => window.stages.includes("coarse")), "coarse pictures come during the drag");
  assert.equal(held.axis, "free");
  assert.equal(await page.locator("#axis").inputValue(), "free");
  assert.ok(held.elevation < 75, `tilted to ${held.elevation}`);
  assert.equal(await page.locator("#elevation-text").textContent(), `${held.elevation}°`);
  const normal = normal_of(held), most = Math.hypot(normal[0], normal[2]);
  assert.ok(held.up[1] > 0.98 * most, `y stays up in the picture, as far as it can: ${held.up}`);
  // Its middle stays in the plane.
  const pivot = part[0].map((x, i) => (x + part[1][i]) / 2);
  pivot[2] = height_of(before, [0, 0, 1], part);
  assert.ok(Math.abs(dot(pivot, normal) - height_of(held, normal, part)) < 0.02, "tilted about its middle");
  await page.reload();
  assert.equal((await full()).sum, tilted.sum, "the address brings the tilted plane back");
  return tilted;
}

/** With Shift the angles are round ones; where the picture shows a detail, it goes on showing that. */
async function details() {
  await after(async () => {
    await page.keyboard.down("Shift");
    await hold({ x: -50, y: 10 });
    await page.mouse.up();
    await page.keyboard.up("Shift");
  });
  const snapped = await state();
  assert.deepEqual([snapped.azimuth % 15, snapped.elevation % 15].map(Math.abs), [0, 0]);
  for (let i = 0; i < 3; ++i) await after(() => page.locator("#larger").click());
  await after(() => page.locator("#stage").press("ArrowRight"));
  const middle = async () => {
    await page.locator("#probe").evaluate((e) => { e.textContent = ""; });
    await page.locator("#stage").press("Enter");
    await page.locator("#probe:has-text(') mm')").waitFor();
    return (await page.locator("#probe").textContent()).match(/[-\d.e]+/g).slice(0, 3).map(Number);
  };
  const from = await middle();
  await after(() => page.locator("#tilt").press("ArrowDown"));
  const to = await middle();
  assert.ok(Math.hypot(...to.map((x, i) => x - from[i])) < 0.05, `${from} and ${to} in the middle`);
  await after(() => page.locator("#fit").click());
}

async function by_keyboard() {
  await page.locator("#part").focus();
  await page.keyboard.press("Tab");
  assert.equal(await page.evaluate(() => document.activeElement.id), "tilt");
  const angle = (a, b) => Math.acos(Math.min(1, dot(normal_of(a), normal_of(b)))) * 180 / Math.PI;
  const from = await state(), first = await full();
  const right = await after(() => page.keyboard.press("ArrowRight"));
  const there = await state();
  assert.notEqual(right.sum, first.sum);
  assert.ok(angle(from, there) > 2 && angle(from, there) < 5.2, `by ${angle(from, there)}°`);
  await after(() => page.keyboard.press("ArrowLeft"));
  assert.ok(angle(from, await state()) < 0.2, "and back");
  await after(() => page.keyboard.press("Shift+ArrowUp"));
  assert.ok(angle(from, await state()) < 1.2, "finely");
  const up = await full();
  assert.notEqual((await after(() => page.keyboard.press("PageUp"))).sum, up.sum, "it moves the plane, too");
  await space();
  await shot("tilted");
}

export async function tilt_the_plane() {
  await by_mouse();
  await details();
  await by_keyboard();
}
