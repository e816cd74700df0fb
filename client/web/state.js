// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What the page shows, and the requests for it.
import { printing_message } from "./materials.js";
import {
  add, angles, axes, clamp, direction, dot, message, middle, reach, vector, visible_voxels,
} from "./plane.js";

// What the address brings back. `up`: what was up in the picture when the plane was tilted last, or null.
export const state = { mesh: null, axis: "z", azimuth: 30, elevation: 45, up: null, height: 0.5, show: "channel",
  channel: "", colours: "COLOUR_MAP_NAME_VIRIDIS", fixed: true, lines: false, zoom: 1, pan: [0, 0], pitch: null,
  printing: null, camera: { azimuth: 40, elevation: 25, near: 1 } };
export const view = { meshes: [], busy: false, wanted: false, urls: {}, grid: null, grid_of: "", part: null, surface_of: "",
  page: Array.from(crypto.getRandomValues(new Uint32Array(2)), (x) => x.toString(36)).join("") };
export const dark = matchMedia("(prefers-color-scheme: dark)");

export const mesh = () => view.meshes.find((m) => m.mesh_id === state.mesh);
export const box = () => ({ low: vector(mesh().bounding_box.min_mm), high: vector(mesh().bounding_box.max_mm) });
export const is_layer = () => state.axis === "layer" && view.grid !== null;
export const shows_materials = () => state.show === "mix" || state.show === "halftone";
export const pitch_message = () => ({ x_mm: state.pitch[0], y_mm: state.pitch[1], z_mm: state.pitch[2] });
/** The job whose layers the page shows, but for what is printed. */
export const job_message = () => ({ parts: [{ mesh_id: state.mesh }], grid: { pitch: pitch_message() } });
export const layer_number = () => clamp(Math.floor(state.height * view.grid.extent.layers), 0, view.grid.extent.layers - 1);

/** The plane's axes and place, and the size of the picture: of `width` x `rows` pixels on the screen. */
export function frame() {
  const normal = { z: [0, 0, 1], layer: [0, 0, 1], y: [0, -1, 0], x: [1, 0, 0] }[state.axis] ??
    direction(state.azimuth, state.elevation);
  const { across, up } = axes(normal, (state.axis === "free" && state.up) || undefined);
  const part = box(), centre = middle(part);
  let height = dot(centre, normal) + (2 * state.height - 1) * reach(part, normal);
  if (is_layer()) height = view.grid.origin_mm.z + (layer_number() + 0.5) * view.grid.pitch.z_mm;
  const stage = document.getElementById("stage").getBoundingClientRect();
  const width = clamp(Math.round(stage.width), 16, 2048), rows = clamp(Math.round(stage.height), 16, 2048);
  const pixel = 1.04 * Math.max((2 * reach(part, across)) / width, (2 * reach(part, up)) / rows) / state.zoom;
  let at = add(centre, normal, height - dot(centre, normal));
  at = add(add(at, across, state.pan[0]), up, state.pan[1]);
  return { normal, across, up, at, height, width, rows, pixel, stage };
}

/** What becomes of the state when the plane is tilted about a point of it. The picture doesn't turn at that, and where
 * it doesn't show all of the part, its middle stays. */
export function tilted(normal, pivot) {
  const { azimuth, elevation } = angles(normal, state.azimuth), own = direction(azimuth, elevation);
  const { across, up } = axes(own, frame().up), centre = middle(box()), away = add(pivot, centre, -1);
  const whole = state.zoom === 1 && !state.pan.some(Boolean);
  return { axis: "free", azimuth, elevation, height: clamp(0.5 + dot(away, own) / (2 * reach(box(), own)), 0, 1),
    up: up.map((x) => Number(x.toFixed(4))), pan: whole ? [0, 0] : [dot(away, across), dot(away, up)] };
}

function content() {
  const channel = mesh().channels.find((c) => c.name === state.channel);
  const shown = { occupancy: {} };
  if (shows_materials()) {
    delete shown.occupancy;
    shown[state.show] = state.show === "halftone" && !is_layer() ? { grid: { pitch: pitch_message() } } : {};
  } else if (state.show === "channel" && channel) {
    delete shown.occupancy;
    shown.channel = { channel: channel.name, colours: state.colours };
    if (state.fixed && channel.min_value < channel.max_value) {
      shown.channel.range = { min: channel.min_value, max: channel.max_value };
    }
  }
  if (state.lines) shown.lines = { width_pixels: 1.5, rgba: dark.matches ? 0xffffffff : 0xff };
  return shown;
}

/** The request of the picture, and where in the stage that goes. Voxels of a layer are shown where they take a pixel. */
export function request(f) {
  const asked = { content: content() };
  const printed = shows_materials() ? { printing: printing_message(state.printing) } : {};
  if (is_layer() && Math.min(...state.pitch.slice(0, 2)) >= f.pixel) {
    const { origin_mm, pitch, extent } = view.grid;
    const { first, count } = visible_voxels(view.grid, f.at, f.width, f.rows, 1 / f.pixel);
    const job = { ...job_message(), ...printed };
    asked.plane = { layer: { job, layer: layer_number() } };
    // Layers of the whole grid share more of the server's work than those of a region.
    if (count[0] < extent.columns || count[1] < extent.rows) {
      job.region = { voxels: { first_column: first[0], first_row: first[1], first_layer: 0,
        extent: { columns: count[0], rows: count[1], layers: extent.layers } } };
    }
    const left = origin_mm.x + first[0] * pitch.x_mm - f.at[0], top = f.at[1] - origin_mm.y -
      (first[1] + count[1]) * pitch.y_mm;
    return { asked, layer: true, place: { left: left / f.pixel + f.width / 2, top: top / f.pixel + f.rows / 2 } };
  }
  if (state.show === "halftone" && is_layer()) asked.content.halftone = { grid: { pitch: pitch_message() } };
  asked.plane = { free: { middle_mm: message(f.at), across: message(f.across), up: message(f.up),
    across_mm_per_pixel: f.pixel } };
  Object.assign(asked, printed, { mesh_id: state.mesh, width: f.width, height: f.rows });
  return { asked, layer: false, place: { left: 0, top: 0 } };
}
