// The panorama: look around from where it was taken, or see the whole picture flat.

import { distanceToBox, roomPartOnRay } from "./boxes.js";
import { action, oncePerFrame, toggle, tween } from "./dom.js";
import { onDrag, onKeys, onPoint, onTap, onWheel } from "./gestures.js";
import { Labels } from "./labels.js";
import { FlatLens, PerspectiveLens, lonLatOf } from "./lenses.js";
import { Overlay } from "./overlay.js";
import { PhotoPainter } from "./photo.js";

const WIDEST = (110 * Math.PI) / 180;
const NARROWEST = (20 * Math.PI) / 180;
const START_LAT = -0.2;
const START_FOV = (72 * Math.PI) / 180;
const STEEPEST = (88 * Math.PI) / 180;

/** Where most is to be seen: towards the middle of the corners, or ahead from the middle. */
function startView(polygon) {
  const [x, y] = [0, 1].map((axis) => polygon.reduce((sum, corner) => sum + corner[axis], 0));
  const isAside = Math.hypot(x, y) / polygon.length > 0.3;
  return { lon: isAside ? Math.atan2(x, y) : 0, lat: START_LAT, fov: START_FOV };
}

export class PanoramaView {
  constructor(card, image, report, store, drawable, hint) {
    this.stage = card.querySelector(".stage");
    this.report = report;
    this.store = store;
    this.start = startView(report.layout.polygon);
    this.view = { ...this.start };
    this.eye = [0, 0, report.camera_height];
    this.perspective = new PerspectiveLens(this.eye);
    this.flat = new FlatLens(this.eye);
    this.isFlat = !drawable;
    this.lookListeners = [];
    this.stop = () => {};
    this.overlay = new Overlay(this.stage, report);
    this.labels = new Labels(this.stage, report.objects.map(({ name }) => name));
    this.draw = oncePerFrame(() => this.drawNow());
    this.painter = drawable ? new PhotoPainter(this.stage, image) : null;
    this.addTools(card.querySelector(".tools"));
    this.listen(hint);
    this.mark();
    // it reports the first size, too
    new ResizeObserver(() => this.resize()).observe(this.stage);
  }

  get lens() {
    return this.isFlat ? this.flat : this.perspective;
  }

  addTools(tools) {
    const flat = toggle("Flat", this.isFlat, (value) => {
      this.isFlat = value;
      flat.show(value);
      this.draw();
    });
    flat.button.title = "The whole panorama at once";
    flat.button.disabled = this.painter === null;
    tools.append(
      action("−", "Zoom out", () => this.zoom(1.2)),
      action("+", "Zoom in", () => this.zoom(1 / 1.2)),
      action("Reset", "Look as at the start", () => this.reset()),
      flat.button,
    );
  }

  listen(hint) {
    const { stage, store } = this;
    onWheel(stage, (factor) => this.zoom(factor), hint);
    onDrag(stage, (dx, dy) => this.turn(-dx / this.perspective.focal, dy / this.perspective.focal),
      (factor) => this.zoom(1 / factor));
    onTap(stage, (x, y, target) => store.select(Labels.nameAt(target) ?? this.nameAt(x, y), "panorama"));
    onPoint(
      stage,
      (x, y, target) => {
        const name = Labels.nameAt(target) ?? this.nameAt(x, y);
        const isObject = this.report.objects.some((thing) => thing.name === name);
        store.hover(isObject ? [name] : []);
        stage.classList.toggle("on-object", isObject);
      },
      () => store.hover([]),
    );
    onKeys(stage, (x, y) => this.turn(0.09 * x, -0.09 * y), (key) => this.press(key));
    store.on("selection", () => this.mark());
    store.on("boxes", () => this.draw());
    store.on("display", () => this.mark());
  }

  press(key) {
    if (key === "+" || key === "=") this.zoom(1 / 1.15);
    else if (key === "-" || key === "_") this.zoom(1.15);
    else if (key === "0") this.reset();
    else if (key === "n") this.store.step(1, "keys");
    else if (key === "p") this.store.step(-1, "keys");
    else return false;
    return true;
  }

  turn(lon, lat) {
    if (this.isFlat) return;
    this.stop();
    this.view.lon = this.view.lon + lon;
    this.view.lat = Math.max(-STEEPEST, Math.min(STEEPEST, this.view.lat + lat));
    this.draw();
  }

  zoom(factor) {
    if (this.isFlat) return;
    this.stop();
    this.view.fov = Math.max(NARROWEST, Math.min(WIDEST, this.view.fov * factor));
    this.draw();
  }

  reset() {
    this.lookAt(this.start.lon, this.start.lat, this.start.fov);
  }

  /** Turn there, the shorter way. */
  lookAt(lon, lat, fov = this.view.fov) {
    this.stop();
    const from = { ...this.view };
    const way = lon - from.lon;
    const shorter = way - 2 * Math.PI * Math.round(way / (2 * Math.PI));
    this.stop = tween(500, (share) => {
      this.view.lon = from.lon + share * shorter;
      this.view.lat = from.lat + share * (lat - from.lat);
      this.view.fov = from.fov + share * (fov - from.fov);
      this.draw();
    });
  }

  mark() {
    const { store, stage } = this;
    const { names, source } = store.selected;
    stage.dataset.selected = names.join(" ");
    this.overlay.mark(store);
    this.overlay.sort(store, this.eye);
    if (names.join() !== this.lookedAt && names.length > 0 && source !== "panorama") {
      const k = this.report.objects.findIndex(({ name }) => name === names[0]);
      if (k >= 0) this.show(store.boxes[k]);
    }
    this.lookedAt = names.join();
    this.draw();
  }

  /** Turn to a box, unless it is well in view. */
  show({ centre }) {
    const place = this.perspective.pixel(centre);
    const { width, height } = this.perspective;
    const inside = (value, length) => value > 0.2 * length && value < 0.8 * length;
    if (place !== null && inside(place.x, width) && inside(place.y, height)) return;
    const [lon, lat] = lonLatOf(centre.map((value, axis) => value - this.eye[axis]));
    this.lookAt(lon, Math.max(-1.2, Math.min(1.2, lat)));
  }

  /** What is at a pixel: an object, else a part of the room. */
  nameAt(x, y) {
    const direction = this.lens.direction(x, y);
    if (direction === null) return null;
    let nearest = Infinity, name = null;
    this.store.boxes.forEach((box, k) => {
      const distance = distanceToBox(this.eye, direction, box);
      if (distance < nearest) {
        nearest = distance;
        name = this.report.objects[k].name;
      }
    });
    return name ?? roomPartOnRay(this.eye, direction, this.report.layout);
  }

  /** The pixel of an object's centre. */
  pixelOf(k) {
    return this.lens.pixel(this.store.boxes[k].centre);
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.stage;
    if (width === 0 || height === 0) return;
    this.size = { width, height };
    this.painter?.resize(width, height);
    this.drawNow();
  }

  drawNow() {
    const { width, height } = this.size ?? {};
    if (width === undefined) return;
    const { lon, lat, fov } = this.view;
    this.perspective.look(lon, lat, fov, width, height);
    this.flat.fit(width, height);
    this.stage.classList.toggle("flat", this.isFlat);
    if (!this.isFlat) this.painter.draw(this.perspective);
    this.overlay.draw(this.store, this.lens);
    const tops = this.store.boxes.map((box) => this.labelPlace(box));
    this.labels.place(tops, this.store, width, height);
    for (const listen of this.lookListeners) listen(this.isFlat ? null : this.perspective);
  }

  labelPlace({ centre, size }) {
    return this.lens.pixel([centre[0], centre[1], centre[2] + size[2] / 2]);
  }
}
