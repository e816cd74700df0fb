// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Materials that cell regions mix each in its own way, and channels that are shares of materials themselves, of a block
// whose region `core` is at its left and `shell` at its right, with the channels `lime` and `salt`.

import assert from "node:assert/strict";
import { after, bars, full, page, shot, state, until } from "./page.mjs";

/** The colour in the picture at shares of its size from the upper left corner, #rrggbb. */
const colour_at = (x, y) => page.evaluate(([right, down]) => {
  const image = document.querySelector("#picture"), context = new OffscreenCanvas(1, 1).getContext("2d");
  context.drawImage(image, -Math.floor(right * image.naturalWidth), -Math.floor(down * image.naturalHeight));
  return "#" + [...context.getImageData(0, 0, 1, 1).data].slice(0, 3).map((b) => b.toString(16).padStart(2, "0")).join("");
}, [x, y]);
/** What light of these colours adds up to, each a share of all, as bytes. */
function mix(colours, shares) {
  const sum = shares.reduce((a, b) => a + b, 0);
  return [1, 3, 5].map((at) => {
    const light = colours.reduce((all, colour, i) => {
      const x = Number.parseInt(colour.slice(at, at + 2), 16) / 255;
      return all + (x <= 0.04045 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4) * shares[i] / sum;
    }, 0);
    return 255 * (light <= 0.0031308 ? 12.92 * light : 1.055 * light ** (1 / 2.4) - 0.055);
  });
}
async function value_in_the_middle() {
  await page.locator("#stage").press("Enter");
  await until(() => document.querySelector("#probe").textContent.includes("salt"), "values of the channels");
  const text = await page.locator("#probe").textContent();
  return ["lime", "salt"].map((name) => Number(text.match(new RegExp(`${name} ([-\\d.e]+)`))[1]));
}
async function has_mix_in_the_middle(colours, shares) {
  const seen = await colour_at(0.5, 0.5), expected = mix(colours, shares);
  const off = expected.map((x, i) => Math.abs(x - Number.parseInt(seen.slice(1 + 2 * i, 3 + 2 * i), 16)));
  assert.ok(Math.max(...off) <= 2, `${seen} instead of ${expected}`);
}
const way = (value) => page.locator("#mixed-by").selectOption(value);

async function by_region() {
  const regions = await after(() => way("regions"));
  assert.deepEqual(regions.colours, ["#2d5d8b", "#f2c14e"], "a material for each");
  assert.deepEqual([await colour_at(0.35, 0.5), await colour_at(0.65, 0.5)], ["#f2c14e", "#2d5d8b"]);
  assert.match((await bars()).text, /core [\d.]+ %, shell [\d.]+ %/);
  // Both of one material.
  const one = await after(() => page.getByLabel("Materials of shell").selectOption({ label: "all core" }));
  assert.deepEqual(one.colours, ["#f2c14e"]);
  // One of them graded. Names in the lists follow those of the materials.
  await after(async () => {
    await page.getByLabel("Name of material 2").fill("rubber");
    await page.keyboard.press("Tab");
  });
  assert.ok((await page.locator("#region-0").textContent()).includes("all rubber"));
  await after(() => page.locator("#show").selectOption("mix"));
  const graded = await after(() => page.getByLabel("Materials of shell").selectOption("blend:lime"));
  assert.equal(await page.evaluate(() => document.activeElement.id), "region-1", "the focus stays");
  assert.ok(graded.colours.length > 10);
  assert.equal(await colour_at(0.3, 0.5), "#f2c14e");
  assert.notEqual(await colour_at(0.6, 0.5), await colour_at(0.7, 0.5));
  await shot("regions");
  // Its own values, and a refusal that says what is wrong.
  const value = page.getByLabel("Value of lime where shell is all core");
  await value.fill("");
  await value.press("Enter");
  await until(() => document.querySelector("#status").textContent.includes("stops"), "word of the missing value");
  await value.fill("0.9");
  const turned = await after(() => value.press("Enter"));
  assert.notEqual(turned.sum, graded.sum);
  await page.reload();
  assert.equal((await full()).sum, turned.sum, "the address brings the maps back");
  // A material less.
  await after(() => page.getByLabel("Materials of shell").selectOption({ label: "all rubber" }));
  const less = await after(() => page.getByLabel("Remove rubber").click());
  assert.deepEqual(less.colours, ["#f2c14e"]);
}

async function by_shares() {
  await after(() => way("direct"));
  const materials = (await state()).printing.materials;
  assert.deepEqual(materials.map((m) => m.name), ["lime", "salt"]);
  const values = await value_in_the_middle(), colours = materials.map((m) => m.colour);
  await has_mix_in_the_middle(colours, values);
  // One more takes the rest, and then another one does.
  await after(() => page.locator("#add-material").click());
  const rest = 1 - values[0] - values[1];
  assert.ok(rest > 0.05, `a rest to be seen: ${rest}`);
  await has_mix_in_the_middle([...colours, (await state()).printing.materials[2].colour], [...values, rest]);
  await shot("shares");
  await after(() => page.getByLabel("Share of salt").selectOption("rest"));
  assert.equal(await page.getByLabel("Share of material 3").inputValue(), "");
  await has_mix_in_the_middle(colours, [values[0], 1 - values[0]]);
  assert.ok(!(await page.locator("#mix-note").isVisible()), "these channels are shares");
}

/** What was chosen in one way is kept while another one is looked at. */
async function there_and_back() {
  await after(() => way("blend:salt"));
  await after(() => way("direct"));
  assert.equal(await page.getByLabel("Share of salt").inputValue(), "rest");
  await after(() => way("blend:salt"));
  assert.equal(await page.locator("#materials tr").count(), 2);
}

/** Once there are as many materials as may be, the button that adds them gives the focus to one that takes one away. */
async function keep_the_focus() {
  const add = page.locator("#add-material"), focused = () => page.evaluate(() => document.activeElement.ariaLabel);
  while (await add.isEnabled()) await after(() => add.press("Enter"));
  const name = await focused();
  assert.match(name ?? "nothing", /^Remove material [0-9]+$/);
  await after(() => page.keyboard.press("Enter"));
  assert.ok(await add.evaluate((button) => button === document.activeElement), `${name} gives it back`);
  while (await page.locator("#materials tr").count() > 2) {
    await after(() => page.locator("#materials tr").last().getByRole("button").click());
  }
}

/** `id`: of the block. The part that was shown before is shown again. */
export async function print_in_materials(id) {
  const before = await page.locator("#mesh").inputValue();
  await after(() => page.locator("#mesh").selectOption(id));
  await after(() => page.locator("#axis").selectOption("z"));
  const halftone = await after(() => page.locator("#show").selectOption("halftone"));
  assert.deepEqual(halftone.colours, ["#2d5d8b", "#f2c14e"], "by the first channel at first");
  await by_region();
  await by_shares();
  await there_and_back();
  await keep_the_focus();
  await after(() => page.locator("#show").selectOption("channel"));
  await after(() => page.locator("#mesh").selectOption(before));
  assert.deepEqual(await page.locator("#mixed-by option").allTextContents(), ["hardness", "the channels themselves"]);
}
