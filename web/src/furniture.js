// The objects in 3D: their shapes in the colours of their categories, outlines, fronts.

import {
  BoxGeometry,
  BufferAttribute,
  BufferGeometry,
  BackSide,
  DoubleSide,
  EdgesGeometry,
  Group,
  LineBasicMaterial,
  LineDashedMaterial,
  LineSegments,
  Mesh,
  MeshBasicMaterial,
  MeshLambertMaterial,
} from "three";

import { EDGES, corners } from "./boxes.js";

const CREASE = 25;
const RIM = 0.045;

function bytes(text) {
  return Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer;
}

function shapeGeometry({ vertices, faces }) {
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(new Float32Array(bytes(vertices)), 3));
  geometry.setIndex(new BufferAttribute(new Uint32Array(bytes(faces)), 1));
  return geometry;
}

const arrowGeometry = () => {
  const geometry = new BufferGeometry();
  const points = new Float32Array([-1, 0, 0, 1, 0, 0, 0, 1.2, 0]);
  geometry.setAttribute("position", new BufferAttribute(points, 3));
  return geometry;
};

const cube = new BoxGeometry(1, 1, 1);

class Piece {
  constructor(thing, palette, floor) {
    this.thing = thing;
    this.floor = floor;
    const geometry = thing.shape === null ? cube : shapeGeometry(thing.shape);
    this.mesh = new Mesh(
      geometry,
      new MeshLambertMaterial({
        color: thing.colour,
        flatShading: true,
        side: DoubleSide,
        transparent: thing.on_wall,
        forceSinglePass: true,
      }),
    );
    this.mesh.castShadow = !thing.on_wall;
    this.mesh.receiveShadow = true;
    this.lines = new LineSegments(
      new EdgesGeometry(geometry, CREASE),
      new LineBasicMaterial({ color: palette.line_3d, transparent: true }),
    );
    this.rim = new Mesh(cube, new MeshBasicMaterial({ color: palette.accent, side: BackSide }));
    this.frame = new LineSegments(
      new EdgesGeometry(cube),
      new LineBasicMaterial({ color: palette.accent, depthTest: false, transparent: true }),
    );
    this.frame.renderOrder = 5;
    this.arrow = new Mesh(
      arrowGeometry(),
      new MeshBasicMaterial({ color: palette.line_3d, side: DoubleSide, forceSinglePass: true }),
    );
    this.arrow.visible = thing.has_front;
    this.group = new Group();
    this.group.add(this.mesh, this.lines, this.rim, this.frame, this.arrow);
  }

  place({ centre, size, yaw }) {
    this.group.position.set(...centre);
    this.group.rotation.z = yaw;
    for (const part of [this.mesh, this.lines, this.frame]) part.scale.set(...size);
    this.rim.scale.set(...size.map((value) => value + RIM));
    const reach = Math.min(0.18, 0.35 * size[0]);
    this.arrow.scale.set(reach, reach, 1);
    const foot = Math.max(-size[2] / 2, this.floor - centre[2]) + 0.012;
    this.arrow.position.set(0, size[1] / 2 + 0.01, foot);
  }

  /** Doors and windows fade with their wall. */
  fade(opacity) {
    const isMarked = this.rim.visible || this.frame.visible;
    this.mesh.material.opacity = isMarked ? 1 : opacity;
    this.mesh.material.depthWrite = this.mesh.material.opacity > 0.95;
    this.lines.material.opacity = 0.25 + 0.3 * this.mesh.material.opacity;
  }

  mark(mark, isFault, palette) {
    this.rim.visible = mark === "selected";
    this.frame.visible = mark !== "";
    this.frame.material.opacity = mark === "selected" ? 1 : 0.7;
    this.frame.material.color.set(palette.accent);
    this.rim.material.color.set(palette.accent);
    this.lines.material.color.set(isFault ? palette.alarm : palette.line_3d);
    this.lines.material.opacity = isFault ? 1 : 0.55;
    this.arrow.material.color.set(palette.line_3d);
    this.mesh.material.emissive.set(palette.accent).multiplyScalar(mark === "" ? 0 : 0.12);
  }
}

export class Furniture {
  constructor(report, palette) {
    const { floor } = report.layout;
    this.pieces = report.objects.map((thing) => new Piece(thing, palette, floor));
    this.ghosts = new LineSegments(
      new BufferGeometry(),
      new LineDashedMaterial({ color: palette.reference, dashSize: 0.07, gapSize: 0.07 }),
    );
    this.ghosts.frustumCulled = false;
    this.group = new Group();
    this.group.add(...this.pieces.map(({ group }) => group), this.ghosts);
  }

  place(boxes) {
    this.pieces.forEach((piece, k) => piece.place(boxes[k]));
  }

  mark(store, palette) {
    this.pieces.forEach((piece, k) => {
      piece.mark(store.mark(piece.thing.name), store.faults[k] !== null, palette);
    });
    this.ghosts.material.color.set(palette.reference);
  }

  /** shell: the room, whose walls have faded. */
  fade(shell) {
    for (const piece of this.pieces) {
      if (piece.thing.on_wall) piece.fade(shell.opacityNear(piece.group.position));
    }
  }

  outline(ghosts) {
    this.ghosts.visible = ghosts !== null && ghosts.length > 0;
    if (!this.ghosts.visible) return;
    const points = ghosts.flatMap((box) => {
      const corner = corners(box);
      return EDGES.flatMap(([a, b]) => [...corner[a], ...corner[b]]);
    });
    this.ghosts.geometry.setAttribute("position", new BufferAttribute(new Float32Array(points), 3));
    this.ghosts.computeLineDistances();
  }

  get targets() {
    return this.pieces.filter(({ mesh }) => mesh.material.opacity > 0.4).map(({ mesh }) => mesh);
  }

  nameOf(mesh) {
    return this.pieces.find((piece) => piece.mesh === mesh)?.thing.name ?? null;
  }
}
