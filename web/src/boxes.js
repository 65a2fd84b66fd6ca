// Oriented boxes in the world frame: +z up, yaw counter-clockwise from above, yaw 0 faces +y.
// Corner k: bit 0 = x, bit 1 = y, bit 2 = z, low first.

export const EDGES = [
  [0, 1], [2, 3], [4, 5], [6, 7],
  [0, 2], [1, 3], [4, 6], [5, 7],
  [0, 4], [1, 5], [2, 6], [3, 7],
];

/** Corner loops of the faces, and the box axis (0, 1, 2) and side (-1, 1) of each. */
export const FACES = [
  { loop: [0, 4, 6, 2], axis: 0, side: -1 },
  { loop: [1, 3, 7, 5], axis: 0, side: 1 },
  { loop: [0, 1, 5, 4], axis: 1, side: -1 },
  { loop: [2, 6, 7, 3], axis: 1, side: 1 },
  { loop: [0, 2, 3, 1], axis: 2, side: -1 },
  { loop: [4, 5, 7, 6], axis: 2, side: 1 },
];

/** The two faces that share each edge, as indices into FACES. */
export const FACES_OF_EDGE = EDGES.map(([a, b]) =>
  FACES.flatMap(({ loop }, k) => (loop.includes(a) && loop.includes(b) ? [k] : [])),
);

export function corners({ centre, size, yaw }) {
  const cosine = Math.cos(yaw), sine = Math.sin(yaw);
  return Array.from({ length: 8 }, (_, k) => {
    const x = ((k & 1) - 0.5) * size[0];
    const y = (((k >> 1) & 1) - 0.5) * size[1];
    const z = (((k >> 2) & 1) - 0.5) * size[2];
    return [centre[0] + cosine * x - sine * y, centre[1] + sine * x + cosine * y, centre[2] + z];
  });
}

/** A point of the world in the box's own axes, relative to its centre. */
function toBox({ yaw }, [x, y, z]) {
  const cosine = Math.cos(yaw), sine = Math.sin(yaw);
  return [cosine * x + sine * y, cosine * y - sine * x, z];
}

/** For each face, whether it is seen from a point. */
export function facesSeenFrom(box, eye) {
  const local = toBox(box, eye.map((value, axis) => value - box.centre[axis]));
  return FACES.map(({ axis, side }) => side * local[axis] > box.size[axis] / 2);
}

/** Distance along a ray to where it enters a box; Infinity if it misses or starts inside. */
export function distanceToBox(origin, direction, box) {
  const start = toBox(box, origin.map((value, axis) => value - box.centre[axis]));
  const step = toBox(box, direction);
  let enter = -Infinity, leave = Infinity;
  for (let axis = 0; axis < 3; axis++) {
    const half = box.size[axis] / 2;
    if (Math.abs(step[axis]) < 1e-12) {
      if (Math.abs(start[axis]) > half) return Infinity;
      continue;
    }
    const a = (-half - start[axis]) / step[axis], b = (half - start[axis]) / step[axis];
    enter = Math.max(enter, Math.min(a, b));
    leave = Math.min(leave, Math.max(a, b));
  }
  return enter > 0 && enter <= leave ? enter : Infinity;
}

/** The part of the room that a ray from inside it meets first: "wall-2", "floor" or "ceiling". */
export function roomPartOnRay(origin, direction, { polygon, floor, ceiling }) {
  let nearest = Infinity, name = null;
  if (direction[2] !== 0) {
    nearest = ((direction[2] < 0 ? floor : ceiling) - origin[2]) / direction[2];
    name = direction[2] < 0 ? "floor" : "ceiling";
  }
  polygon.forEach(([x, y], k) => {
    const next = polygon[(k + 1) % polygon.length];
    const along = [next[0] - x, next[1] - y], away = [x - origin[0], y - origin[1]];
    const cross = direction[0] * along[1] - direction[1] * along[0];
    const distance = (away[0] * along[1] - away[1] * along[0]) / cross;
    const share = (away[0] * direction[1] - away[1] * direction[0]) / cross;
    if (distance > 0 && share >= 0 && share <= 1 && distance < nearest) {
      nearest = distance;
      name = `wall-${k}`;
    }
  });
  return name;
}

function wrap(angle) {
  return angle - 2 * Math.PI * Math.floor((angle + Math.PI) / (2 * Math.PI));
}

/** A box on the way from one to another; yaw takes the shorter way. */
export function between(a, b, share) {
  const mix = (from, to) => from.map((value, axis) => value + share * (to[axis] - value));
  return {
    centre: mix(a.centre, b.centre),
    size: mix(a.size, b.size),
    yaw: a.yaw + share * wrap(b.yaw - a.yaw),
  };
}
