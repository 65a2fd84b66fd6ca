// Names on top of the pictures: the important ones first, none on top of another.

import { make } from "./dom.js";

const GAP = 2;

/** Whether two boxes (left, top, right, bottom) overlap, or nearly so. */
export function overlap(a, b) {
  return a[0] < b[2] + GAP && b[0] < a[2] + GAP && a[1] < b[3] + GAP && b[1] < a[3] + GAP;
}

export class Labels {
  constructor(stage, names) {
    this.layer = make("div", { class: "labels", "aria-hidden": "true" });
    this.tags = names.map((name) => {
      const tag = make("span", { class: "label", "data-name": name }, name);
      this.layer.append(tag);
      return tag;
    });
    this.sizes = null;
    stage.append(this.layer);
  }

  /** places: {x, y, distance} in pixels for each name, or null where it is not seen. */
  place(places, store, width, height) {
    this.sizes ??= this.tags.map((tag) => [tag.offsetWidth, tag.offsetHeight]);
    const mark = (k) => store.mark(this.tags[k].dataset.name);
    const rank = (k) => ({ selected: -2e6, hovered: -1e6 })[mark(k)] ?? places[k].distance;
    const within = ({ x, y }) => x >= 0 && y >= 0 && x <= width && y <= height;
    const order = places.flatMap((place, k) => (place !== null && within(place) ? [k] : []));
    order.sort((a, b) => rank(a) - rank(b));
    const taken = [];
    this.tags.forEach((tag) => (tag.hidden = true));
    for (const k of order) {
      const marked = mark(k);
      if (!store.labels && marked === "") continue;
      const [w, h] = this.sizes[k];
      // marked names give way rather than disappear
      const shifts = marked === "" ? [0] : [0, h + 3, -h - 3, 2 * h + 6, -2 * h - 6];
      const spots = shifts.map((shift) => {
        const left = Math.min(Math.max(places[k].x - w / 2, 2), Math.max(2, width - w - 2));
        const top = Math.min(Math.max(places[k].y + shift - h / 2, 2), Math.max(2, height - h - 2));
        return [left, top, left + w, top + h];
      });
      const spot = spots.find((box) => !taken.some((other) => overlap(box, other)));
      if (spot === undefined) continue;
      taken.push(spot);
      this.tags[k].hidden = false;
      this.tags[k].dataset.mark = marked;
      this.tags[k].style.transform = `translate(${Math.round(spot[0])}px, ${Math.round(spot[1])}px)`;
    }
  }

  /** The name of the label that a pointer is on, or null. */
  static nameAt(target) {
    return target instanceof HTMLElement && target.classList.contains("label")
      ? target.dataset.name
      : null;
  }
}
