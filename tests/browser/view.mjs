// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The page of `ccslice view` as somebody uses it: with the mouse, with the keyboard alone, in two windows, and while its
// server dies and comes back. Screenshots go into a folder.
//
//   node view.mjs ADDRESS FOLDER MESH_ID < commands
//
// The mesh is one of two channels and two cell regions, which the server has besides. Prints "kill" when the server is to
// die; reads a line when it is back.

import assert from "node:assert/strict";
import readline from "node:readline";
import { print_in_materials } from "./materials.mjs";
import { after, bars, browser, context, drag, errors, full, middle_of, page, shot, space, state, until } from "./page.mjs";
import { tilt_the_plane } from "./tilt.mjs";

const [address, , regions] = process.argv.slice(2);
const answers = readline.createInterface({ input: process.stdin })[Symbol.asyncIterator]();

// Open. The token leaves the address.
await page.goto(address);
const first = await full();
assert.ok(first.inside > 10000, `the part is in the picture: ${first.inside}`);
assert.ok(!page.url().includes("token"), page.url());

// The part stands beside it, coloured as the cut is.
await until(() => Number(document.querySelector("#part").dataset.drawn) > 100, "part in space");
const part = await space();
assert.ok(part.painted > 20000, `the part is drawn: ${part.painted}`);
await shot("opened");

// Turn it: a drag beside the plane. The cut stays.
const corner = await middle_of("#part");
await drag({ x: corner.x + 12, y: corner.y + 12 }, { x: 90, y: 25 });
const turned = await space();
assert.notEqual(turned.file, part.file);
assert.notDeepEqual((await state()).camera, { azimuth: 40, elevation: 25, near: 1 });
assert.equal((await full()).sum, first.sum);

// Grab the plane in it, and pull it down and up.
const before_grab = (await state()).height;
const lower = await after(() => drag({ x: corner.cx, y: corner.cy }, { x: 0, y: 40 }));
assert.ok((await state()).height < before_grab - 0.02, "the plane follows the pointer");
assert.notEqual(lower.sum, first.sum);
const grabbed = await space();
assert.notEqual(grabbed.file, turned.file);
await shot("grabbed");
await page.mouse.move(corner.cx, corner.cy);
await page.mouse.wheel(0, -300);
assert.ok((await state()).camera.near > 1);

// Drag the slider.
const height = page.locator("#height");
const dragged = await after(() => height.fill("200"));
assert.notEqual(dragged.sum, lower.sum);
for (let value = 200; value <= 800; value += 20) await height.fill(String(value));
await full();
await shot("dragged");

// Another direction, channel, colours, outlines.
const across = await after(() => page.locator("#axis").selectOption("y"));
assert.notEqual(across.inside, dragged.inside);
await after(() => page.locator("#axis").selectOption("free"));
await after(() => page.locator("#elevation").fill("20"));
const lined = await after(() => page.locator("#lines").check());
assert.ok(lined.colours.includes("#000000"));
await page.locator("#part").press("Home");
await space();
await shot("oblique");
await after(() => page.locator("#lines").uncheck());
const grey = await after(() => page.locator("#colours").selectOption("COLOUR_MAP_NAME_GREY"));
const plain = await after(() => page.locator("#show").selectOption("occupancy"));
assert.equal(plain.inside, grey.inside);
assert.equal(plain.colours.length, 1);
assert.ok(!(await page.locator("#histogram").isVisible()), "one colour has no histogram");
assert.ok(!(await page.locator("#pitch").isVisible()), "nor voxels");
await after(() => page.locator("#show").selectOption("channel"));
await after(() => page.locator("#colours").selectOption("COLOUR_MAP_NAME_VIRIDIS"));
await after(() => page.locator("#fixed").uncheck());

// The values of the cut, as bars and in words.
const histogram = await bars();
assert.ok(histogram.painted > 200, `bars: ${histogram.painted}`);
assert.match(histogram.text, new RegExp(`^Histogram of ${grey.inside} pixels: a tenth up to [\\d.]+, half up to`));

// Zoom and move with the mouse.
await after(() => page.locator("#axis").selectOption("z"));
const zoomed = await after(() => page.locator("#larger").click());
const stage = await middle_of("#stage");
const panned = await after(() => drag({ x: stage.cx, y: stage.cy }, { x: 120, y: 40 }));
assert.notEqual(panned.sum, zoomed.sum);

// Ask what is there.
await after(() => page.locator("#fit").click());
await page.mouse.click(stage.cx, stage.cy);
await until(() => document.querySelector("#probe").textContent.includes(") mm"), "answer about a point");
assert.match(await page.locator("#probe").textContent(), /cell \d+, \(u, v, w\)|outside/);
await shot("probed");

// A layer, down to its voxels: a voxel is a pixel of the picture, and 16 of the screen.
const sizes = page.locator("#pitch");
await after(() => page.locator("#axis").selectOption("layer"));
await after(async () => {
  await sizes.fill("0.4, 0.4, 0.5");
  await sizes.press("Enter");
});
const voxels = await after(() => page.locator("#voxels").click());
assert.ok(voxels.layer !== "", "a layer is shown");
assert.ok(voxels.width < stage.width / 14 && voxels.width > stage.width / 18, `${voxels.width} voxels`);
assert.ok(Math.abs(voxels.shown[0] - 16 * voxels.width) < 1, `${voxels.shown} on the screen`);
const next = await after(() => page.locator("#stage").press("PageUp"));
assert.equal(Number(next.layer), Number(voxels.layer) + 1);
assert.match((await bars()).text, new RegExp(`^Histogram of ${next.inside} pixels`), "of this layer");
await page.mouse.click(stage.cx, stage.cy);
await until(() => document.querySelector("#probe").textContent.includes("voxel ("), "answer about a voxel");
await sizes.fill("0.4, none");
await sizes.press("Enter");
assert.equal(await sizes.getAttribute("aria-invalid"), "true");
await sizes.fill("0.4, 0.4, 0.5");

// As it prints: nothing but the materials' colours. Then other materials.
await after(() => page.locator("#colours").selectOption("COLOUR_MAP_NAME_VIRIDIS"));
const halftone = await after(() => page.locator("#show").selectOption("halftone"));
assert.deepEqual(halftone.colours, ["#2d5d8b", "#f2c14e"]);
assert.match((await bars()).text, /^Histogram: soft [\d.]+ %, hard [\d.]+ %\.$/);
await shot("halftone");
const diffused = await after(() => page.locator("#method").selectOption("HALFTONE_METHOD_ERROR_DIFFUSION"));
assert.deepEqual(diffused.colours, halftone.colours);
assert.notEqual(diffused.sum, halftone.sum);
const recoloured = await after(() => page.getByLabel("Colour of soft").evaluate((input) => {
  input.value = "#ff0000";
  input.dispatchEvent(new Event("change"));
}));
assert.deepEqual(recoloured.colours, ["#2d5d8b", "#ff0000"]);
await after(() => page.locator("#add-material").click());
assert.equal(await page.locator("#materials tr").count(), 3);
await after(async () => {
  await page.getByLabel("Value of the channel where all is hard").fill("0.5");
  await page.keyboard.press("Tab");
});
await after(() => page.getByLabel("Remove material 3").click());
assert.equal(await page.locator("#materials tr").count(), 2);
const mixed = await after(() => page.locator("#show").selectOption("mix"));
assert.ok(mixed.colours.length > 10, `mixed colours: ${mixed.colours.length}`);
const fitted = await after(() => page.locator("#fit").click());
assert.ok(fitted.inside > 1000);
await shot("mixed");

// Tilt the plane; mix by regions, and by channels that are shares.
await tilt_the_plane();
await print_in_materials(regions);

// The keyboard alone.
await after(() => page.locator("#show").selectOption("mix"));
await after(() => page.locator("#axis").selectOption("z"));
await page.locator("#mesh").focus();
const reached = [];
for (let i = 0; i < 60 && reached.at(-1) !== "part"; ++i) {
  await page.keyboard.press("Tab");
  reached.push(await page.evaluate(() => document.activeElement.id));
}
for (const id of ["axis", "height", "show", "mixed-by", "add-material", "lines", "smaller", "stage", "part"]) {
  assert.ok(reached.includes(id), `${id} is reached by Tab: ${reached}`);
}
const looked = await space();
await page.keyboard.press("ArrowLeft");
await page.keyboard.press("+");
assert.notEqual((await space()).file, looked.file);
const keyed = await full();
const up = await after(() => page.keyboard.press("PageUp"));
assert.notEqual(up.sum, keyed.sum);
await page.keyboard.press("Shift+Tab");
assert.equal(await page.evaluate(() => document.activeElement.id), "stage");
const near = await after(() => page.keyboard.press("+"));
assert.notEqual(near.sum, up.sum);
await after(() => page.keyboard.press("ArrowRight"));
await page.keyboard.press("Enter");
await until(() => document.querySelector("#probe").textContent.includes(") mm"), "answer about a point");

// Whoever can't see finds a name for everything that can be set.
const nameless = await page.evaluate(() => [...document.querySelectorAll("input, select, button, canvas, [tabindex]")]
  .filter((e) => !(e.labels?.length || e.ariaLabel || e.textContent.trim() || e.ariaHidden === "true")).map((e) => e.outerHTML));
assert.deepEqual(nameless, []);

// Dark.
await page.emulateMedia({ colorScheme: "dark" });
await full();
assert.ok(await page.evaluate(() => getComputedStyle(document.body).color.startsWith("rgb(255")), "light letters");
await space();
await shot("dark");
await page.emulateMedia({ colorScheme: "light" });

// The address brings the view back.
const kept = await full();
await page.reload();
const again = await full();
assert.equal(again.sum, kept.sum);

// Two windows, each with its own plane.
const other = await context.newPage();
await other.goto(address.split("#")[0]);
await full(other);
const both = await Promise.all([page, other].map(async (on, i) => {
  for (let value = 300; value <= 500; value += 10) await on.locator("#height").fill(String(value + 100 * i));
  return after(() => on.locator("#height").fill(String(600 + i)), on);
}));
assert.notEqual(both[0].sum, both[1].sum);
await other.close();

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

// Without the token there is nothing.
const stranger = await (await browser.newContext()).newPage();
await stranger.goto(address.split("#")[0]);
await until(() => document.querySelector("#status").textContent.includes("token included"), "word of the token", stranger);

assert.deepEqual(errors, []);
await browser.close();
process.exit(0);
