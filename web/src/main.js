// Puts the report together from the data that the page carries.

import { make, toggle } from "./dom.js";
import { ModelView } from "./model.js";
import { PanoramaView } from "./panorama.js";
import { SelectionBar, fillCertificate, fillLegend, fillTimings } from "./panels.js";
import { PlanView } from "./plan.js";
import { Store } from "./store.js";
import { ObjectTable, RelationTable } from "./tables.js";
import { hasWebGL } from "./webgl.js";

const HINT = "Click here first, then the wheel zooms";

/** A message on a stage that goes away by itself. */
function hintOn(card) {
  const note = make("p", { class: "hint", "aria-hidden": "true" }, HINT);
  card.querySelector(".stage").append(note);
  let timer = 0;
  return () => {
    note.classList.add("shown");
    clearTimeout(timer);
    timer = setTimeout(() => note.classList.remove("shown"), 1200);
  };
}

function addSwitches(bar, report, store) {
  const names = toggle("Names", true, (value) => store.set({ labels: value }));
  const switches = [names.button];
  const shows = [() => names.show(store.labels)];
  if (report.before !== null) {
    const states = ["before", "after"].map((state) => {
      const button = toggle(state === "before" ? "Before" : "After", false, () => store.show(state));
      shows.push(() => button.show(store.shown === state));
      return button.button;
    });
    const group = make("div", { class: "choice", role: "group", "aria-label": "Which boxes" }, ...states);
    const ghost = toggle("Outlines", store.ghost, (value) => store.set({ ghost: value }));
    ghost.button.title = "Dashed outlines of the other boxes";
    shows.push(() => ghost.show(store.ghost));
    switches.unshift(group, ghost.button);
  }
  bar.append(...switches);
  store.on("display", () => shows.forEach((show) => show()));
  store.tell("display");
}

async function start() {
  const report = JSON.parse(document.getElementById("report-data").textContent);
  const card = (name) => document.getElementById(name);
  const store = new Store(report);
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const palette = () => report.palettes[dark.matches ? "dark" : "light"];
  fillLegend(card("legend"), report.groups);
  fillCertificate(card("certificate"), report.certificate);
  fillTimings(card("timings"), report.timings);
  new ObjectTable(card("objects"), report, store);
  new RelationTable(card("relations"), report, store);
  new SelectionBar(card("selection"), report, store);
  const plan = new PlanView(card("plan"), report, store);
  const image = card("photo");
  await image.decode();
  const drawable = hasWebGL();
  document.body.classList.toggle("no-webgl", !drawable);
  const panorama = new PanoramaView(card("panorama"), image, report, store, drawable, hintOn(card("panorama")));
  panorama.lookListeners.push((lens) => plan.follow(lens));
  panorama.draw();
  const model = drawable ? new ModelView(card("model"), report, store, palette(), hintOn(card("model"))) : null;
  dark.addEventListener("change", () => model?.colour(palette()));
  addSwitches(card("switches"), report, store);
  document.addEventListener("keydown", (event) => {
    if (event.key === "Escape") store.clear();
  });
  window.panoscene = { report, store, panorama, model, plan };
  requestAnimationFrame(() => setTimeout(() => (document.documentElement.dataset.ready = "true")));
}

start();
