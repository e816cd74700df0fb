// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Opens pages, whose addresses it reads line by line, each in a tab of its own. Writes when the first picture, the full
// one and the part in space were on the screen, as JSON in ms since 1970.

import readline from "node:readline";
import { browser, context, until } from "./page.mjs";

/** In the page, from its begin. An image is seen in the frame after the one that it was put in for. */
function watch() {
  window.seen = {};
  const see = (step) => requestAnimationFrame(() => setTimeout(() => { window.seen[step] ??= Date.now(); }));
  new MutationObserver(() => {
    const stage = document.querySelector("#picture")?.dataset.stage;
    if (stage === "coarse" || stage === "full") see("first");
    if (stage === "full") see("full");
    if (document.querySelector("#part")?.dataset.drawn > 0) see("space");
  }).observe(document, { childList: true, subtree: true, attributes: true, attributeFilter: ["data-drawn", "data-stage"] });
}

for await (const address of readline.createInterface({ input: process.stdin })) {
  const page = await context.newPage();
  await page.addInitScript(watch);
  await page.goto(address);
  await until(() => "full" in window.seen && "space" in window.seen, "part in space", page);
  process.stdout.write(JSON.stringify(await page.evaluate(() => window.seen)) + "\n");
  await page.close();
}
await browser.close();
