// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The page of `ccslice view`. It asks for one picture at a time: while one is on its way only the latest view waits, so
// a drag never queues. While something moves, coarse pictures come; when it rests, the full one.
import { call, is_away, post } from "./api.js";
import { add_material, default_printing, list_materials, most_materials } from "./materials.js";
import { PartView } from "./part.js";
import { add, clamp, reach } from "./plane.js";
import {
  box, dark, frame, is_layer, layer_number, mesh, pitch_message, request, shows_materials, state, view,
} from "./state.js";
import { show, show_legend } from "./values.js";

const $ = (id) => document.getElementById(id);

function say(text, away = false) {
  $("status").textContent = text;
  $("status").classList.toggle("away", away);
}

/** The grid of the layers, which the server knows best. */
async function find_grid() {
  const wanted = state.axis === "layer" ? `${state.mesh} ${state.pitch}` : "";
  if (wanted === view.grid_of) return;
  view.grid = wanted === "" ? null :
    (await (await post("api/plan", { mesh_id: state.mesh, grid: { pitch: pitch_message() } })).json()).grid;
  view.grid_of = wanted;
  show_plane();
}

/** The triangles of the part in space, with the values of the channel that is shown. The cut doesn't wait for them. */
async function find_surface() {
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
    values: new Float32Array(bytes, 12 * vertices, values), triangles: new Uint32Array(bytes, 12 * vertices + 4 * values) });
}

/** Draws the latest view that was wanted; at most one request is under way. */
async function draw() {
  if (view.busy) return;
  view.busy = true;
  let full = false;
  while (view.wanted || !full) {
    full = !view.wanted;
    view.wanted = false;
    try {
      await find_grid();
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
      if (error.status !== 409) say(away ? "The server is away; this page goes on when it is back." : error.message, away);
      if (away) await new Promise((done) => setTimeout(done, 1000));
    }
  }
  view.busy = false;
}

async function show_picture(blob, { header, full, layer, place, f, asked }) {
  const url = URL.createObjectURL(blob);
  const picture = Object.assign(new Image(), { id: "picture", alt: $("picture").alt, src: url, draggable: false });
  await picture.decode().catch(() => {});
  const size = [header.width * header.across_mm_per_pixel, header.height * header.up_mm_per_pixel];
  Object.assign(picture.style, { left: `${place.left}px`, top: `${place.top}px`, width: `${size[0] / f.pixel}px`,
    height: `${size[1] / f.pixel}px` });
  picture.dataset.stage = full ? "full" : "coarse";
  picture.dataset.layer = layer ? String(asked.plane.layer.layer) : "";
  $("picture").replaceWith(picture);
  if (view.urls[full]) URL.revokeObjectURL(view.urls[full]);
  view.urls[full] = url;
  if (view.part) {
    const left = place.left - f.width / 2, top = f.rows / 2 - place.top;
    const corner = (x, y) => add(add(f.at, f.across, left * f.pixel + x), f.up, top * f.pixel - size[1] + y);
    view.part.set_picture(picture, [corner(0, 0), corner(size[0], 0), corner(0, size[1]), corner(...size)]);
    if (header.colours?.length > 0) view.part.set_colours(header.colours, header.range && [header.range.min, header.range.max]);
    else view.part.set_colours([0xed9e40ff], null);
  }
  if (!full) return;
  $("download").href = url;
  show_legend(header, shows_materials() ? state.printing.materials : [],
    { legend: $("legend"), histogram: $("histogram"), list: $("range") });
  const where = layer ? `Layer ${asked.plane.layer.layer} of ${view.grid.extent.layers}, voxels of ` +
    `${show(header.across_mm_per_pixel)} x ${show(header.up_mm_per_pixel)} mm` :
    `${show(header.across_mm_per_pixel)} mm a pixel` + (is_layer() ? "; larger shows the voxels" : "");
  say(Number(header.pixels_inside) === 0 ? "The plane misses the part." : `${where}, ${show(header.worked_ms)} ms`);
}

/** What depends on the state without the server's help. */
function show_plane() {
  const f = frame(), layered = is_layer();
  $("height").max = layered ? view.grid.extent.layers - 1 : 1000;
  $("height").value = layered ? layer_number() : 1000 * state.height;
  $("height-text").textContent = (layered ? `layer ${layer_number()}, ` : "") + `${show(f.height)} mm`;
  $("azimuth-text").textContent = `${state.azimuth}°`;
  $("elevation-text").textContent = `${state.elevation}°`;
  $("angles").hidden = state.axis !== "free";
  $("pitch-label").hidden = state.axis !== "layer" && state.show !== "halftone";
  $("voxels").hidden = state.axis !== "layer";
  $("of-channel").hidden = state.show !== "channel";
  $("of-materials").hidden = !shows_materials();
  $("of-halftone").hidden = state.show !== "halftone";
  view.part?.set_plane({ normal: f.normal, across: f.across, up: f.up, height: f.height });
}

function keep() {
  history.replaceState(null, "", "#view=" + encodeURIComponent(JSON.stringify(state)));
}

function change(values, rest = {}) {
  Object.assign(state, values);
  if (rest.fit) Object.assign(state, { zoom: 1, pan: [0, 0] });
  if (shows_materials() && !state.printing) choose_mixing(mesh().channels[0]?.name);
  show_plane();
  if (!rest.resized) {
    $("cross").hidden = true;
    $("probe").textContent = "";
  }
  keep();
  view.wanted = true;
  draw();
}

function fill(select, entries, chosen) {
  select.replaceChildren(...entries.map(([value, text]) => new Option(text, value, false, value === chosen)));
}

/** Another channel that mixes the materials: these begin anew at its ends. */
function choose_mixing(name) {
  state.printing = default_printing(mesh().channels.find((c) => c.name === name));
  show_printing();
}

function show_printing() {
  const { printing } = state;
  $("mixed-by").value = printing.channel;
  $("method").value = printing.method;
  $("seed").value = printing.seed;
  const listed = () => { $("add-material").disabled = printing.materials.length >= most_materials; };
  list_materials($("materials"), printing, () => {
    listed();
    change({});
  });
  listed();
}

function choose_mesh(id, rest = { fit: true }) {
  const same = state.mesh === id;
  state.mesh = id;
  const channels = mesh().channels.map((c) => c.name), options = channels.map((name) => [name, name]);
  if (!channels.includes(state.channel)) state.channel = channels[0] ?? "";
  if (channels.length === 0) state.show = "occupancy";
  for (const option of $("show").options) option.disabled = channels.length === 0 && option.value !== "occupancy";
  fill($("channel"), options, state.channel);
  fill($("mixed-by"), options, state.printing?.channel);
  if (!same || !channels.includes(state.printing?.channel)) state.printing = null;
  else show_printing();
  if (!same || !state.pitch) {
    const part = box(), size = Math.max(...add(part.high, part.low, -1));
    state.pitch = Array(3).fill(Number((size / 250).toPrecision(1)));
  }
  $("pitch").value = state.pitch.join(", ");
  $("show").value = state.show;
  change({}, rest);
}

function choose_pitch() {
  const numbers = $("pitch").value.split(/[\s,;]+/).filter(Boolean).map(Number);
  const good = [1, 3].includes(numbers.length) && numbers.every((x) => x > 0 && Number.isFinite(x));
  $("pitch").setAttribute("aria-invalid", String(!good));
  if (!good) return say("Voxels are so large in mm: one number, or three, x, y, z.");
  return change({ pitch: numbers.length === 1 ? Array(3).fill(numbers[0]) : numbers });
}

/** What is under a place of the stage. */
const tell = (text) => { $("probe").textContent = text; };

async function probe(x, y) {
  const f = frame();
  const right = (x / f.stage.width - 0.5) * f.width * f.pixel, above = (0.5 - y / f.stage.height) * f.rows * f.pixel;
  const point = add(add(f.at, f.across, right), f.up, above);
  Object.assign($("cross").style, { left: `${x}px`, top: `${y}px` });
  $("cross").hidden = false;
  let place = `(${point.map(show).join(", ")}) mm`;
  if (is_layer()) {
    const { origin_mm, pitch } = view.grid;
    place += `, voxel (${Math.floor((point[0] - origin_mm.x) / pitch.x_mm)}, ` +
      `${Math.floor((point[1] - origin_mm.y) / pitch.y_mm)}, ${layer_number()})`;
  }
  try {
    const answer = await (await post("api/probe", { mesh_id: state.mesh, points_mm: point })).json();
    if (answer.locations[0] !== "POINT_LOCATION_INSIDE") return tell(`${place}: outside`);
    const values = mesh().channels.map((c, i) => `${c.name} ${show(answer.materials[i])}`);
    return tell(`${place}: cell ${answer.control_cells[0]}, (u, v, w) = (${answer.uvw.map(show).join(", ")}), ` +
      values.join(", "));
  } catch (error) {
    return tell(error.message);
  }
}

function move(right, up) {
  const f = frame();
  change({ pan: [state.pan[0] + right * f.pixel, state.pan[1] + up * f.pixel] });
}
const zoom = (times) => change({ zoom: clamp(state.zoom * times, 0.05, 100000) });
/** So that a voxel is 16 pixels wide. */
const zoom_to_voxels = () => zoom((16 * frame().pixel) / Math.min(state.pitch[0], state.pitch[1]));
const step = (by) => change({ height: clamp(state.height + (is_layer() ? Math.sign(by) / view.grid.extent.layers : by), 0, 1) });

function turn(azimuth, elevation) {
  state.camera = { ...state.camera, azimuth, elevation };
  view.part.set_camera(state.camera);
  keep();
}
function near(times) {
  state.camera.near = clamp(state.camera.near * times, 0.2, 50);
  view.part.set_camera(state.camera);
  keep();
}

function listen_to_controls() {
  $("mesh").onchange = () => choose_mesh($("mesh").value);
  $("axis").onchange = () => change({ axis: $("axis").value }, { fit: true });
  for (const id of ["show", "channel", "colours"]) $(id).onchange = () => change({ [id]: $(id).value });
  for (const id of ["fixed", "lines"]) $(id).onchange = () => change({ [id]: $(id).checked });
  $("height").oninput = () => {
    const value = Number($("height").value);
    change({ height: is_layer() ? (value + 0.5) / view.grid.extent.layers : value / 1000 });
  };
  for (const id of ["azimuth", "elevation"]) $(id).oninput = () => change({ [id]: Number($(id).value) });
  $("pitch").onchange = choose_pitch;
  $("mixed-by").onchange = () => {
    choose_mixing($("mixed-by").value);
    change({});
  };
  $("add-material").onclick = () => {
    add_material(state.printing);
    show_printing();
    change({});
  };
  $("method").onchange = () => change({ printing: { ...state.printing, method: $("method").value } });
  $("seed").onchange = () => {
    if ($("seed").reportValidity()) change({ printing: { ...state.printing, seed: Number($("seed").value) } });
  };
  $("smaller").onclick = () => zoom(1 / 1.5);
  $("larger").onclick = () => zoom(1.5);
  $("fit").onclick = () => change({}, { fit: true });
  $("voxels").onclick = zoom_to_voxels;
  $("controls").onsubmit = (event) => event.preventDefault();
  dark.onchange = () => change({});
}

function listen_to_stage() {
  const stage = $("stage");
  let drag = null;
  stage.onpointerdown = (event) => {
    drag = { x: event.clientX, y: event.clientY, moved: false };
    stage.setPointerCapture(event.pointerId);
  };
  stage.onpointermove = (event) => {
    if (!drag) return;
    const dx = event.clientX - drag.x, dy = event.clientY - drag.y;
    if (!drag.moved && Math.hypot(dx, dy) < 4) return;
    Object.assign(drag, { x: event.clientX, y: event.clientY, moved: true });
    move(-dx, dy);
  };
  stage.onpointerup = (event) => {
    const rectangle = stage.getBoundingClientRect();
    if (drag && !drag.moved) probe(event.clientX - rectangle.left, event.clientY - rectangle.top);
    drag = null;
  };
  stage.addEventListener("wheel", (event) => {
    event.preventDefault();
    if (event.shiftKey) zoom(event.deltaY + event.deltaX < 0 ? 1.2 : 1 / 1.2);
    else step(event.deltaY < 0 ? 0.01 : -0.01);
  }, { passive: false });
  on_keys(stage, {
    ArrowLeft: () => move(-40, 0), ArrowRight: () => move(40, 0), ArrowUp: () => move(0, 40),
    ArrowDown: () => move(0, -40), "+": () => zoom(1.5), "-": () => zoom(1 / 1.5), PageUp: () => step(0.01),
    PageDown: () => step(-0.01), Enter: () => probe(stage.clientWidth / 2, stage.clientHeight / 2) });
  new ResizeObserver(() => state.mesh && change({}, { resized: true })).observe(stage);
}

function on_keys(element, keys) {
  element.onkeydown = (event) => {
    if (!keys[event.key] || event.ctrlKey || event.altKey || event.metaKey) return;
    event.preventDefault();
    keys[event.key]();
  };
}

function listen_to_part() {
  const turn_by = (azimuth, elevation) => view.part.turn(azimuth, elevation);
  try {
    view.part = new PartView($("part"), { turn, near, move(mm) {
      const part = box(), { normal } = frame();
      change({ height: clamp(state.height + mm / (2 * reach(part, normal)), 0, 1) });
    } });
  } catch {
    $("part").hidden = true;
    $("no-part").hidden = false;
    $("no-part").textContent = "This browser has no WebGL 2, so the part isn't shown in space. The cut is.";
    return;
  }
  view.part.set_camera(state.camera);
  on_keys($("part"), {
    ArrowLeft: () => turn_by(-10, 0), ArrowRight: () => turn_by(10, 0), ArrowUp: () => turn_by(0, -10),
    ArrowDown: () => turn_by(0, 10), "+": () => near(1.25), "-": () => near(1 / 1.25), PageUp: () => step(0.01),
    PageDown: () => step(-0.01), Home: () => {
      state.camera.near = 1;
      turn(40, 25);
    } });
}

async function start() {
  const fragment = new URLSearchParams(location.hash.slice(1));
  if (fragment.has("token")) {
    await post("api/session", { token: fragment.get("token") });
    history.replaceState(null, "", location.pathname);
  }
  const saved = fragment.get("view");
  const known = await (await call("api/meshes")).json();
  view.meshes = known.meshes;
  if (view.meshes.length === 0) return say("The server holds no part: upload one, and load this page again.");
  if (saved) Object.assign(state, JSON.parse(saved));
  if (!mesh()) state.mesh = known.first ?? view.meshes[0].mesh_id;
  const name_of = (id) => (id === known.first && known.name ? known.name : id.slice(0, 15));
  fill($("mesh"), view.meshes.map((m) => [m.mesh_id, name_of(m.mesh_id)]), state.mesh);
  for (const id of ["axis", "colours", "azimuth", "elevation"]) $(id).value = state[id];
  for (const id of ["fixed", "lines"]) $(id).checked = state[id];
  listen_to_controls();
  listen_to_part();
  listen_to_stage();
  return choose_mesh(state.mesh, { fit: !saved });
}

start().catch((error) => say(error.status === 401 ?
  "This page needs the address that ccslice view printed, token included." : error.message, true));
