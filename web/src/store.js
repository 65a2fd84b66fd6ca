// What is selected, what the pointer is on, which boxes are shown. Views subscribe.
//
// Things go by their unique names: "bed-0", "wall-2", "floor". A selected relation names two.

import { between } from "./boxes.js";
import { tween } from "./dom.js";

export class Store {
  constructor(report) {
    this.report = report;
    this.selected = { names: [], relation: null, source: null };
    this.hovered = { names: [], relation: null };
    this.ghost = report.before !== null;
    this.labels = true;
    this.shown = "after";
    this.boxes = report.objects.map((thing) => thing.box);
    this.listeners = { selection: [], boxes: [], display: [] };
    this.stop = () => {};
  }

  on(topic, listener) {
    this.listeners[topic].push(listener);
  }

  tell(topic) {
    for (const listener of this.listeners[topic]) listener(this);
  }

  /** Select one thing; the selected one again clears. `source` is the view it happened in. */
  select(name, source) {
    if (name === null) return this.clear();
    const again = this.selected.relation === null && this.selected.names[0] === name;
    this.selected = { names: again ? [] : [name], relation: null, source };
    return this.tell("selection");
  }

  selectRelation(index, source) {
    const { subject, object } = this.report.relations[index];
    const again = this.selected.relation === index;
    this.selected = again
      ? { names: [], relation: null, source }
      : { names: [subject, object], relation: index, source };
    this.tell("selection");
  }

  clear() {
    this.selected = { names: [], relation: null, source: null };
    this.hovered = { names: [], relation: null };
    this.tell("selection");
  }

  hover(names, relation = null) {
    if (names.join() === this.hovered.names.join() && relation === this.hovered.relation) return;
    this.hovered = { names, relation };
    this.tell("selection");
  }

  /** Select the next (1) or previous (-1) object. */
  step(by, source) {
    const { objects } = this.report;
    if (objects.length === 0) return;
    const now = objects.findIndex(({ name }) => name === this.selected.names[0]);
    const next = now < 0 && by < 0 ? -1 : now + by;
    this.selected = {
      names: [objects[(next + objects.length) % objects.length].name],
      relation: null,
      source,
    };
    this.tell("selection");
  }

  isSelected(name) {
    return this.selected.names.includes(name);
  }

  isHovered(name) {
    return this.hovered.names.includes(name);
  }

  /** "selected", "hovered" or "". */
  mark(name) {
    if (this.isSelected(name)) return "selected";
    return this.isHovered(name) ? "hovered" : "";
  }

  set(change) {
    Object.assign(this, change);
    this.tell("display");
  }

  /** Boxes of the state that is not shown, for outlines; null when there is no such state. */
  get ghosts() {
    const { before, objects } = this.report;
    if (before === null || !this.ghost) return null;
    return this.shown === "after" ? before.map(({ box }) => box) : objects.map(({ box }) => box);
  }

  /** Violations of the shown boxes. */
  get faults() {
    return this.report.faults[this.shown];
  }

  /** Show the boxes "before" or "after"; they move there. */
  show(state) {
    if (this.report.before === null || state === this.shown) return;
    this.stop();
    this.shown = state;
    const from = this.boxes;
    const to = state === "after" ? this.report.objects : this.report.before;
    this.tell("display");
    this.stop = tween(450, (share) => {
      this.boxes = from.map((box, k) => between(box, to[k].box, share));
      this.tell("boxes");
    });
  }
}
