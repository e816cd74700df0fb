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

/** The angles of a unit vector in degrees, to a tenth. That of level directions is kept where there is none. */
export function angles(normal, azimuth) {
  const level = Math.hypot(normal[0], normal[1]);
  const degrees = (y, x) => Number((Math.atan2(y, x) * 180 / Math.PI).toFixed(1));
  return { azimuth: level > 1e-6 ? degrees(normal[1], normal[0]) : azimuth, elevation: degrees(normal[2], level) };
}

/** Turned round a unit vector by an angle in degrees, counter-clockwise where that points at who looks. */
export function turned(a, round, degrees) {
  const angle = degrees * Math.PI / 180, kept = round.map((x) => x * dot(a, round));
  return add(add(kept, add(a, kept, -1), Math.cos(angle)), cross(round, a), Math.sin(angle));
}

/** Axes of a picture that is seen against a normal: up is `upright` as far as it can be, or else z, or y. */
export function axes(normal, upright = [0, 0, 1]) {
  const level = (a) => add(a, normal, -dot(a, normal));
  const up = unit([upright, [0, 0, 1], [0, 1, 0]].map(level).find((a) => dot(a, a) > 1e-12));
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
