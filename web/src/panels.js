// What does not move: the certificate, timings, notes; and the bar that says what is selected.

import { make } from "./dom.js";

function bar(kind, length) {
  const line = make("span", { class: `bar ${kind}`, "aria-hidden": "true" });
  line.style.width = `${(100 * length).toFixed(2)}%`;
  return line;
}

export function fillCertificate(card, certificate) {
  if (certificate === null) return card.remove();
  const { outcome, facts, measures, terms } = certificate;
  const row = ({ label, before, after, change }) =>
    make(
      "tr",
      {},
      make("th", { scope: "row" }, label),
      make("td", { class: "number" }, before),
      make("td", { class: `number ${change}` }, after),
    );
  const headings = ["Measure", "Before", "After"].map((text, k) =>
    make("th", { scope: "col", class: k > 0 ? "number" : "" }, text),
  );
  const items = facts.map(([term, value]) => make("div", {}, make("dt", {}, term), make("dd", {}, value)));
  card.append(
    make("p", { class: "outcome" }, outcome),
    make("table", {}, make("thead", {}, make("tr", {}, ...headings)), make("tbody", {}, ...measures.map(row))),
    make("dl", { class: "facts" }, ...items),
    make("h3", {}, "Energy by term"),
    makeTerms(terms),
  );
  return undefined;
}

function makeTerms(terms) {
  const most = Math.max(1e-12, ...terms.flatMap(({ before, after }) => [before, after]));
  const shown = terms.filter(({ before, after }) => Math.max(before, after) >= 0.0005);
  const items = shown.map(({ label, before, after }) =>
    make(
      "li",
      {},
      make("span", { class: "term" }, label),
      make("span", { class: "bars" }, bar("before", before / most), bar("after", after / most)),
      make("span", { class: "number" }, `${before.toFixed(3)} → ${after.toFixed(3)}`),
    ),
  );
  const rest = terms.length - shown.length;
  const note = rest === 0 ? null : make("li", { class: "total" }, `${rest} more are zero`);
  return make("ul", { class: "terms" }, ...items, note);
}

export function fillTimings(card, timings) {
  if (timings.length === 0) return card.remove();
  const most = Math.max(1e-9, ...timings.map(([, seconds]) => seconds));
  const words = (seconds) => (seconds < 1 ? `${(1000 * seconds).toFixed(0)} ms` : `${seconds.toFixed(2)} s`);
  const items = timings.map(([label, seconds]) =>
    make(
      "li",
      {},
      make("span", { class: "term" }, label),
      make("span", { class: "bars" }, bar("after", seconds / most)),
      make("span", { class: "number" }, words(seconds)),
    ),
  );
  const total = timings.reduce((sum, [, seconds]) => sum + seconds, 0);
  card.append(make("ul", { class: "terms" }, ...items), make("p", { class: "total" }, `Together ${words(total)}`));
  return undefined;
}

export function fillLegend(list, groups) {
  const items = groups.map(([name, colour]) => {
    const swatch = make("span", { class: "swatch", "aria-hidden": "true" });
    swatch.style.backgroundColor = colour;
    return make("li", {}, swatch, name);
  });
  list.append(...items);
}

/** The bar at the foot of the page that says what is selected, also to screen readers. */
export class SelectionBar {
  constructor(bar, report, store) {
    Object.assign(this, { bar, report, store });
    this.swatch = bar.querySelector(".swatch");
    this.text = bar.querySelector(".selection-text");
    const act = { previous: () => store.step(-1, "bar"), next: () => store.step(1, "bar"), clear: () => store.clear() };
    for (const button of bar.querySelectorAll("button")) {
      button.addEventListener("click", act[button.dataset.act]);
    }
    for (const topic of ["selection", "display"]) store.on(topic, () => this.fill());
    this.fill();
  }

  fill() {
    const { names, relation } = this.store.selected;
    this.bar.toggleAttribute("data-empty", names.length === 0);
    document.body.classList.toggle("has-selection", names.length > 0);
    const k = this.report.objects.findIndex(({ name }) => name === names[0]);
    this.swatch.hidden = k < 0 || relation !== null;
    if (k >= 0) this.swatch.style.backgroundColor = this.report.objects[k].colour;
    const words = names.length === 0 ? "" : relation === null ? this.describe(k, names[0]) : this.sentence(relation);
    if (this.text.textContent !== words) this.text.textContent = words;
  }

  describe(k, name) {
    if (k < 0) return name;
    const { category } = this.report.objects[k];
    const size = this.store.boxes[k].size.map((value) => value.toFixed(2)).join(" × ");
    const fault = this.store.faults[k];
    return `${name} · ${category} · ${size} m${fault === null ? "" : ` · ${fault}`}`;
  }

  sentence(index) {
    const { subject, predicate, object, angle_deg: angle, score } = this.report.relations[index];
    const words = this.report.predicates[predicate] ?? predicate;
    const turn = angle === null ? "" : ` ${angle > 0 ? "+" : ""}${angle.toFixed(0)}°`;
    return `${subject} · ${words}${turn} · ${object} (${score.toFixed(2)})`;
  }
}
