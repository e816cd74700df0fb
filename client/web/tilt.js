// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The handle that tilts the plane in the part's view: a ball at the end of the plane's normal, which stays under the
// pointer. It is an element of the page over the canvas, so that the keyboard reaches it, too.
import { add, angles, direction, dot, turned } from "./plane.js";

/** Of the keyboard, and of the pointer with Shift. */
const fine_degrees = 1, coarse_degrees = 5, snap_degrees = 15;

export class TiltHandle {
  /** `tilt(normal, pivot)` is called with where the plane's normal is to point, and the point that stays in it. */
  constructor(part, ball, stem, tilt) {
    Object.assign(this, { part, ball, stem, tilt, drag: null });
    ball.onpointerdown = (event) => this.grab(event);
    ball.onpointermove = (event) => {
      if (!this.drag) return;
      const [x, y] = this.drag.from;
      this.drag.moved ||= Math.hypot(event.clientX - x, event.clientY - y) > 2;  // A click moves nothing.
      if (this.drag.moved) this.pull(event);
    };
    ball.onpointerup = ball.onpointercancel = () => this.release();
  }

  length() {
    const { width, height } = this.part.axes();
    return 0.27 * Math.min(width, height);
  }

  pivot() { return this.drag?.pivot ?? this.part.plane.at; }

  /** Puts the handle where the plane is. */
  place() {
    const { scale, away } = this.part.axes(), { normal } = this.part.plane;
    const from = this.part.spot(this.pivot()), to = this.part.spot(add(this.pivot(), normal, this.length() / scale));
    this.ball.hidden = false;
    this.ball.classList.toggle("behind", dot(normal, away) < 0);
    Object.assign(this.ball.style, { left: `${to[0]}px`, top: `${to[1]}px` });
    ["x1", "y1", "x2", "y2"].forEach((name, i) => this.stem.setAttribute(name, [...from, ...to][i]));
  }

  grab(event) {
    if (event.button !== 0) return;
    event.preventDefault();  // Of text that would be selected.
    this.ball.focus();
    this.ball.setPointerCapture(event.pointerId);
    const box = this.ball.getBoundingClientRect();
    const off = [event.clientX - box.x - box.width / 2, event.clientY - box.y - box.height / 2];
    this.drag = { off, from: [event.clientX, event.clientY], moved: false, pivot: this.part.plane.at,
      behind: this.ball.classList.contains("behind") };
    this.ball.classList.add("held");
  }

  /** The ball goes to the place of its sphere that is seen under the pointer, or to the nearest one of the outline. */
  pull(event) {
    const { right, up, away } = this.part.axes(), { off, pivot, behind } = this.drag;
    const box = this.part.canvas.getBoundingClientRect(), from = this.part.spot(pivot), length = this.length();
    let x = (event.clientX - off[0] - box.x - from[0]) / length;
    let y = (from[1] - event.clientY + off[1] + box.y) / length;
    const far = Math.hypot(x, y);
    if (far > 1) [x, y] = [x / far, y / far];
    const z = Math.sqrt(Math.max(0, 1 - x * x - y * y)) * (behind ? -1 : 1);
    let normal = add(add(right.map((a) => a * x), up, y), away, z);
    if (event.shiftKey) {
      const { azimuth, elevation } = angles(normal, 0), snap = (a) => snap_degrees * Math.round(a / snap_degrees);
      normal = direction(snap(azimuth), snap(elevation));
    }
    this.tilt(normal, pivot);
  }

  release() {
    this.drag = null;
    this.ball.classList.remove("held");
    this.place();
  }

  /** By the arrow keys: as the ball goes on the screen. */
  step(right, up, fine) {
    const { normal, at } = this.part.plane, axes = this.part.axes(), by = fine ? fine_degrees : coarse_degrees;
    this.tilt(right ? turned(normal, axes.up, right * by) : turned(normal, axes.right, -up * by), at);
  }
}
