// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Gets the pictures of what the page shows, one at a time: while one is on its way only the latest view waits, so a
// drag never queues. While something moves, coarse pictures come; when it rests, the full one. Then the part in space.
import { is_away, post } from "./api.js";
import { add, clamp } from "./plane.js";
import { box, frame, is_layer, job_message, request, shows_materials, state, view } from "./state.js";
import { show, show_legend } from "./values.js";

const $ = (id) => document.getElementById(id);

let first_shown = null;
/** Done when a picture of the cut is there. */
export const first_picture = new Promise((done) => { first_shown = done; });

export function say(text, away = false) {
  $("status").textContent = text;
  $("status").classList.toggle("away", away);
}

/** The grid of the layers, which the server knows best. Whether it is another one. */
async function find_grid() {
  const wanted = state.axis === "layer" ? `${state.mesh} ${state.pitch}` : "";
  if (wanted === view.grid_of) return false;
  view.grid = wanted === "" ? null :
    (await (await post("api/plan", { job: job_message() })).json()).grid;
  view.grid_of = wanted;
  return true;
}

/** The triangles of the part in space, with the values of the channel that is shown. The cut doesn't wait for them. */
export async function find_surface() {
  const channel = state.show === "channel" ? state.channel : "", wanted = `${state.mesh} ${channel}`;
  if (!view.part || wanted === view.surface_of) return;
  view.surface_of = wanted;
  try {
    await load_surface(channel, wanted);
  } catch (error) {
    if (is_away(error)) view.surface_of = "";  // Again with the next picture.
    say(error.message, is_away(error));
  }
}

async function load_surface(channel, wanted) {
  const part = box(), size = Math.hypot(...add(part.high, part.low, -1));
  const path = "api/boundary" + (channel ? `?channel=${encodeURIComponent(channel)}` : "");
  const response = await post(path, { mesh_id: state.mesh, chord_tolerance_mm: clamp(size / 500, 1e-4, 1000) });
  const header = JSON.parse(response.headers.get("Ccslice-Surface")), bytes = await response.arrayBuffer();
  const vertices = Number(header.vertex_count), values = channel ? vertices : 0;
  if (wanted !== view.surface_of) return;
  view.part.set_surface({ box: part, places: new Float32Array(bytes, 0, 3 * vertices),
    values: new Float32Array(bytes, 12 * vertices, values),
    triangles: new Uint32Array(bytes, 12 * vertices + 4 * values) });
}

/** Draws the latest view that was wanted; at most one request is under way. show_plane() is called with a new grid. */
export async function draw(show_plane) {
  $("picture").dataset.stage = "passed";  // What is shown is no longer what is wanted.
  if (view.busy) return;
  view.busy = true;
  let full = false;
  while (view.wanted || !full) {
    full = !view.wanted;
    view.wanted = false;
    try {
      if (await find_grid()) show_plane();
      const f = frame(), { asked, layer, place } = request(f);
      if (layer) full = true;
      const path = `api/preview?page=${view.page}&stage=${full ? "full" : "coarse"}`;
      const response = await post(path, asked);
      const header = JSON.parse(response.headers.get("Ccslice-Preview"));
      await show_picture(await response.blob(), { header, full, layer, place, f, asked });
      if (full && !view.wanted) find_surface();
    } catch (error) {
      const away = is_away(error);
      if (away || error.status === 409) view.wanted = true;  // 409: too many pages share the server's calls.
      else full = true;
      const text = away ? "The server is away; this page goes on when it is back." : error.message;
      if (error.status !== 409) say(text, away);
      if (away) await new Promise((done) => setTimeout(done, 1000));
    }
  }
  view.busy = false;
}

/** The cut in the part in space, in its colours. */
export function show_in_part() {
  if (!view.part || !view.shown) return;
  const { picture, header, corners } = view.shown;
  view.part.set_picture(picture, corners);
  if (header.colours?.length > 0) {
    view.part.set_colours(header.colours, header.range && [header.range.min, header.range.max]);
  } else {
    view.part.set_colours([shows_materials() ? 0xb4b4b4ff : 0xed9e40ff], null);  // Materials show in the cut alone.
  }
}

async function show_picture(blob, { header, full, layer, place, f, asked }) {
  const url = URL.createObjectURL(blob);
  const picture = Object.assign(new Image(), { id: "picture", alt: $("picture").alt, src: url, draggable: false });
  await picture.decode().catch(() => {});
  const size = [header.width * header.across_mm_per_pixel, header.height * header.up_mm_per_pixel];
  Object.assign(picture.style, { left: `${place.left}px`, top: `${place.top}px`, width: `${size[0] / f.pixel}px`,
    height: `${size[1] / f.pixel}px` });
  picture.dataset.stage = !full ? "coarse" : view.wanted ? "passed" : "full";
  picture.dataset.layer = layer ? String(asked.plane.layer.layer) : "";
  $("picture").replaceWith(picture);
  if (view.urls[full]) URL.revokeObjectURL(view.urls[full]);
  view.urls[full] = url;
  const left = place.left - f.width / 2, top = f.rows / 2 - place.top;
  const corner = (x, y) => add(add(f.at, f.across, left * f.pixel + x), f.up, top * f.pixel - size[1] + y);
  view.shown = { picture, header, corners: [corner(0, 0), corner(size[0], 0), corner(0, size[1]), corner(...size)] };
  show_in_part();
  first_shown();
  if (!full) return;
  $("download").href = url;
  show_legend(header, shows_materials() ? state.printing.materials : [],
    { legend: $("legend"), histogram: $("histogram"), list: $("range") });
  const where = layer ? `Layer ${asked.plane.layer.layer} of ${view.grid.extent.layers}, voxels of ` +
    `${show(header.across_mm_per_pixel)} x ${show(header.up_mm_per_pixel)} mm` :
    `${show(header.across_mm_per_pixel)} mm a pixel` + (is_layer() ? "; larger shows the voxels" : "");
  say(Number(header.pixels_inside) === 0 ? "The plane misses the part." : `${where}, ${show(header.worked_ms)} ms`);
}
