// Making elements. Text only ever becomes text nodes, so names cannot become markup.

const SVG = "http://www.w3.org/2000/svg";

function fill(node, attributes, children) {
  for (const [name, value] of Object.entries(attributes)) {
    if (value === null || value === undefined || value === false) continue;
    if (name.startsWith("on")) node.addEventListener(name.slice(2), value);
    else node.setAttribute(name, value === true ? "" : String(value));
  }
  node.append(...children.filter((child) => child !== null));
  return node;
}

/** make("p", {class: "note"}, "text", otherNode) */
export function make(tag, attributes = {}, ...children) {
  return fill(document.createElement(tag), attributes, children);
}

export function makeSvg(tag, attributes = {}, ...children) {
  return fill(document.createElementNS(SVG, tag), attributes, children);
}

/** A button that is pressed or not. */
export function toggle(label, pressed, change) {
  const button = make("button", { type: "button", class: "toggle" }, label);
  const show = (value) => button.setAttribute("aria-pressed", String(value));
  button.addEventListener("click", () => change(button.getAttribute("aria-pressed") !== "true"));
  show(pressed);
  return { button, show };
}

export function action(label, title, act) {
  return make("button", { type: "button", class: "action", title, onclick: act }, label);
}

export const calm = () => matchMedia("(prefers-reduced-motion: reduce)").matches;

/** Call step(share) with shares from 0 to 1 during some milliseconds; returns what stops it. */
export function tween(duration, step) {
  if (calm()) {
    step(1);
    return () => {};
  }
  const start = performance.now();
  let frame = requestAnimationFrame(function next(now) {
    const share = Math.min(1, Math.max(0, (now - start) / duration));
    step(1 - (1 - share) ** 3);
    if (share < 1) frame = requestAnimationFrame(next);
  });
  return () => cancelAnimationFrame(frame);
}

/** Many requests, one call in the next frame. */
export function oncePerFrame(act) {
  let frame = null;
  return () => {
    frame ??= requestAnimationFrame(() => {
      frame = null;
      act();
    });
  };
}
