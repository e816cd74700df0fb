// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The part in space, cut open along the plane, with the picture of the cut in it. The half on the viewer's side of the
// plane is a shadow of itself; the boundary seen from inside, where the picture doesn't reach, is of one colour.
import { add, clamp, cross, direction, dot, middle, reach } from "./plane.js";

const surface_vertex = `#version 300 es
uniform mat4 view;
in vec3 place; in float value;
out vec3 at; out float share;
uniform vec2 range;
void main() {
  at = place;
  share = (value - range.x) / max(range.y - range.x, 1e-30);
  gl_Position = view * vec4(place, 1.0);
}`;
const surface_fragment = `#version 300 es
precision highp float;
uniform vec4 plane;        // Its normal, towards the viewer, and its height.
uniform vec3 away;         // From the part to the viewer.
uniform vec3 colours[32];
uniform float ghost;       // 1 for the half that the cut takes away.
in vec3 at; in float share;
out vec4 colour;
void main() {
  bool taken = dot(at, plane.xyz) > plane.w;
  if (taken != (ghost > 0.5)) discard;
  float step = clamp(share, 0.0, 1.0) * 31.0;
  vec3 own = mix(colours[int(step)], colours[min(int(step) + 1, 31)], fract(step));
  vec3 normal = normalize(cross(dFdx(at), dFdy(at)));
  float light = 0.35 + 0.65 * abs(dot(normal, away));
  if (ghost > 0.5) colour = vec4(own * 0.07, 0.07);
  else colour = gl_FrontFacing ? vec4(own * light, 1.0) : vec4(own * 0.45 + 0.1, 1.0);
}`;
const flat_vertex = `#version 300 es
uniform mat4 view;
in vec3 place; in vec2 where;
out vec2 spot;
void main() { spot = where; gl_Position = view * vec4(place, 1.0); }`;
const flat_fragment = `#version 300 es
precision highp float;
uniform sampler2D picture;
uniform vec4 plain;        // Instead of the picture, unless its alpha is 0.
in vec2 spot;
out vec4 colour;
void main() {
  vec4 own = plain.a > 0.0 ? plain : texture(picture, spot);
  if (own.a == 0.0) discard;
  colour = vec4(own.rgb * own.a, own.a);
}`;

function program(gl, vertex, fragment, attributes) {
  const made = gl.createProgram();
  for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    gl.attachShader(made, shader);
  }
  attributes.forEach((name, i) => gl.bindAttribLocation(made, i, name));
  gl.linkProgram(made);
  if (!gl.getProgramParameter(made, gl.LINK_STATUS) && !gl.isContextLost()) throw new Error(gl.getProgramInfoLog(made));
  return { made, at: (name) => gl.getUniformLocation(made, name) };
}

export class PartView {
  /** `on`: { turn(azimuth, elevation), near(times), move(mm along the plane's normal), drawn() }. Throws without
   * WebGL 2. */
  constructor(canvas, on) {
    this.canvas = canvas;
    this.on = on;
    this.gl = canvas.getContext("webgl2", { antialias: true, premultipliedAlpha: true });
    if (!this.gl) throw new Error("no WebGL 2");
    this.camera = { azimuth: 40, elevation: 25, near: 1 };
    this.colours = new Float32Array(96).fill(0.6);
    this.range = [0, 1];
    this.set_up();
    canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
    canvas.addEventListener("webglcontextrestored", () => {
      this.set_up();
      if (this.surface) this.set_surface(this.surface);
      if (this.shown) this.set_picture(this.shown.image, this.shown.corners);
    });
    this.listen();
    new ResizeObserver(() => this.draw()).observe(canvas);
  }

  set_up() {
    const gl = this.gl;
    this.solid = program(gl, surface_vertex, surface_fragment, ["place", "value"]);
    this.flat = program(gl, flat_vertex, flat_fragment, ["place", "where"]);
    this.buffers = Object.fromEntries(["places", "values", "triangles", "flat"].map((n) => [n, gl.createBuffer()]));
    this.texture = gl.createTexture();
    this.count = 0;
  }

  /** { box, places: Float32Array of 3 a vertex, values: one a vertex or none, triangles: Uint32Array of 3 each }. */
  set_surface(surface) {
    const gl = this.gl;
    this.surface = surface;
    const values = surface.values.length > 0 ? surface.values : new Float32Array(surface.places.length / 3);
    for (const [buffer, data] of [[this.buffers.places, surface.places], [this.buffers.values, values]]) {
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
    }
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.buffers.triangles);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, surface.triangles, gl.STATIC_DRAW);
    this.count = surface.triangles.length;
    this.draw();
  }

  /** { normal, across, up, height, at }, the height along the normal, and the place that the plane is tilted about. */
  set_plane(plane) {
    this.plane = plane;
    this.draw();
  }

  /** Of the values' range: 0xRRGGBBAA each. No range: all is of the first colour. */
  set_colours(colours, range) {
    for (let i = 0; i < 32; ++i) {
      const rgba = colours[Math.floor((i * colours.length) / 32)];
      [24, 16, 8].forEach((shift, k) => { this.colours[3 * i + k] = ((rgba >>> shift) & 255) / 255; });
    }
    this.range = range ?? [0, 1];
    this.draw();
  }

  /** `corners`: lower left, lower right, upper left, upper right, in space. */
  set_picture(image, corners) {
    const gl = this.gl;
    this.shown = { image, corners };
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    gl.pixelStorei(gl.UNPACK_FLIP_Y_WEBGL, true);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, gl.RGBA, gl.UNSIGNED_BYTE, image);
    for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, name, gl.NEAREST);
    for (const name of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, name, gl.CLAMP_TO_EDGE);
    this.draw();
  }

  set_camera(camera) {
    Object.assign(this.camera, camera);
    this.draw();
  }

  /** Axes of the screen in space, and pixels a mm. */
  axes() {
    const { azimuth, elevation, near } = this.camera, { box } = this.surface;
    const away = direction(azimuth, elevation), right = direction(azimuth + 90, 0);
    const radius = 1.05 * Math.hypot(...[0, 1, 2].map((i) => (box.high[i] - box.low[i]) / 2));
    const { clientWidth: width, clientHeight: height } = this.canvas;
    return { away, right, up: cross(away, right), middle: middle(box), radius, width, height,
      scale: near * Math.min(width, height) / 2 / radius };
  }

  /** Where on the canvas a point in space is seen, in pixels from its upper left corner. */
  spot(point) {
    const { right, up, middle: at, scale, width, height } = this.axes(), from = add(point, at, -1);
    return [width / 2 + scale * dot(from, right), height / 2 - scale * dot(from, up)];
  }

  /** The corners of the frame that stands for the plane. */
  frame() {
    const { box } = this.surface, { across, up, normal, height } = this.plane;
    const at = add(middle(box), normal, height - dot(middle(box), normal));
    const margin = 0.04 * this.axes().radius, wide = reach(box, across) + margin, high = reach(box, up) + margin;
    return [[-1, -1], [1, -1], [-1, 1], [1, 1]].map(([x, y]) => add(add(at, across, x * wide), up, y * high));
  }

  draw() {
    if (this.asked || !this.surface || !this.plane) return;
    this.asked = requestAnimationFrame(() => {
      this.asked = null;
      this.draw_now();
    });
  }

  draw_now() {
    const gl = this.gl, ratio = devicePixelRatio || 1, { canvas } = this;
    const size = [canvas.clientWidth, canvas.clientHeight].map((x) => Math.max(1, Math.round(x * ratio)));
    if (canvas.width !== size[0] || canvas.height !== size[1]) [canvas.width, canvas.height] = size;
    gl.viewport(0, 0, ...size);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    const axes = this.axes(), view = this.matrix(axes);
    this.draw_surface(view, axes.away, 0);
    gl.depthMask(false);
    this.draw_surface(view, axes.away, 1);
    this.draw_cut(view);  // Over the shadow, so that its colours are true.
    this.draw_frame(view);
    gl.depthMask(true);
    canvas.dataset.drawn = String(this.count / 3);
    this.on.drawn();
  }

  /** By columns. What is nearer than the viewer's plane, or farther than the part, isn't cut off by depth. */
  matrix({ away, right, up, middle: at, radius, width, height, scale }) {
    const rows = [right.map((x) => (2 * scale * x) / width), up.map((x) => (2 * scale * x) / height),
      away.map((x) => -x / (2 * radius))];
    const columns = [0, 1, 2].flatMap((i) => [rows[0][i], rows[1][i], rows[2][i], 0]);
    return new Float32Array([...columns, ...rows.map((row) => -dot(row, at)), 1]);
  }

  draw_surface(view, away, ghost) {
    const gl = this.gl, { made, at } = this.solid, { normal, height } = this.plane;
    const side = dot(normal, away) >= 0 ? 1 : -1;
    gl.useProgram(made);
    gl.uniformMatrix4fv(at("view"), false, view);
    gl.uniform4f(at("plane"), ...normal.map((x) => side * x), side * height);
    gl.uniform3f(at("away"), ...away);
    gl.uniform3fv(at("colours"), this.colours);
    gl.uniform2f(at("range"), ...this.range);
    gl.uniform1f(at("ghost"), ghost);
    [[this.buffers.places, 3], [this.buffers.values, 1]].forEach(([buffer, numbers], i) => {
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      gl.enableVertexAttribArray(i);
      gl.vertexAttribPointer(i, numbers, gl.FLOAT, false, 0, 0);
    });
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.buffers.triangles);
    gl.drawElements(gl.TRIANGLES, this.count, gl.UNSIGNED_INT, 0);
  }

  draw_flat(view, corners, plain, mode) {
    const gl = this.gl, { made, at } = this.flat;
    const where = [[0, 0], [1, 0], [0, 1], [1, 1]];
    const order = mode === gl.LINE_LOOP ? [0, 1, 3, 2] : [0, 1, 2, 3];
    gl.useProgram(made);
    gl.uniformMatrix4fv(at("view"), false, view);
    gl.uniform4f(at("plain"), ...plain);
    gl.uniform1i(at("picture"), 0);
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers.flat);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(order.flatMap((i) => [...corners[i], ...where[i]])), gl.STREAM_DRAW);
    [3, 2].forEach((numbers, i) => {
      gl.enableVertexAttribArray(i);
      gl.vertexAttribPointer(i, numbers, gl.FLOAT, false, 20, 12 * i);
    });
    gl.drawArrays(mode, 0, 4);
  }

  draw_cut(view) {
    if (this.shown) this.draw_flat(view, this.shown.corners, [0, 0, 0, 0], this.gl.TRIANGLE_STRIP);
  }

  draw_frame(view) {
    const rgb = (getComputedStyle(this.canvas).color.match(/[\d.]+/g) ?? [0, 0, 0]).slice(0, 3).map((x) => x / 255);
    this.draw_flat(view, this.frame(), [...rgb, this.grabbed ? 0.12 : 0.05], this.gl.TRIANGLE_STRIP);
    this.draw_flat(view, this.frame(), [...rgb, 0.8], this.gl.LINE_LOOP);
  }

  /** Whether a drag that begins at this place of the canvas moves the plane. One seen from its edge is too thin to be
   * hit, and of one seen from right above no drag says how far. */
  hits(x, y) {
    const { away, right, up, middle: at, scale, width, height } = this.axes(), { normal } = this.plane;
    const along = dot(away, normal);
    if (Math.abs(along) < 0.02 || 1 - along * along < 0.01) return false;
    const start = add(add(at, right, (x - width / 2) / scale), up, (height / 2 - y) / scale);
    const hit = add(start, away, (this.plane.height - dot(start, normal)) / along);
    const corners = this.frame();
    return [1, 2].every((i) => {
      const side = add(corners[i], corners[0], -1), share = dot(add(hit, corners[0], -1), side) / dot(side, side);
      return share >= 0 && share <= 1;
    });
  }

  /** The millimetres along the normal that a drag of the plane stands for. */
  drag_mm(dx, dy) {
    const { right, up, scale } = this.axes(), { normal } = this.plane;
    const x = scale * dot(right, normal), y = -scale * dot(up, normal);
    return (dx * x + dy * y) / (x * x + y * y);
  }

  turn(dx, dy) {
    const azimuth = ((this.camera.azimuth - dx + 540) % 360) - 180;
    this.on.turn(azimuth, clamp(this.camera.elevation + dy, -90, 90));
  }

  listen() {
    const { canvas } = this;
    let drag = null;
    const ready = () => this.surface && this.plane;
    const spot = (event) => [event.offsetX, event.offsetY];
    canvas.onpointerdown = (event) => {
      if (!ready()) return;
      canvas.setPointerCapture(event.pointerId);
      const grabs = event.button === 0 && !event.shiftKey && this.hits(...spot(event));
      drag = { x: event.clientX, y: event.clientY, grabs };
      this.grabbed = grabs;
      this.draw();
    };
    canvas.onpointermove = (event) => {
      if (!ready()) return;
      canvas.style.cursor = drag?.grabs ? "grabbing" : this.hits(...spot(event)) ? "grab" : "move";
      if (!drag) return;
      const dx = event.clientX - drag.x, dy = event.clientY - drag.y;
      Object.assign(drag, { x: event.clientX, y: event.clientY });
      if (drag.grabs) this.on.move(this.drag_mm(dx, dy));
      else this.turn(dx / 2, dy / 2);
    };
    canvas.onpointerup = canvas.onpointercancel = () => {
      drag = null;
      this.grabbed = false;
      this.draw();
    };
    canvas.oncontextmenu = (event) => event.preventDefault();
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.on.near(event.deltaY < 0 ? 1.15 : 1 / 1.15);
    }, { passive: false });
  }
}
