// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What the colours of a picture stand for, and how many of its pixels have them.

/** A number of four digits. */
export const show = (number) => Number(number).toPrecision(4).replace(/\.?0+(e|$)/, "$1");
const css = (rgba) => "#" + (rgba >>> 8).toString(16).padStart(6, "0");
const percent = (share) => `${show(100 * share)} %`;

/** One entry a bar: { colour, count, name }. `described`: what the canvas tells who can't see it. */
function draw_bars(canvas, bars, described) {
  const { width, height } = canvas, context = canvas.getContext("2d");
  const most = Math.max(1, ...bars.map((bar) => bar.count));
  context.clearRect(0, 0, width, height);
  bars.forEach((bar, i) => {
    const left = Math.round((i * width) / bars.length), right = Math.round(((i + 1) * width) / bars.length);
    // What is there at all is to be seen.
    const high = bar.count > 0 ? Math.max(1, Math.round((height - 1) * bar.count / most)) : 0;
    context.fillStyle = bar.colour;
    context.fillRect(left, height - high, Math.max(1, right - left - (bars.length > 16 ? 0 : 4)), high);
  });
  canvas.setAttribute("aria-label", described);
}

function channel_bars(header) {
  const counts = (header.value_pixels ?? []).map(Number), colours = header.colours ?? [];
  return counts.map((count, i) => ({ count, colour: css(colours[Math.floor((i * colours.length) / counts.length)]) }));
}

/** In words, for screen readers. */
function describe_channel(header, bars) {
  const total = bars.reduce((sum, bar) => sum + bar.count, 0);
  if (total === 0) return "Histogram: no pixel is inside the part.";
  const { min, max } = header.range, step = (max - min) / bars.length;
  const below = (share) => {
    let sum = 0;
    const bin = bars.findIndex((bar) => (sum += bar.count) >= share * total);
    return show(min + (bin + 0.5) * step);
  };
  return `Histogram of ${total} pixels: a tenth up to ${below(0.1)}, half up to ${below(0.5)}, ` +
    `nine tenths up to ${below(0.9)}.`;
}

/** Fills the canvases and the list. `materials`: { name, colour } each, of printed contents. */
export function show_legend(header, materials, { legend, histogram, list }) {
  const context = legend.getContext("2d"), colours = header.colours ?? [];
  legend.hidden = colours.length === 0;
  context.clearRect(0, 0, legend.width, legend.height);
  colours.forEach((rgba, i) => {
    context.fillStyle = css(rgba);
    context.fillRect((legend.width * i) / colours.length, 0, legend.width / colours.length + 1, legend.height);
  });
  const pixels = (header.material_pixels ?? []).map(Number), inside = Math.max(1, Number(header.pixels_inside));
  const shares = pixels.map((count, i) => `${materials[i]?.name ?? i + 1} ${percent(count / inside)}`);
  list.textContent = header.range ? `${show(header.range.min)} to ${show(header.range.max)}` : shares.join(", ");
  const bars = pixels.length > 0 ? pixels.map((count, i) => ({ count, colour: materials[i]?.colour ?? "grey" })) :
    channel_bars(header);
  histogram.hidden = bars.length === 0;
  if (bars.length === 0) return;
  draw_bars(histogram, bars, pixels.length > 0 ? `Histogram: ${shares.join(", ")}.` : describe_channel(header, bars));
}
