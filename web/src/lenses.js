// From the world to pixels of the panorama's view, and back: through a perspective lens, where
// straight edges stay straight, or on the flat equirectangular picture, where they bend.
//
// lon grows to the right, lat upwards; (cos lat sin lon, cos lat cos lon, sin lat).

const NEAR = 0.01;
const PIECES = 24;

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const towards = (a, b, share) => a.map((value, axis) => value + share * (b[axis] - value));

export function directionOf(lon, lat) {
  return [Math.cos(lat) * Math.sin(lon), Math.cos(lat) * Math.cos(lon), Math.sin(lat)];
}

export function lonLatOf([x, y, z]) {
  return [Math.atan2(x, y), Math.atan2(z, Math.hypot(x, y))];
}

function pathOf(pixels, closed) {
  if (pixels.length < 2) return "";
  const list = pixels.map(([x, y]) => `${x.toFixed(1)} ${y.toFixed(1)}`);
  return `M${list.join("L")}${closed ? "Z" : ""}`;
}

export class PerspectiveLens {
  constructor(eye) {
    this.eye = eye;
    this.look(0, 0, Math.PI / 2, 1, 1);
  }

  /** fov is vertical, in radians. */
  look(lon, lat, fov, width, height) {
    Object.assign(this, { lon, lat, fov, width, height });
    this.right = [Math.cos(lon), -Math.sin(lon), 0];
    this.forward = directionOf(lon, lat);
    this.up = [-Math.sin(lat) * Math.sin(lon), -Math.sin(lat) * Math.cos(lon), Math.cos(lat)];
    this.focal = height / 2 / Math.tan(fov / 2);
  }

  /** Right, up and ahead of the camera. */
  inCamera(point) {
    const ray = minus(point, this.eye);
    return [dot(ray, this.right), dot(ray, this.up), dot(ray, this.forward)];
  }

  onScreen([right, up, ahead]) {
    const scale = this.focal / ahead;
    return [this.width / 2 + scale * right, this.height / 2 - scale * up];
  }

  /** The pixel and distance of a point, or null if it is behind the camera. */
  pixel(point) {
    const place = this.inCamera(point);
    if (place[2] < NEAR) return null;
    const [x, y] = this.onScreen(place);
    return { x, y, distance: Math.hypot(...place) };
  }

  direction(x, y) {
    const right = (x - this.width / 2) / this.focal, up = (this.height / 2 - y) / this.focal;
    const ray = this.forward.map((f, k) => f + right * this.right[k] + up * this.up[k]);
    const length = Math.hypot(...ray);
    return ray.map((value) => value / length);
  }

  line(points) {
    let path = "";
    for (let k = 1; k < points.length; k++) {
      let a = this.inCamera(points[k - 1]), b = this.inCamera(points[k]);
      if (a[2] < NEAR && b[2] < NEAR) continue;
      if (a[2] < NEAR) a = towards(a, b, (NEAR - a[2]) / (b[2] - a[2]));
      if (b[2] < NEAR) b = towards(b, a, (NEAR - b[2]) / (a[2] - b[2]));
      path += pathOf(this.bounded(a, b), false);
    }
    return path;
  }

  /** Both ends on the screen; far outside they are cut, because huge numbers draw badly. */
  bounded(a, b) {
    const reach = 8 * Math.max(this.width, this.height);
    const cut = ([x, y], [u, v]) => {
      const over = Math.max(Math.abs(x), Math.abs(y)) / reach;
      if (over <= 1) return [x, y];
      const share = 1 - 1 / over;
      return [x + share * (u - x), y + share * (v - y)];
    };
    const p = this.onScreen(a), q = this.onScreen(b);
    return [cut(p, q), cut(q, p)];
  }

  area(points) {
    const places = points.map((point) => this.inCamera(point));
    const kept = places.flatMap((b, k) => {
      const a = places[(k + places.length - 1) % places.length];
      const crossing =
        a[2] < NEAR !== b[2] < NEAR ? [towards(a, b, (NEAR - a[2]) / (b[2] - a[2]))] : [];
      return b[2] < NEAR ? crossing : [...crossing, b];
    });
    return pathOf(kept.map((place) => this.onScreen(place)), true);
  }
}

export class FlatLens {
  constructor(eye) {
    this.eye = eye;
    this.fit(2, 1);
  }

  /** The whole picture, 2:1, in the middle of the view. */
  fit(width, height) {
    this.pictureWidth = Math.min(width, 2 * height);
    this.pictureHeight = this.pictureWidth / 2;
    this.left = (width - this.pictureWidth) / 2;
    this.top = (height - this.pictureHeight) / 2;
  }

  onPicture(lon, lat) {
    return [
      this.left + this.pictureWidth * (lon / (2 * Math.PI) + 0.5),
      this.top + this.pictureHeight * (0.5 - lat / Math.PI),
    ];
  }

  pixel(point) {
    const ray = minus(point, this.eye);
    const [x, y] = this.onPicture(...lonLatOf(ray));
    return { x, y, distance: Math.hypot(...ray) };
  }

  /** The direction of a pixel, or null beside the picture. */
  direction(x, y) {
    const lon = 2 * Math.PI * ((x - this.left) / this.pictureWidth - 0.5);
    const lat = Math.PI * (0.5 - (y - this.top) / this.pictureHeight);
    if (Math.abs(lon) > Math.PI || Math.abs(lat) > Math.PI / 2) return null;
    return directionOf(lon, lat);
  }

  /** lon and lat along straight edges, without jumps at the seam. */
  unrolled(points) {
    const places = [];
    for (let k = 1; k < points.length; k++) {
      for (let piece = k === 1 ? 0 : 1; piece <= PIECES; piece++) {
        const point = towards(points[k - 1], points[k], piece / PIECES);
        const [lon, lat] = lonLatOf(minus(point, this.eye));
        const last = places.length ? places[places.length - 1][0] : lon;
        const turns = Math.round((last - lon) / (2 * Math.PI));
        places.push([lon + 2 * Math.PI * turns, lat]);
      }
    }
    return places;
  }

  /** The path, and its copies where it leaves the picture at the seam. */
  copies(places, closed) {
    const lons = places.map(([lon]) => lon);
    const low = Math.min(...lons), high = Math.max(...lons);
    return [-2, -1, 0, 1, 2]
      .filter((turn) => high + 2 * turn * Math.PI > -Math.PI && low + 2 * turn * Math.PI < Math.PI)
      .map((turn) =>
        pathOf(places.map(([lon, lat]) => this.onPicture(lon + 2 * turn * Math.PI, lat)), closed),
      )
      .join("");
  }

  line(points) {
    return this.copies(this.unrolled(points), false);
  }

  area(points) {
    const places = this.unrolled([...points, points[0]]);
    const around = Math.abs(places[places.length - 1][0] - places[0][0]) > Math.PI;
    return around ? "" : this.copies(places, true);
  }
}
