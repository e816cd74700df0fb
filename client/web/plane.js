// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Vectors, and where planes lie in a part's box. Lengths in mm.

export const add = (a, b, s = 1) => a.map((x, i) => x + s * b[i]);
export const dot = (a, b) => a.reduce((sum, x, i) => sum + x * b[i], 0);
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
export const unit = (a) => a.map((x) => x / Math.sqrt(dot(a, a)));
export const clamp = (x, low, high) => Math.max(low, Math.min(high, x));

/** Of the contract's messages. */
export const message = (a) => ({ x: a[0], y: a[1], z: a[2] });
export const vector = (v) => [v.x, v.y, v.z];

/** The unit vector that angles in degrees stand for: round z from x, and up from level. */
export function direction(azimuth, elevation) {
  const [a, e] = [azimuth * Math.PI / 180, elevation * Math.PI / 180];
  return [Math.cos(e) * Math.cos(a), Math.cos(e) * Math.sin(a), Math.sin(e)];
}

/** Axes of a picture that is seen against a normal: up is z as far as it can be, or y where the plane is level. */
export function axes(normal) {
  let up = add([0, 0, 1], normal, -normal[2]);
  up = dot(up, up) < 1e-12 ? [0, 1, 0] : unit(up);
  return { across: cross(up, normal), up };
}

/** The middle of a box, and how far it reaches from there in a direction. */
export const middle = (box) => add(box.low, box.high).map((x) => x / 2);
export const reach = (box, axis) =>
  axis.reduce((sum, x, i) => sum + Math.abs(x) * (box.high[i] - box.low[i]) / 2, 0);

/** What part of a layer's grid a picture of width x height pixels shows, `scale` pixels a mm, round a place. */
export function visible_voxels(grid, at, width, height, scale) {
  const pitch = [grid.pitch.x_mm, grid.pitch.y_mm], count = [grid.extent.columns, grid.extent.rows];
  const origin = vector(grid.origin_mm), size = [width / scale, height / scale];
  const first = [0, 1].map((i) =>
    clamp(Math.floor((at[i] - size[i] / 2 - origin[i]) / pitch[i]), 0, count[i] - 1));
  const end = [0, 1].map((i) =>
    clamp(Math.ceil((at[i] + size[i] / 2 - origin[i]) / pitch[i]), first[i] + 1, count[i]));
  return { first, count: [end[0] - first[0], end[1] - first[1]] };
}
