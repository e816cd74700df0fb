// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The page of `ccslice view`: what its controls, the mouse and the keyboard do.
import { call, post } from "./api.js";
import { default_printing, fits, way_of, ways_of } from "./materials.js";
import { fill, MaterialsForm } from "./materials_form.js";
import { PartView } from "./part.js";
import { draw, find_surface, first_picture, say, show_in_part } from "./pictures.js";
import { add, clamp, reach } from "./plane.js";
import { box, dark, frame, is_layer, layer_number, mesh, shows_materials, state, tilted, view } from "./state.js";
import { TiltHandle } from "./tilt.js";
import { show } from "./values.js";

const $ = (id) => document.getElementById(id);

/** What depends on the state without the server's help. */
function show_plane() {
  const f = frame(), layered = is_layer();
  $("height").max = layered ? view.grid.extent.layers - 1 : 1000;
  $("height").value = layered ? layer_number() : 1000 * state.height;
  $("height-text").textContent = (layered ? `layer ${layer_number()}, ` : "") + `${show(f.height)} mm`;
  for (const id of ["axis", "azimuth", "elevation"]) $(id).value = state[id];
  $("azimuth-text").textContent = `${state.azimuth}°`;
  $("elevation-text").textContent = `${state.elevation}°`;
  $("angles").hidden = state.axis !== "free";
  $("pitch-label").hidden = state.axis !== "layer" && state.show !== "halftone";
  $("voxels").hidden = state.axis !== "layer";
  $("of-channel").hidden = state.show !== "channel";
  $("of-materials").hidden = !shows_materials();
  $("of-halftone").hidden = state.show !== "halftone";
  view.part?.set_plane({ normal: f.normal, across: f.across, up: f.up, height: f.height, at: f.at });
}

function keep() {
  history.replaceState(null, "", "#view=" + encodeURIComponent(JSON.stringify(state)));
}

function change(values, rest = {}) {
  Object.assign(state, values);
  if (rest.fit) Object.assign(state, { zoom: 1, pan: [0, 0] });
  if (shows_materials() && !state.printing) choose_mixing(ways_of(mesh())[0][0]);
  show_plane();
  if (!rest.resized) {
    $("cross").hidden = true;
    $("probe").textContent = "";
  }
  keep();
  view.wanted = true;
  draw(show_plane);
}

const materials = new MaterialsForm(() => change({}));
/** What was mixed in each way before another one was looked at. */
const mixed = new Map();

/** Another way to mix the materials: with those that it had last, or anew. */
function choose_mixing(way) {
  if (state.printing) mixed.set(way_of(state.printing), state.printing);
  state.printing = mixed.get(way) ?? default_printing(way, mesh());
  materials.show(state.printing, mesh());
}

function choose_mesh(id, rest = { fit: true }) {
  const same = state.mesh === id;
  state.mesh = id;
  const channels = mesh().channels.map((c) => c.name), options = channels.map((name) => [name, name]);
  if (!channels.includes(state.channel)) state.channel = channels[0] ?? "";
  const ways = ways_of(mesh());
  const can_show = (what) => what === "occupancy" || (what === "channel" ? channels : ways).length > 0;
  if (!can_show(state.show)) state.show = "occupancy";
  for (const option of $("show").options) option.disabled = !can_show(option.value);
  fill($("channel"), options, state.channel);
  mixed.clear();
  if (!same || !fits(state.printing, mesh())) state.printing = null;
  fill($("mixed-by"), ways, state.printing ? way_of(state.printing) : "");
  if (state.printing) materials.show(state.printing, mesh());
  if (!same || !state.pitch) {
    const part = box(), size = Math.max(...add(part.high, part.low, -1));
    state.pitch = Array(3).fill(Number((size / 250).toPrecision(1)));
  }
  $("pitch").value = state.pitch.join(", ");
  $("show").value = state.show;
  document.title = `${$("mesh").selectedOptions[0].text} - ccslice view`;
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
    const values = mesh().channels.map((c, i) => `${c.name} ${show(answer.channel_values[i])}`);
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
  $("axis").onchange = () => change({ axis: $("axis").value, up: null }, { fit: true });
  for (const id of ["show", "channel", "colours"]) $(id).onchange = () => change({ [id]: $(id).value });
  for (const id of ["fixed", "lines"]) $(id).onchange = () => change({ [id]: $(id).checked });
  $("height").oninput = () => {
    const value = Number($("height").value);
    change({ height: is_layer() ? (value + 0.5) / view.grid.extent.layers : value / 1000 });
  };
  for (const id of ["azimuth", "elevation"]) $(id).oninput = () => change({ [id]: Number($(id).value), up: null });
  $("pitch").onchange = choose_pitch;
  $("mixed-by").onchange = () => {
    choose_mixing($("mixed-by").value);
    change({});
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
  const size = () => `${stage.clientWidth} ${stage.clientHeight}`;
  let last = size();
  new ResizeObserver(() => {
    if (size() === last) return;  // It begins with the size that there is.
    last = size();
    change({}, { resized: true });
  }).observe(stage);
}

/** What keys do in an element: they get whether Shift is held. */
function on_keys(element, keys) {
  element.onkeydown = (event) => {
    if (!keys[event.key] || event.ctrlKey || event.altKey || event.metaKey) return;
    event.preventDefault();
    keys[event.key](event.shiftKey);
  };
}

/** The part in space, with what has been shown before. */
function add_part() {
  listen_to_part();
  if (!view.part) return;
  show_plane();
  show_in_part();
  if (!view.busy) find_surface();
}

function listen_to_part() {
  const turn_by = (azimuth, elevation) => view.part.turn(azimuth, elevation);
  try {
    view.part = new PartView($("part"), { turn, near, drawn: () => handle.place(), move(mm) {
      const part = box(), { normal } = frame();
      change({ height: clamp(state.height + mm / (2 * reach(part, normal)), 0, 1) });
    } });
  } catch {
    $("handle").hidden = $("space-hint").hidden = true;
    $("part").hidden = true;
    $("no-part").hidden = false;
    $("no-part").textContent = "This browser has no WebGL 2, so the part isn't shown in space. The cut is.";
    return;
  }
  const handle = new TiltHandle(view.part, $("tilt"), $("stem"), (normal, pivot) => change(tilted(normal, pivot)));
  view.part.set_camera(state.camera);
  on_keys($("tilt"), {
    ArrowLeft: (fine) => handle.step(-1, 0, fine), ArrowRight: (fine) => handle.step(1, 0, fine),
    ArrowUp: (fine) => handle.step(0, 1, fine), ArrowDown: (fine) => handle.step(0, -1, fine),
    PageUp: () => step(0.01), PageDown: () => step(-0.01) });
  on_keys($("part"), {
    ArrowLeft: () => turn_by(-10, 0), ArrowRight: () => turn_by(10, 0), ArrowUp: () => turn_by(0, -10),
    ArrowDown: () => turn_by(0, 10), "+": () => near(1.25), "-": () => near(1 / 1.25), PageUp: () => step(0.01),
    PageDown: () => step(-0.01), Home: () => {
      state.camera.near = 1;
      turn(40, 25);
    } });
}

async function start() {
  const fragment = new URLSearchParams(location.hash.slice(1)), token = fragment.get("token");
  const saved = fragment.get("view");
  // Two at once: the cookie of the one isn't there yet for the other.
  const [known] = await Promise.all([
    call("api/meshes", token ? { headers: { Authorization: `Bearer ${token}` } } : {}).then((answer) => answer.json()),
    token && post("api/session", { token })]);
  if (token) history.replaceState(null, "", location.pathname);
  view.meshes = known.meshes;
  if (view.meshes.length === 0) return say("The server holds no part: upload one, and load this page again.");
  if (saved) Object.assign(state, JSON.parse(saved));
  if (!mesh()) state.mesh = known.first ?? view.meshes[0].mesh_id;
  const name_of = (id) => (id === known.first && known.name ? known.name : id.slice(0, 15));
  fill($("mesh"), view.meshes.map((m) => [m.mesh_id, name_of(m.mesh_id)]), state.mesh);
  $("colours").value = state.colours;
  for (const id of ["fixed", "lines"]) $(id).checked = state[id];
  listen_to_controls();
  listen_to_stage();
  choose_mesh(state.mesh, { fit: !saved });
  // WebGL may take a second to begin, while nothing else is done.
  await first_picture;
  add_part();
}

start().catch((error) => say(error.status === 401 ?
  "This page needs the address that ccslice view printed, token included." : error.message, true));
