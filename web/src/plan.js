// The room from above as a drawing that is to scale, with dimensions.

import { corners } from "./boxes.js";
import { makeSvg, oncePerFrame } from "./dom.js";
import { overlap } from "./labels.js";
import { outerPolygon, wallNormals } from "./shell.js";

const MARGIN = 34;
const SHORTEST_DIMENSION = 0.5;
const MOST_WALL = 12;
const DIMENSION = 22;
const LETTER = 6.4;
const OVERHEAD = 1.3;
const WEDGE = 1.1;
const FOOT = 26;
const WORTH_TURNING = 1.25;

const middleOf = (points) => [0, 1].map((axis) => points.reduce((sum, p) => sum + p[axis], 0) / points.length);
const pathOf = (points) => `M${points.map(([x, y]) => `${x.toFixed(1)} ${y.toFixed(1)}`).join("L")}Z`;

export class PlanView {
  constructor(card, report, store) {
    this.stage = card.querySelector(".stage");
    this.report = report;
    this.store = store;
    this.lens = null;
    this.draw = oncePerFrame(() => this.drawNow());
    new ResizeObserver(() => this.resize()).observe(this.stage);
    store.on("selection", () => this.mark());
    store.on("boxes", () => this.drawBoxes());
    store.on("display", () => this.draw());
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.stage;
    if (width === 0 || height === 0) return;
    this.fit(width, height);
    this.drawNow();
  }

  /** Find turn, scale and offset from metres to pixels; a quarter turn more if that is larger. */
  fit(width, height) {
    const { turn } = this.report.layout;
    const upright = this.fitTurned(turn, width, height);
    const aside = this.fitTurned(turn > 0 ? turn - Math.PI / 2 : turn + Math.PI / 2, width, height);
    Object.assign(this, aside.scale > WORTH_TURNING * upright.scale ? aside : upright);
  }

  fitTurned(turn, width, height) {
    const cosine = Math.cos(turn), sine = Math.sin(turn);
    const across = ([x, y]) => cosine * x - sine * y, up = ([x, y]) => sine * x + cosine * y;
    const { polygon } = this.report.layout;
    const [[left, right], [bottom, top]] = [across, up].map((axis) => {
      const values = polygon.map(axis);
      return [Math.min(...values), Math.max(...values)];
    });
    const free = [width - 2 * MARGIN, height - 2 * MARGIN - FOOT];
    const scale = Math.max(1, Math.min(free[0] / (right - left), free[1] / (top - bottom)));
    const page = (point) => [
      width / 2 + scale * (across(point) - (left + right) / 2),
      (height - FOOT) / 2 - scale * (up(point) - (bottom + top) / 2),
    ];
    return { width, height, turn, scale, page };
  }

  drawNow() {
    if (this.page === undefined) return;
    this.svg?.remove();
    this.view = makeSvg("path", { class: "wedge" });
    this.things = makeSvg("g");
    this.link = makeSvg("path", { class: "link" });
    this.svg = makeSvg(
      "svg",
      { viewBox: `0 0 ${this.width} ${this.height}`, role: "group", "aria-label": "Plan" },
      hatch(),
      this.makeRoom(),
      this.view,
      this.things,
      this.link,
      this.makeCamera(),
      this.makeScale(),
    );
    this.stage.append(this.svg);
    this.drawBoxes();
    this.drawView();
  }

  makeRoom() {
    const { layout } = this.report;
    const thickness = Math.min(layout.wall_thickness, MOST_WALL / this.scale);
    const inner = layout.polygon.map(this.page);
    const outer = outerPolygon(layout.polygon, thickness).map(this.page);
    const floor = this.part("floor", pathOf(inner), "floor");
    const walls = inner.map((_, k) => {
      const next = (k + 1) % inner.length;
      return this.part(`wall-${k}`, pathOf([inner[k], inner[next], outer[next], outer[k]]), "wall");
    });
    return makeSvg("g", {}, floor, ...walls, ...this.makeDimensions(layout.polygon));
  }

  part(name, path, kind) {
    const select = () => this.store.select(name, "plan");
    return makeSvg(
      "path",
      { class: `plan-${kind}`, d: path, "data-name": name, onclick: select },
      makeSvg("title", {}, name),
    );
  }

  makeDimensions(polygon) {
    const normals = wallNormals(polygon);
    const taken = [], floor = polygon.map(this.page);
    return polygon.flatMap((start, k) => {
      const end = polygon[(k + 1) % polygon.length];
      const length = Math.hypot(end[0] - start[0], end[1] - start[1]);
      const beyond = (MOST_WALL + 12) / this.scale;
      const middle = [0, 1].map((axis) => (start[axis] + end[axis]) / 2 - beyond * normals[k][axis]);
      const [x, y] = this.page(middle), [a, b] = [this.page(start), this.page(end)];
      const box = [x - DIMENSION, y - DIMENSION, x + DIMENSION, y + DIMENSION];
      const isShort = length < SHORTEST_DIMENSION || length * this.scale < 2 * DIMENSION;
      const text = `${length.toFixed(2)} m`;
      // in a nook too narrow for it the text would lie on the walls, dark on dark
      const half = (0.5 * LETTER * text.length + MOST_WALL) / Math.hypot(b[0] - a[0], b[1] - a[1]);
      const ends = [-half, half].map((share) => [x + share * (b[0] - a[0]), y + share * (b[1] - a[1])]);
      const isHidden = ends.some((end) => isInside(end, floor));
      if (isShort || isHidden || taken.some((other) => overlap(box, other))) return [];
      taken.push(box);
      const angle = (Math.atan2(b[1] - a[1], b[0] - a[0]) * 180) / Math.PI;
      const upright = angle > 89 ? angle - 180 : angle <= -91 ? angle + 180 : angle;
      const transform = `translate(${x.toFixed(1)} ${y.toFixed(1)}) rotate(${upright.toFixed(2)})`;
      return [makeSvg("text", { class: "dimension", transform, dy: "0.35em" }, text)];
    });
  }

  makeCamera() {
    const [x, y] = this.page([0, 0]);
    return makeSvg(
      "g",
      { class: "camera", transform: `translate(${x.toFixed(1)} ${y.toFixed(1)})` },
      makeSvg("circle", { r: 5 }),
      makeSvg("title", {}, "where the panorama was taken"),
    );
  }

  makeScale() {
    const metres = [0.5, 1, 2, 5, 10].find((length) => length * this.scale > 50) ?? 20;
    const end = MARGIN + metres * this.scale, y = this.height - 14;
    const bar = `M${MARGIN} ${y - 4}V${y}H${end.toFixed(1)}V${y - 4}`;
    const degrees = (-this.turn * 180) / Math.PI;
    const arrow = makeSvg(
      "g",
      { class: "compass", transform: `translate(${this.width - 22} ${y - 6}) rotate(${degrees.toFixed(1)})` },
      makeSvg("path", { d: "M0 -9L5 7L0 4L-5 7Z" }),
    );
    return makeSvg(
      "g",
      { class: "scale" },
      makeSvg("path", { d: bar }),
      makeSvg("text", { x: end + 6, y: y + 1 }, `${metres} m`),
      makeSvg("text", { x: this.width - 38, y: y - 1, "text-anchor": "end" }, this.width < 420 ? "panorama" : "centre of the panorama"),
      arrow,
    );
  }

  drawBoxes() {
    if (this.things === undefined) return;
    const { store, report } = this;
    const order = store.boxes.map((_, k) => k).sort((a, b) => topOf(store.boxes[a]) - topOf(store.boxes[b]));
    this.pieces = order.map((k) => this.makePiece(report.objects[k], store.boxes[k], store.faults[k]));
    const ghosts = (store.ghosts ?? []).map((box) => {
      return makeSvg("path", { class: "ghost", d: pathOf(this.footprint(box)) });
    });
    this.things.replaceChildren(...this.pieces.map(({ shape }) => shape), ...ghosts,
      ...this.pieces.map(({ text }) => text));
    this.mark();
  }

  footprint(box) {
    const points = corners(box);
    return [0, 1, 3, 2].map((k) => this.page(points[k]));
  }

  makePiece(thing, box, fault) {
    const base = this.footprint(box);
    const overhead = box.centre[2] - box.size[2] / 2 - this.report.layout.floor > OVERHEAD;
    const select = () => this.store.select(thing.name, "plan");
    const isThin = Math.min(box.size[0], box.size[1]) * this.scale < 7;
    const shape = makeSvg(
      "g",
      {
        class: overhead ? "piece overhead" : "piece",
        "data-name": thing.name,
        "data-fault": fault !== null,
        onclick: select,
        onmouseenter: () => this.store.hover([thing.name]),
        onmouseleave: () => this.store.hover([]),
      },
      makeSvg("title", {}, fault === null ? thing.name : `${thing.name}: ${fault}`),
      isThin ? makeSvg("path", { class: "catch", d: pathOf(base) }) : null,
      makeSvg("path", { class: "area", d: pathOf(base) }),
      fault === null ? null : makeSvg("path", { class: "fault", d: pathOf(base) }),
      thing.has_front ? makeSvg("path", { class: "front", d: this.front(base) }) : null,
    );
    shape.style.setProperty("--colour", thing.colour);
    const [x, y] = middleOf(base);
    const text = makeSvg("text", { class: "name", x, y, dy: "0.35em" }, thing.name);
    return { name: thing.name, shape, text, base, at: [x, y] };
  }

  /** The heavy edge at the front and its tip. */
  front(base) {
    const [left, right] = [base[3], base[2]];
    const way = [right[0] - left[0], right[1] - left[1]];
    const width = Math.hypot(...way);
    const reach = Math.min(7, 0.3 * width);
    const unit = way.map((value) => value / Math.max(width, 1e-9));
    const ahead = [unit[1], -unit[0]];
    const [x, y] = middleOf([left, right]);
    const tip = [
      [x - reach * unit[0], y - reach * unit[1]],
      [x + reach * unit[0], y + reach * unit[1]],
      [x + reach * ahead[0], y + reach * ahead[1]],
    ];
    return `${pathOf([left, right])}${pathOf(tip)}`;
  }

  mark() {
    const { store } = this;
    this.stage.dataset.selected = store.selected.names.join(" ");
    if (this.pieces === undefined) return;
    for (const node of this.svg.querySelectorAll("[data-name]")) {
      node.toggleAttribute("data-selected", store.isSelected(node.dataset.name));
      node.toggleAttribute("data-hovered", store.isHovered(node.dataset.name));
    }
    this.placeNames();
    this.drawLink();
  }

  /** Names that fit, none on top of another; those of marked pieces always. */
  placeNames() {
    const taken = [];
    const rank = ({ name }) => ({ selected: 2, hovered: 1 })[this.store.mark(name)] ?? 0;
    for (const piece of [...this.pieces].sort((a, b) => rank(b) - rank(a))) {
      const { text, base, at, name } = piece;
      const [wide, high] = [0, 1].map((axis) => {
        const values = base.map((point) => point[axis]);
        return Math.max(...values) - Math.min(...values);
      });
      const isMarked = rank(piece) > 0;
      const width = LETTER * name.length, fits = width < wide + 18 && high > 11;
      const spots = (isMarked ? [0, 15, -15, 30, -30] : [0]).map((shift) => {
        return [at[0] - width / 2, at[1] + shift - 6, at[0] + width / 2, at[1] + shift + 6];
      });
      const spot = spots.find((box) => !taken.some((other) => overlap(box, other)));
      const shown = spot !== undefined && (isMarked || (this.store.labels && fits));
      text.toggleAttribute("hidden", !shown);
      text.setAttribute("data-mark", this.store.mark(name));
      if (!shown) continue;
      text.setAttribute("y", (spot[1] + spot[3]) / 2);
      taken.push(spot);
    }
  }

  /** A line between the partners of the selected relation. */
  drawLink() {
    const { relation, names } = this.store.selected;
    const ends = relation === null ? [] : names.map((name) => this.placeOf(name, names[0]));
    const known = ends.length === 2 && ends.every((end) => end !== null);
    this.link.setAttribute("d", known ? `M${ends[0].join(" ")}L${ends[1].join(" ")}` : "");
  }

  placeOf(name) {
    const piece = this.pieces.find((candidate) => candidate.name === name);
    if (piece !== undefined) return piece.at;
    if (!name.startsWith("wall-")) return null;
    const { polygon } = this.report.layout;
    const k = Number(name.slice(5));
    return this.page(middleOf([polygon[k], polygon[(k + 1) % polygon.length]]));
  }

  /** Show where the panorama looks: its perspective lens, or null when it is flat. */
  follow(lens) {
    this.lens = lens;
    this.drawView();
  }

  drawView() {
    if (this.view === undefined) return;
    const { lens } = this;
    if (lens === null) return this.view.setAttribute("d", "");
    const half = Math.atan((Math.tan(lens.fov / 2) * lens.width) / lens.height);
    const ray = (lon) => this.page([WEDGE * Math.sin(lon), WEDGE * Math.cos(lon)]);
    const arc = [-1, -0.6, -0.2, 0.2, 0.6, 1].map((share) => ray(lens.lon + share * half));
    return this.view.setAttribute("d", pathOf([this.page([0, 0]), ...arc]));
  }
}

/** Whether a point lies in a polygon: walls to its right are passed an odd number of times. */
const isInside = ([x, y], polygon) =>
  polygon.filter(([ax, ay], k) => {
    const [bx, by] = polygon[(k + 1) % polygon.length];
    return ay > y !== by > y && x < ax + ((y - ay) / (by - ay)) * (bx - ax);
  }).length % 2 === 1;

const topOf = ({ centre, size }) => centre[2] + size[2] / 2;

function hatch() {
  const pattern = makeSvg(
    "pattern",
    { id: "hatch", width: 6, height: 6, patternUnits: "userSpaceOnUse", patternTransform: "rotate(45)" },
    makeSvg("path", { class: "hatch", d: "M1 0V6" }),
  );
  return makeSvg("defs", {}, pattern);
}
