// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The page of `ccslice view`. It asks for one picture at a time: while one is on its way only the latest view waits, so
// a drag never queues. While something moves, coarse pictures come; when it rests, the full one.
"use strict";

const $ = (id) => document.getElementById(id);
const state = { mesh: null, axis: "z", azimuth: 30, elevation: 45, height: 0.5, channel: "", colours:
  "COLOUR_MAP_NAME_VIRIDIS", fixed: true, zoom: 1, pan: [0, 0] };
const view = { meshes: [], busy: false, wanted: null, urls: {} };

async function call(path, options = {}) {
  const response = await fetch(path, { credentials: "same-origin", ...options });
  if (response.ok) return response;
  let message = response.statusText;
  try {
    message = (await response.json()).error.message;
  } catch {
    // No answer of ours.
  }
  throw Object.assign(new Error(message), { status: response.status });
}
const post = (path, body) =>
  call(path, { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(body) });

function say(text, away = false) {
  $("status").textContent = text;
  $("status").classList.toggle("away", away);
}
const show = (number) => Number(number).toPrecision(4).replace(/\.?0+(e|$)/, "$1");

// Vectors.
const add = (a, b, s = 1) => a.map((x, i) => x + s * b[i]);
const dot = (a, b) => a.reduce((sum, x, i) => sum + x * b[i], 0);
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = (a) => a.map((x) => x / Math.sqrt(dot(a, a)));
const message = (a) => ({ x: a[0], y: a[1], z: a[2] });

function mesh() {
  return view.meshes.find((m) => m.mesh_id === state.mesh);
}

function box() {
  const of = (v) => [v.x, v.y, v.z];
  const { min_mm, max_mm } = mesh().bounding_box;
  return { low: of(min_mm), high: of(max_mm) };
}

// The plane's axes and place, and the size of the picture.
function frame() {
  const rad = Math.PI / 180;
  const normals = { z: [0, 0, 1], y: [0, -1, 0], x: [1, 0, 0] };
  const normal = normals[state.axis] ?? [
    Math.cos(state.elevation * rad) * Math.cos(state.azimuth * rad),
    Math.cos(state.elevation * rad) * Math.sin(state.azimuth * rad), Math.sin(state.elevation * rad)];
  let up = add([0, 0, 1], normal, -normal[2]);
  up = dot(up, up) < 1e-12 ? [0, 1, 0] : unit(up);
  const across = cross(up, normal);
  const { low, high } = box();
  const middle = add(low, high).map((x) => x / 2), half = add(high, low, -1).map((x) => x / 2);
  const reach = (axis) => axis.reduce((sum, x, i) => sum + Math.abs(x) * half[i], 0);
  const height = dot(middle, normal) + (2 * state.height - 1) * reach(normal);
  const stage = $("stage").getBoundingClientRect();
  const width = Math.max(16, Math.min(2048, Math.round(stage.width)));
  const rows = Math.max(16, Math.min(2048, Math.round(stage.height)));
  const pixel = 1.04 * Math.max((2 * reach(across)) / width, (2 * reach(up)) / rows) / state.zoom;
  let at = add(middle, normal, height - dot(middle, normal));
  at = add(add(at, across, state.pan[0]), up, state.pan[1]);
  return { normal, across, up, at, height, width, rows, pixel, stage };
}

function request(coarse) {
  const f = frame();
  const channel = mesh().channels.find((c) => c.name === state.channel);
  const content = channel
    ? { channel: { channel: channel.name, colours: state.colours,
        ...(state.fixed && channel.min_value < channel.max_value
          ? { range: { min: channel.min_value, max: channel.max_value } } : {}) } }
    : { occupancy: {} };
  return { mesh_id: state.mesh, width: f.width, height: f.rows, coarse, content,
    plane: { free: { middle_mm: message(f.at), across: message(f.across), up: message(f.up),
      across_mm_per_pixel: f.pixel } } };
}

// Draws the latest view that was wanted; at most one request is under way.
async function draw() {
  if (view.busy) return;
  view.busy = true;
  let coarse = true;
  while (view.wanted || coarse) {
    coarse = Boolean(view.wanted);
    view.wanted = null;
    try {
      const response = await post(`api/preview?stage=${coarse ? "coarse" : "full"}`, request(coarse));
      const header = JSON.parse(response.headers.get("Ccslice-Preview"));
      await show_picture(await response.blob(), header, coarse);
    } catch (error) {
      if (error.status === 409) continue;
      const away = error.status === undefined || error.status === 503;
      say(away ? "The server is away; this page goes on when it is back." : error.message, away);
      if (!away) break;
      await new Promise((done) => setTimeout(done, 1000));
      view.wanted = true;
    }
  }
  view.busy = false;
}

async function show_picture(blob, header, coarse) {
  const url = URL.createObjectURL(blob), picture = $("picture");
  picture.src = url;
  await picture.decode().catch(() => {});  // From here on it is to be seen.
  const kind = coarse ? "coarse" : "full";
  picture.dataset.stage = kind;
  if (view.urls[kind]) URL.revokeObjectURL(view.urls[kind]);
  view.urls[kind] = url;
  if (coarse) return;
  $("download").href = url;
  legend(header);
  say(Number(header.pixels_inside) === 0 ? "The plane misses the part." :
    `${show(header.across_mm_per_pixel)} mm a pixel, ${show(header.worked_ms)} ms`);
}

function legend(header) {
  const context = $("legend").getContext("2d");
  context.clearRect(0, 0, 256, 12);
  const colours = header.colours ?? [];
  colours.forEach((rgba, i) => {
    context.fillStyle = "#" + (rgba >>> 8).toString(16).padStart(6, "0");
    context.fillRect((256 * i) / colours.length, 0, 256 / colours.length + 1, 12);
  });
  $("range").textContent = header.range ? `${show(header.range.min)} to ${show(header.range.max)}` : "";
}

function change(values, rest = {}) {
  Object.assign(state, values);
  if (rest.fit) Object.assign(state, { zoom: 1, pan: [0, 0] });
  const f = frame();
  $("height-text").textContent = `${show(f.height)} mm`;
  $("azimuth-text").textContent = `${state.azimuth}°`;
  $("elevation-text").textContent = `${state.elevation}°`;
  $("angles").hidden = state.axis !== "free";
  if (!rest.resized) {
    $("cross").hidden = true;
    $("probe").textContent = "";
  }
  history.replaceState(null, "", "#view=" + encodeURIComponent(JSON.stringify(state)));
  view.wanted = true;
  draw();
}

function fill(select, entries, chosen) {
  select.replaceChildren(...entries.map(([value, text]) => new Option(text, value, false, value === chosen)));
}

function choose_mesh(id) {
  state.mesh = id;
  const channels = mesh().channels.map((c) => c.name);
  if (!channels.includes(state.channel)) state.channel = channels[0] ?? "";
  fill($("channel"), [...channels.map((name) => [name, name]), ["", "material or none"]], state.channel);
  change({}, { fit: true });
}

// What is under a place of the stage.
const tell = (text) => { $("probe").textContent = text; };

async function probe(x, y) {
  const f = frame();
  const right = (x / f.stage.width - 0.5) * f.width * f.pixel, above = (0.5 - y / f.stage.height) * f.rows * f.pixel;
  const point = add(add(f.at, f.across, right), f.up, above);
  Object.assign($("cross").style, { left: `${x}px`, top: `${y}px` });
  $("cross").hidden = false;
  try {
    const answer = await (await post("api/probe", { mesh_id: state.mesh, points_mm: point })).json();
    const place = `(${point.map(show).join(", ")}) mm`;
    if (answer.locations[0] !== "POINT_LOCATION_INSIDE") return tell(`${place}: outside`);
    const values = mesh().channels.map((c, i) => `${c.name} ${show(answer.materials[i])}`);
    tell(`${place}: cell ${answer.control_cells[0]}, (u, v, w) = (${answer.uvw.map(show).join(", ")}), ` +
      values.join(", "));
  } catch (error) {
    tell(error.message);
  }
}

function move(right, up) {
  const f = frame();
  change({ pan: [state.pan[0] + right * f.pixel, state.pan[1] + up * f.pixel] });
}
const zoom = (times) => change({ zoom: Math.max(0.05, Math.min(1000, state.zoom * times)) });
const step = (by) => change({ height: Math.max(0, Math.min(1, state.height + by)) });

function listen() {
  $("mesh").onchange = () => choose_mesh($("mesh").value);
  $("axis").onchange = () => change({ axis: $("axis").value }, { fit: true });
  $("channel").onchange = () => change({ channel: $("channel").value });
  $("colours").onchange = () => change({ colours: $("colours").value });
  $("fixed").onchange = () => change({ fixed: $("fixed").checked });
  $("height").oninput = () => change({ height: $("height").value / 1000 });
  for (const id of ["azimuth", "elevation"]) $(id).oninput = () => change({ [id]: Number($(id).value) });
  $("smaller").onclick = () => zoom(1 / 1.5);
  $("larger").onclick = () => zoom(1.5);
  $("fit").onclick = () => change({}, { fit: true });
  $("controls").onsubmit = (event) => event.preventDefault();
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
    $("height").value = 1000 * state.height;
  }, { passive: false });
  stage.onkeydown = (event) => {
    const keys = {
      ArrowLeft: () => move(-40, 0), ArrowRight: () => move(40, 0), ArrowUp: () => move(0, 40),
      ArrowDown: () => move(0, -40), "+": () => zoom(1.5), "-": () => zoom(1 / 1.5), PageUp: () => step(0.01),
      PageDown: () => step(-0.01), Enter: () => probe(stage.clientWidth / 2, stage.clientHeight / 2) };
    if (!keys[event.key]) return;
    event.preventDefault();
    keys[event.key]();
    $("height").value = 1000 * state.height;
  };
  new ResizeObserver(() => state.mesh && change({}, { resized: true })).observe(stage);
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
  fill($("mesh"), view.meshes.map((m) => [m.mesh_id, m.mesh_id === known.first && known.name ? known.name : m.mesh_id.slice(0, 15)]), state.mesh);
  for (const id of ["axis", "colours"]) $(id).value = state[id];
  for (const id of ["azimuth", "elevation"]) $(id).value = state[id];
  $("fixed").checked = state.fixed;
  $("height").value = 1000 * state.height;
  const { zoom: kept, pan } = state;
  listen();
  choose_mesh(state.mesh);
  if (saved) change({ zoom: kept, pan });
}

start().catch((error) => say(error.status === 401 ?
  "This page needs the address that ccslice view printed, token included." : error.message, true));
