// Objects and relations as tables. Rows take the focus; Enter selects, arrows move.

import { make } from "./dom.js";

const FEW = 120;
const QUIET = new Set(["inside_room", "farther_than", "relative_yaw"]);

function asRow(row, names, store, select) {
  row.addEventListener("mouseenter", () => store.hover(names));
  row.addEventListener("mouseleave", () => store.hover([]));
  row.addEventListener("focus", () => store.hover(names));
  row.addEventListener("blur", () => store.hover([]));
  row.addEventListener("click", select);
  row.addEventListener("keydown", (event) => {
    const step = { ArrowDown: "nextElementSibling", ArrowUp: "previousElementSibling" }[event.key];
    if (event.key === "Enter" || event.key === " ") select();
    else if (step !== undefined) row[step]?.focus();
    else return;
    event.preventDefault();
  });
  return row;
}

function head(...labels) {
  const cells = labels.map(([label, kind = "", title = null]) => {
    return make("th", { scope: "col", class: kind, title }, label);
  });
  return make("thead", {}, make("tr", {}, ...cells));
}

const metres = (values) => values.map((value) => value.toFixed(2));
const share = (value) => value.toFixed(2);

/** Scroll a row into view within its own scroller, without moving the page. */
function reveal(row) {
  const scroller = row.closest(".scroller");
  const { top, bottom } = row.getBoundingClientRect();
  const bounds = scroller.getBoundingClientRect();
  const headHeight = scroller.querySelector("thead").offsetHeight;
  if (top < bounds.top + headHeight) scroller.scrollTop += top - bounds.top - headHeight;
  else if (bottom > bounds.bottom) scroller.scrollTop += bottom - bounds.bottom;
}

export class ObjectTable {
  constructor(card, report, store) {
    this.report = report;
    this.store = store;
    const { objects } = report;
    this.rows = objects.map((thing) => this.makeRow(thing));
    const table = make(
      "table",
      { role: "grid", "aria-label": "Objects" },
      head(["Object"], ["Category"], ["Size w × d × h (m)", "number"],
        ["Centre x, y, z (m)", "number"], ["Yaw (°)", "number"], ["Score", "number"],
        ["Dist.", "number", "Confidence of the distance"],
        ["Dir.", "number", "Confidence of the direction that it faces"]),
      make("tbody", {}, ...this.rows.map(({ row }) => row)),
    );
    card.querySelector(".scroller").append(
      objects.length > 0 ? table : make("p", { class: "empty" }, "No objects in this room."),
    );
    store.on("selection", () => this.mark());
    card.querySelector(".count").textContent = objects.length > 0 ? String(objects.length) : "";
    store.on("boxes", () => this.fill());
    store.on("display", () => this.fill());
    this.fill();
    this.mark();
  }

  makeRow(thing) {
    const swatch = make("span", { class: "swatch", "aria-hidden": "true" });
    swatch.style.backgroundColor = thing.colour;
    const cell = (kind) => make("td", { class: kind });
    const remark = make("span", { class: "remark" });
    const cells = { size: cell("number"), centre: cell("number"), yaw: cell("number"), remark };
    const row = make(
      "tr",
      { tabindex: 0, "data-name": thing.name },
      make("th", { scope: "row" }, swatch, thing.name, remark),
      make("td", {}, thing.category),
      cells.size,
      cells.centre,
      cells.yaw,
      ...thing.scores.map((value) => make("td", { class: "number" }, share(value))),
    );
    asRow(row, [thing.name], this.store, () => this.store.select(thing.name, "objects"));
    return { row, cells, name: thing.name };
  }

  fill() {
    this.rows.forEach(({ row, cells }, k) => {
      const { size, centre, yaw } = this.store.boxes[k];
      const fault = this.store.faults[k];
      const turn = (yaw * 180) / Math.PI;
      cells.size.textContent = metres(size).join(" × ");
      cells.centre.textContent = metres(centre).join(", ");
      cells.yaw.textContent = (turn - 360 * Math.floor((turn + 180) / 360)).toFixed(0);
      cells.remark.textContent = fault ?? "";
      row.toggleAttribute("data-fault", fault !== null);
    });
  }

  mark() {
    for (const { row, name } of this.rows) {
      const selected = this.store.isSelected(name);
      if (selected && !row.hasAttribute("data-selected")) reveal(row);
      row.toggleAttribute("data-selected", selected);
      row.toggleAttribute("data-hovered", this.store.isHovered(name));
      row.setAttribute("aria-selected", String(selected));
    }
  }
}

export class RelationTable {
  constructor(card, report, store) {
    this.report = report;
    this.store = store;
    this.scroller = card.querySelector(".scroller");
    this.count = card.querySelector(".count");
    this.all = false;
    const { relations } = report;
    const counts = new Map();
    for (const { predicate } of relations) counts.set(predicate, (counts.get(predicate) ?? 0) + 1);
    const loud = [...counts.keys()].filter((predicate) => !QUIET.has(predicate));
    this.wanted = new Set(loud.length > 0 ? loud : counts.keys());
    this.chips = card.querySelector(".chips");
    for (const [predicate, count] of counts) this.addChip(predicate, count);
    this.body = make("tbody");
    this.table = make(
      "table",
      { role: "grid", "aria-label": "Relations" },
      head(["Subject"], ["Relation"], ["Object"], ["Score", "number"]),
      this.body,
    );
    this.more = make("button", { type: "button", class: "more", onclick: () => this.showAll() });
    const empty = make("p", { class: "empty" }, "No relations are known of this room.");
    this.scroller.append(...(relations.length > 0 ? [this.table, this.more] : [empty]));
    this.about = null;
    store.on("selection", () => this.mark());
    this.fill();
  }

  addChip(predicate, count) {
    const text = this.report.predicates[predicate] ?? predicate;
    const chip = make(
      "button",
      { type: "button", class: "chip", "aria-pressed": String(this.wanted.has(predicate)) },
      text,
      make("span", { class: "amount" }, String(count)),
    );
    chip.addEventListener("click", () => {
      if (!this.wanted.delete(predicate)) this.wanted.add(predicate);
      chip.setAttribute("aria-pressed", String(this.wanted.has(predicate)));
      this.fill();
    });
    this.chips.append(chip);
  }

  showAll() {
    this.all = true;
    this.fill();
  }

  /** The thing that the rows are about: the selected one, unless a relation is selected. */
  get topic() {
    const { names, relation } = this.store.selected;
    return relation === null ? (names[0] ?? null) : this.about;
  }

  fill() {
    this.about = this.topic;
    const { relations } = this.report;
    const fits = ({ predicate, subject, object }) =>
      this.wanted.has(predicate) &&
      (this.about === null || subject === this.about || object === this.about);
    const indices = relations.flatMap((relation, k) => (fits(relation) ? [k] : []));
    const shown = this.all ? indices : indices.slice(0, FEW);
    this.rows = shown.map((k) => this.makeRow(k));
    this.body.replaceChildren(...this.rows.map(({ row }) => row));
    this.more.hidden = shown.length === indices.length;
    this.more.textContent = `Show all ${indices.length}`;
    const about = this.about === null ? "" : ` about ${this.about}`;
    const count = relations.length === 0 ? "" : `${indices.length} of ${relations.length}${about}`;
    this.count.textContent = count;
    this.paint();
  }

  makeRow(k) {
    const { subject, predicate, object, score, angle_deg: angle } = this.report.relations[k];
    const words = this.report.predicates[predicate] ?? predicate;
    const turn = angle === null ? "" : ` ${angle > 0 ? "+" : ""}${angle.toFixed(0)}°`;
    const row = make(
      "tr",
      { tabindex: 0, "data-relation": k },
      make("th", { scope: "row" }, subject),
      make("td", {}, words + turn),
      make("td", {}, object),
      make("td", { class: "number" }, share(score)),
    );
    asRow(row, [subject, object], this.store, () => this.store.selectRelation(k, "relations"));
    return { row, index: k };
  }

  mark() {
    if (this.topic !== this.about) this.fill();
    else this.paint();
  }

  paint() {
    for (const { row, index } of this.rows) {
      const selected = this.store.selected.relation === index;
      row.toggleAttribute("data-selected", selected);
      row.setAttribute("aria-selected", String(selected));
    }
  }
}
