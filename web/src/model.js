// The room in 3D: orbit around it with mouse, fingers or keys.

import {
  DirectionalLight,
  DoubleSide,
  HemisphereLight,
  Mesh,
  MeshBasicMaterial,
  PerspectiveCamera,
  Raycaster,
  Scene,
  SphereGeometry,
  Spherical,
  Vector2,
  Vector3,
  WebGLRenderer,
} from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";

import { action, oncePerFrame, toggle, tween } from "./dom.js";
import { Furniture } from "./furniture.js";
import { onKeys, onPoint, onTap, onWheel } from "./gestures.js";
import { Labels } from "./labels.js";
import { Shell } from "./shell.js";

const FOV = 38;
const START = new Vector3(-0.5, -1, 0.95).normalize();
const ABOVE = new Vector3(0, -0.001, 1).normalize();

export class ModelView {
  constructor(card, report, store, palette, hint) {
    this.stage = card.querySelector(".stage");
    this.report = report;
    this.store = store;
    this.palette = palette;
    this.renderer = new WebGLRenderer({ antialias: devicePixelRatio < 2, alpha: true });
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.autoUpdate = false;
    this.renderer.shadowMap.needsUpdate = true;
    this.renderer.domElement.classList.add("canvas");
    this.renderer.domElement.setAttribute("aria-hidden", "true");
    this.stage.prepend(this.renderer.domElement);
    this.camera = new PerspectiveCamera(FOV, 1, 0.05, 500);
    this.camera.up.set(0, 0, 1);
    this.caster = new Raycaster();
    this.build();
    this.labels = new Labels(this.stage, report.objects.map(({ name }) => name));
    this.draw = oncePerFrame(() => this.drawNow());
    this.orbit = this.makeControls(hint);
    this.stop = () => {};
    this.moved = false;
    this.sized = false;
    this.addTools(card.querySelector(".tools"));
    this.listen();
    this.mark();
    // it reports the first size, too
    new ResizeObserver(() => this.resize()).observe(this.stage);
  }

  build() {
    const { report, palette } = this;
    const { polygon, floor, ceiling } = report.layout;
    this.shell = new Shell(report.layout, palette);
    this.furniture = new Furniture(report, palette);
    this.furniture.place(this.store.boxes);
    this.furniture.outline(this.store.ghosts);
    const spot = new Mesh(new SphereGeometry(0.07, 16, 12), new MeshBasicMaterial({ side: DoubleSide }));
    spot.position.set(0, 0, report.camera_height);
    this.spot = spot;
    const xs = polygon.map(([x]) => x), ys = polygon.map(([, y]) => y);
    const low = new Vector3(Math.min(...xs), Math.min(...ys), floor);
    const high = new Vector3(Math.max(...xs), Math.max(...ys), ceiling);
    this.middle = low.clone().add(high).multiplyScalar(0.5);
    this.reach = high.distanceTo(low) / 2;
    this.ends = polygon.flatMap(([x, y]) => [new Vector3(x, y, floor), new Vector3(x, y, ceiling)]);
    this.scene = new Scene();
    this.scene.add(new HemisphereLight("#ffffff", "#e6e2da", 2.6), this.sun());
    this.scene.add(this.shell.group, this.furniture.group, spot);
  }

  sun() {
    const sun = new DirectionalLight("#ffffff", 1.1);
    const { middle, reach } = this;
    sun.position.copy(middle).add(new Vector3(-0.45, -0.35, 1.6).multiplyScalar(2 * reach));
    sun.target.position.copy(middle);
    sun.target.updateMatrixWorld();
    sun.castShadow = true;
    sun.shadow.mapSize.set(1024, 1024);
    sun.shadow.radius = 4;
    sun.shadow.normalBias = 0.03;
    Object.assign(sun.shadow.camera, {
      left: -reach, right: reach, top: reach, bottom: -reach, near: reach, far: 6 * reach,
    });
    return sun;
  }

  makeControls(hint) {
    onWheel(this.stage, null, hint);
    const orbit = new OrbitControls(this.camera, this.stage);
    orbit.target.copy(this.middle);
    orbit.maxPolarAngle = 0.6 * Math.PI;
    orbit.minDistance = 0.5;
    orbit.maxDistance = 20 * this.reach;
    orbit.addEventListener("change", this.draw);
    orbit.addEventListener("start", () => {
      this.stop();
      this.moved = true;
    });
    return orbit;
  }

  addTools(tools) {
    const ceiling = toggle("Ceiling", false, (value) => {
      this.shell.ceiling.visible = value;
      ceiling.show(value);
      this.stage.dataset.ceiling = String(value);
      this.draw();
    });
    tools.append(
      action("−", "Zoom out", () => this.zoom(1.2)),
      action("+", "Zoom in", () => this.zoom(1 / 1.2)),
      action("Top", "Look from above", () => this.go(ABOVE)),
      action("Reset", "Look from the start again", () => this.go(START)),
      ceiling.button,
    );
  }

  listen() {
    const { stage, store } = this;
    onTap(stage, (x, y, target) => {
      store.select(Labels.nameAt(target) ?? this.nameAt(x, y), "model");
    });
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
    onKeys(stage, (x, y) => this.turn(0.12 * x, 0.09 * y), (key) => this.press(key));
    stage.addEventListener("pointerdown", () => stage.focus({ preventScroll: true }));
    store.on("selection", () => this.mark());
    store.on("display", () => {
      this.furniture.outline(store.ghosts);
      this.mark();
    });
    store.on("boxes", () => {
      this.furniture.place(store.boxes);
      this.renderer.shadowMap.needsUpdate = true;
      this.draw();
    });
  }

  press(key) {
    if (key === "+" || key === "=") this.zoom(1 / 1.15);
    else if (key === "-" || key === "_") this.zoom(1.15);
    else if (key === "0") this.go(START);
    else if (key === "n") this.store.step(1, "keys");
    else if (key === "p") this.store.step(-1, "keys");
    else return false;
    return true;
  }

  /** Turn around the target. */
  turn(around, up) {
    this.stop();
    this.moved = true;
    const way = this.camera.position.clone().sub(this.orbit.target);
    // three's spherical angles are about +y
    const angles = new Spherical().setFromVector3(new Vector3(way.x, way.z, -way.y));
    angles.theta += around;
    angles.phi = Math.min(this.orbit.maxPolarAngle, Math.max(0.02, angles.phi + up));
    const turned = new Vector3().setFromSpherical(angles);
    way.set(turned.x, -turned.z, turned.y);
    this.camera.position.copy(this.orbit.target).add(way);
    this.orbit.update();
    this.draw();
  }

  zoom(factor) {
    this.stop();
    this.moved = true;
    const { target, minDistance, maxDistance } = this.orbit;
    const way = this.camera.position.clone().sub(target);
    way.setLength(Math.min(maxDistance, Math.max(minDistance, way.length() * factor)));
    this.camera.position.copy(target).add(way);
    this.orbit.update();
    this.draw();
  }

  /** The nearest place from which the whole room is seen in a direction. */
  placeFor(direction) {
    const side = new Vector3(0, 0, 1).cross(direction).normalize();
    const up = direction.clone().cross(side);
    const half = Math.tan((FOV * Math.PI) / 360) * 0.94;
    const distances = this.ends.map((end) => {
      const way = end.clone().sub(this.middle);
      const wide = Math.abs(way.dot(side)) / (half * this.camera.aspect);
      return way.dot(direction) + Math.max(wide, Math.abs(way.dot(up)) / half);
    });
    return this.middle.clone().addScaledVector(direction, Math.max(...distances));
  }

  go(direction) {
    this.stop();
    const from = this.camera.position.clone(), target = this.orbit.target.clone();
    const to = this.placeFor(direction);
    this.moved = false;
    this.stop = tween(450, (share) => {
      this.camera.position.lerpVectors(from, to, share);
      this.orbit.target.lerpVectors(target, this.middle, share);
      this.orbit.update();
      this.draw();
    });
  }

  colour(palette) {
    this.palette = palette;
    this.shell.colour(palette);
    this.mark();
  }

  mark() {
    this.stage.dataset.selected = this.store.selected.names.join(" ");
    this.shell.mark(this.store, this.palette);
    this.furniture.mark(this.store, this.palette);
    this.spot.material.color.set(this.palette.line_3d);
    this.draw();
  }

  nameAt(x, y) {
    const { clientWidth: width, clientHeight: height } = this.stage;
    const place = new Vector2((2 * x) / width - 1, 1 - (2 * y) / height);
    this.caster.setFromCamera(place, this.camera);
    const { shell, furniture } = this;
    const [hit] = this.caster.intersectObjects([...furniture.targets, ...shell.targets], false);
    if (hit === undefined) return null;
    return furniture.nameOf(hit.object) ?? shell.nameOf(hit.object);
  }

  onScreen(point) {
    const { clientWidth: width, clientHeight: height } = this.stage;
    const place = new Vector3(...point).project(this.camera);
    if (place.z > 1) return null;
    const distance = this.camera.position.distanceTo(new Vector3(...point));
    return { x: ((place.x + 1) * width) / 2, y: ((1 - place.y) * height) / 2, distance };
  }

  /** The pixel of an object's centre. */
  pixelOf(k) {
    return this.onScreen(this.store.boxes[k].centre);
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.stage;
    if (width === 0 || height === 0) return;
    this.sized = true;
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.setSize(width, height);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    if (!this.moved) {
      this.camera.position.copy(this.placeFor(START));
      this.orbit.update();
    }
    this.drawNow();
  }

  drawNow() {
    if (!this.sized) return;
    this.shell.fade(this.camera.position);
    this.furniture.fade(this.shell);
    this.renderer.render(this.scene, this.camera);
    const { clientWidth: width, clientHeight: height } = this.stage;
    const tops = this.store.boxes.map(({ centre, size }) =>
      this.onScreen([centre[0], centre[1], centre[2] + size[2] / 2]),
    );
    this.labels.place(tops, this.store, width, height);
  }
}
