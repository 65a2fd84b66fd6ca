// Pointer and keyboard input of the views: taps, drags, pinches, wheel.

const SLOP = 6;

/** Call tap(x, y, target) for presses that do not become drags; positions within the element. */
export function onTap(element, tap) {
  let start = null;
  element.addEventListener(
    "pointerdown",
    (event) => {
      const { clientX, clientY, target, isPrimary } = event;
      start = isPrimary && event.button === 0 ? { clientX, clientY, target } : null;
    },
    true,
  );
  element.addEventListener(
    "pointerup",
    ({ clientX, clientY, isPrimary }) => {
      if (start === null || !isPrimary) return;
      if (Math.hypot(clientX - start.clientX, clientY - start.clientY) <= SLOP) {
        const bounds = element.getBoundingClientRect();
        tap(clientX - bounds.left, clientY - bounds.top, start.target);
      }
      start = null;
    },
    true,
  );
}

/** Call point(x, y, target) while a mouse moves without buttons, and leave() when it goes. */
export function onPoint(element, point, leave) {
  element.addEventListener("pointermove", (event) => {
    if (event.pointerType !== "mouse" || event.buttons !== 0) return;
    const bounds = element.getBoundingClientRect();
    point(event.clientX - bounds.left, event.clientY - bounds.top, event.target);
  });
  element.addEventListener("pointerleave", leave);
}

/** Call drag(dx, dy) for one pointer and pinch(factor) for two. */
export function onDrag(element, drag, pinch) {
  const pointers = new Map();
  const spread = () => {
    const [a, b] = [...pointers.values()];
    return Math.max(1, Math.hypot(a.x - b.x, a.y - b.y));
  };
  element.addEventListener("pointerdown", (event) => {
    if (event.button !== 0) return;
    pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    element.setPointerCapture(event.pointerId);
  });
  element.addEventListener("pointermove", (event) => {
    const last = pointers.get(event.pointerId);
    if (last === undefined) return;
    const before = pointers.size === 2 ? spread() : 0;
    pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    if (pointers.size === 1) drag(event.clientX - last.x, event.clientY - last.y);
    else if (pointers.size === 2) pinch(spread() / before);
  });
  for (const end of ["pointerup", "pointercancel", "lostpointercapture"]) {
    element.addEventListener(end, (event) => pointers.delete(event.pointerId));
  }
}

/**
 * Let the wheel zoom only where the user is at work: while the view has the focus, or with Ctrl
 * (a pinch on a touchpad). Elsewhere the page scrolls, and a hint is shown.
 */
export function onWheel(element, zoom, hint) {
  element.addEventListener(
    "wheel",
    (event) => {
      if (!event.ctrlKey && !element.matches(":focus, :focus-within")) {
        event.stopImmediatePropagation();
        hint();
        return;
      }
      event.preventDefault();
      if (zoom === null) return;
      const pixels = event.deltaMode === 1 ? event.deltaY * 16 : event.deltaY;
      zoom(Math.exp(Math.max(-0.3, Math.min(0.3, pixels * (event.ctrlKey ? 0.01 : 0.0015)))));
    },
    { passive: false, capture: true },
  );
}

/** Call act(dx, dy) for arrow keys and others(key) for the rest; both say whether they used it. */
export function onKeys(element, arrows, others) {
  const steps = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
  element.addEventListener("keydown", (event) => {
    if (event.target !== element || event.ctrlKey || event.metaKey || event.altKey) return;
    const step = steps[event.key];
    const used = step === undefined ? others(event.key) : (arrows(...step), true);
    if (used) event.preventDefault();
  });
}
