// The room as a doll's house: floor, ceiling, and walls with thickness that fade when they
// stand between viewer and room.

import {
  BufferAttribute,
  BufferGeometry,
  DoubleSide,
  Group,
  LineBasicMaterial,
  LineSegments,
  Mesh,
  MeshLambertMaterial,
  Vector3,
} from "three";

const FAINTEST = 0.04;
const FAINTEST_CAP = 0.18;
const LONGEST_MITRE = 3;

function geometryOf(points, triangles) {
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(new Float32Array(points.flat()), 3));
  geometry.setIndex(triangles);
  return geometry;
}

function lineGeometry(points) {
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(new Float32Array(points.flat()), 3));
  return geometry;
}

/** Unit normals of the walls, into the room. */
export function wallNormals(polygon) {
  return polygon.map(([x, y], k) => {
    const [u, v] = polygon[(k + 1) % polygon.length];
    const length = Math.hypot(u - x, v - y);
    return [-(v - y) / length, (u - x) / length];
  });
}

/** The polygon grown by a thickness: the outer corners of its walls. */
export function outerPolygon(polygon, thickness) {
  const normals = wallNormals(polygon);
  return polygon.map(([x, y], k) => {
    const a = normals[(k + polygon.length - 1) % polygon.length], b = normals[k];
    const sum = [a[0] + b[0], a[1] + b[1]];
    const share = 2 / Math.max(sum[0] ** 2 + sum[1] ** 2, 4 / LONGEST_MITRE ** 2);
    return [x - thickness * share * sum[0], y - thickness * share * sum[1]];
  });
}

const LIT = { flatShading: true, side: DoubleSide, forceSinglePass: true };
const material = (colour, options) => new MeshLambertMaterial({ color: colour, ...LIT, ...options });

export class Shell {
  constructor(layout, palette) {
    this.group = new Group();
    const { polygon, floor, ceiling } = layout;
    const outer = outerPolygon(polygon, layout.wall_thickness);
    const flat = layout.triangles.flat();
    const at = (height) => polygon.map(([x, y]) => [x, y, height]);
    this.floor = new Mesh(geometryOf(at(floor), flat), material(palette.floor_3d));
    this.floor.receiveShadow = true;
    this.ceiling = new Mesh(
      geometryOf(at(ceiling), flat),
      material(palette.wall_3d, { transparent: true }),
    );
    this.ceiling.visible = false;
    this.height = ceiling;
    const normals = wallNormals(polygon);
    this.walls = polygon.map((_, k) => {
      const next = (k + 1) % polygon.length;
      const ring = [polygon[k], polygon[next], outer[next], outer[k]];
      return new Wall(ring, floor, ceiling, normals[k], palette);
    });
    this.group.add(this.floor, this.ceiling, ...this.walls.map((wall) => wall.group));
    this.parts = new Map([
      ["floor", this.floor],
      ["ceiling", this.ceiling],
      ...this.walls.map((wall, k) => [`wall-${k}`, wall.face]),
    ]);
  }

  colour(palette) {
    this.floor.material.color.set(palette.floor_3d);
    this.ceiling.material.color.set(palette.wall_3d);
    this.walls.forEach((wall) => wall.colour(palette));
  }

  mark(store, palette) {
    const glow = { selected: [palette.accent, 0.45], hovered: [palette.accent, 0.2], "": ["#000", 1] };
    for (const [name, { material }] of this.parts) {
      const [colour, strength] = glow[store.mark(name)];
      material.emissive.set(colour).multiplyScalar(strength);
    }
    this.walls.forEach((wall, k) => (wall.kept = store.mark(`wall-${k}`) !== ""));
  }

  /** Fade what stands between the eye and the room. */
  fade(eye) {
    this.walls.forEach((wall) => wall.fade(eye));
    this.ceiling.material.opacity = eye.z > this.height ? 0.22 : 1;
    this.ceiling.material.depthWrite = eye.z <= this.height;
  }

  /** The opacity of the wall that a place is nearest to. */
  opacityNear(place) {
    const distances = this.walls.map((wall) => wall.distanceTo(place));
    return this.walls[distances.indexOf(Math.min(...distances))].opacity;
  }

  /** Parts that a pointer can hit. */
  get targets() {
    const solid = this.walls.filter(({ face }) => face.material.opacity > 0.5);
    const ceiling = this.ceiling.visible && this.ceiling.material.opacity === 1;
    return [this.floor, ...(ceiling ? [this.ceiling] : []), ...solid.map(({ face }) => face)];
  }

  nameOf(mesh) {
    for (const [name, part] of this.parts) if (part === mesh) return name;
    return null;
  }
}

class Wall {
  /** ring: inner start, inner end, outer end, outer start, seen from above. */
  constructor(ring, low, high, normal, palette) {
    const below = ring.map(([x, y]) => [x, y, low]), above = ring.map(([x, y]) => [x, y, high]);
    const sides = [0, 1, 2, 3].flatMap((k) => {
      const next = (k + 1) % 4;
      return [k, k + 4, next, next, k + 4, next + 4];
    });
    const see = { transparent: true };
    this.face = new Mesh(geometryOf([...below, ...above], sides), material(palette.wall_3d, see));
    this.face.receiveShadow = true;
    const cap = { ...see, polygonOffset: true, polygonOffsetFactor: -1, polygonOffsetUnits: -1 };
    this.cap = new Mesh(geometryOf(above, [0, 2, 1, 0, 3, 2]), material(palette.cap_3d, cap));
    this.cap.receiveShadow = true;
    const foot = lineGeometry([below[0], below[1]]);
    this.foot = new LineSegments(foot, new LineBasicMaterial({ color: palette.cap_3d, transparent: true }));
    this.group = new Group();
    this.group.add(this.face, this.cap, this.foot);
    this.normal = new Vector3(normal[0], normal[1], 0);
    const [a, b] = ring;
    this.start = new Vector3(...a, 0);
    this.end = new Vector3(...b, 0);
    this.opacity = 1;
    this.middle = new Vector3((a[0] + b[0]) / 2, (a[1] + b[1]) / 2, (low + high) / 2);
    this.kept = false;
  }

  colour(palette) {
    this.face.material.color.set(palette.wall_3d);
    this.cap.material.color.set(palette.cap_3d);
    this.foot.material.color.set(palette.cap_3d);
  }

  distanceTo(place) {
    const way = this.end.clone().sub(this.start);
    const foot = new Vector3(place.x, place.y, 0);
    const share = foot.clone().sub(this.start).dot(way) / way.lengthSq();
    return foot.distanceTo(this.start.clone().addScaledVector(way, Math.min(1, Math.max(0, share))));
  }

  fade(eye) {
    const way = eye.clone().sub(this.middle);
    const share = Math.min(1, Math.max(0, way.dot(this.normal) / way.length() / 0.16 + 0.5));
    const smooth = share * share * (3 - 2 * share);
    const faintest = this.kept ? 0.4 : FAINTEST;
    this.opacity = faintest + (1 - faintest) * smooth;
    this.show(this.face, this.opacity);
    this.show(this.cap, FAINTEST_CAP + (1 - FAINTEST_CAP) * smooth);
  }

  show(mesh, opacity) {
    mesh.material.opacity = opacity;
    mesh.material.depthWrite = opacity > 0.95;
    mesh.castShadow = false;
  }
}
