// Boxes, layout and highlights as SVG shapes over the panorama.

import { EDGES, FACES, FACES_OF_EDGE, corners, facesSeenFrom } from "./boxes.js";
import { makeSvg } from "./dom.js";

export class Overlay {
  constructor(stage, report) {
    this.report = report;
    this.room = roomLines(report.layout);
    this.layoutRim = makeSvg("path", { class: "layout-rim" });
    this.layoutLine = makeSvg("path", { class: "layout-line" });
    this.parts = [...this.room.areas].map(([name, points]) => {
      const shape = makeSvg("path", { class: "part", "data-name": name });
      return { name, points, shape };
    });
    this.ghosts = makeSvg("path", { class: "ghost" });
    this.objects = report.objects.map((thing) => {
      const shapes = Object.fromEntries(
        ["fill", "far", "rim", "near", "front"].map((kind) => [
          kind,
          makeSvg("path", { class: `box-${kind}` }),
        ]),
      );
      const group = makeSvg(
        "g",
        { class: "object", "data-name": thing.name },
        ...Object.values(shapes),
      );
      group.style.setProperty("--colour", thing.colour);
      return { group, shapes };
    });
    this.things = makeSvg("g", {}, ...this.objects.map(({ group }) => group));
    this.svg = makeSvg(
      "svg",
      { class: "overlay", "aria-hidden": "true", focusable: "false" },
      this.layoutRim,
      this.layoutLine,
      makeSvg("g", {}, ...this.parts.map(({ shape }) => shape)),
      this.ghosts,
      this.things,
    );
    stage.append(this.svg);
  }

  /** Far boxes first, and marked ones on top. */
  sort(store, eye) {
    const distance = ({ centre }) => Math.hypot(...centre.map((value, k) => value - eye[k]));
    const rank = store.boxes.map((box, k) => {
      const mark = store.mark(this.report.objects[k].name);
      return distance(box) - (mark === "selected" ? 2e6 : mark === "hovered" ? 1e6 : 0);
    });
    const order = rank.map((_, k) => k).sort((a, b) => rank[b] - rank[a]);
    this.things.append(...order.map((k) => this.objects[k].group));
  }

  mark(store) {
    const show = (node, name) => {
      node.toggleAttribute("data-selected", store.isSelected(name));
      node.toggleAttribute("data-hovered", store.isHovered(name));
    };
    this.parts.forEach(({ shape, name }) => show(shape, name));
    this.objects.forEach(({ group }, k) => {
      const { name } = this.report.objects[k];
      show(group, name);
      group.toggleAttribute("data-fault", store.faults[k] !== null);
    });
  }

  draw(store, lens) {
    const lines = this.room.lines.map((points) => lens.line(points)).join("");
    this.layoutRim.setAttribute("d", lines);
    this.layoutLine.setAttribute("d", lines);
    for (const { shape, name, points } of this.parts) {
      shape.setAttribute("d", store.mark(name) === "" ? "" : lens.area(points));
    }
    const ghosts = store.ghosts ?? [];
    this.ghosts.setAttribute("d", ghosts.map((box) => edgePaths(box, lens).join("")).join(""));
    store.boxes.forEach((box, k) => this.drawBox(box, k, lens));
  }

  drawBox(box, k, lens) {
    const { shapes } = this.objects[k];
    const points = corners(box);
    const seen = facesSeenFrom(box, lens.eye);
    const faces = FACES.filter((_, face) => seen[face]);
    const areas = faces.map(({ loop }) => lens.area(loop.map((corner) => points[corner])));
    const edges = edgePaths(box, lens);
    const isNear = FACES_OF_EDGE.map((pair) => pair.some((face) => seen[face]));
    const near = edges.filter((_, edge) => isNear[edge]).join("");
    shapes.fill.setAttribute("d", areas.join(""));
    shapes.far.setAttribute("d", edges.filter((_, edge) => !isNear[edge]).join(""));
    shapes.rim.setAttribute("d", near);
    shapes.near.setAttribute("d", near);
    const arrow = this.report.objects[k].has_front ? frontArrow(box) : null;
    shapes.front.setAttribute("d", arrow === null ? "" : lens.area(arrow));
  }
}

function edgePaths(box, lens) {
  const points = corners(box);
  return EDGES.map(([a, b]) => lens.line([points[a], points[b]]));
}

/** The triangle at the foot of the front that shows where an object faces. */
export function frontArrow({ centre, size, yaw }) {
  const reach = Math.min(0.18, 0.35 * size[0]);
  const bottom = centre[2] - size[2] / 2;
  return [[-reach, 0], [reach, 0], [0, 1.2 * reach]].map(([x, beyond]) => {
    const y = size[1] / 2 + beyond;
    return [
      centre[0] + Math.cos(yaw) * x - Math.sin(yaw) * y,
      centre[1] + Math.sin(yaw) * x + Math.cos(yaw) * y,
      bottom,
    ];
  });
}

/** Edges of the room, and the loops of its parts by name. */
function roomLines({ polygon, floor, ceiling }) {
  const at = (height) => polygon.map(([x, y]) => [x, y, height]);
  const low = at(floor), high = at(ceiling), n = polygon.length;
  const areas = new Map([["floor", low], ["ceiling", high]]);
  polygon.forEach((_, k) => {
    const next = (k + 1) % n;
    areas.set(`wall-${k}`, [low[k], low[next], high[next], high[k]]);
  });
  return { lines: [[...low, low[0]], [...high, high[0]], ...low.map((p, k) => [p, high[k]])], areas };
}
