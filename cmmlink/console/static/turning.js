// Mouse, fingers and keys of the view of a surface: turn, move, enlarge, read out. All that the mouse does the keys do too.

import { make } from "./dom.js";
import { gettext } from "./words.js";

/** @import { SurfaceView } from "./surface_view.js" */
/** @typedef {{ x: number, y: number }} Finger */

const ZOOM = 1.25;
const RAD_PER_PX = 0.008;
const STEP_RAD = Math.PI / 24;
const MOVE_PX = 40;

/** Steps to the right and down. @type {Readonly<Record<string, readonly [number, number]>>} */
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

/** @param {SurfaceView} view */
export function listenToTurning(view) {
  listenToKeys(view);
  listenToWheel(view);
  listenToPointers(view);
  addButtons(view);
}

/**
 * Change what is seen, once there is something to see.
 * @param {SurfaceView} view
 * @param {() => void} act
 */
function change(view, act) {
  if (!view.isReady) return;
  act();
  view.move();
}

/** @param {SurfaceView} view */
function listenToKeys(view) {
  const { turn } = view;
  /** @type {Readonly<Record<string, () => void>>} */
  const keys = {
    "+": () => turn.zoom(ZOOM), "=": () => turn.zoom(ZOOM), "-": () => turn.zoom(1 / ZOOM), "0": () => turn.behold(turn.box),
    w: () => view.goToWorst(),
  };
  view.element.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const arrow = ARROWS[event.key], act = keys[event.key.toLowerCase()];
    if (!arrow && !act) return;
    event.preventDefault();
    event.stopPropagation();
    change(view, () => {
      if (!arrow) act();
      else if (event.shiftKey) turn.move(arrow[0] * MOVE_PX, arrow[1] * MOVE_PX);
      else turn.push(arrow[0] * STEP_RAD, arrow[1] * STEP_RAD);
    });
  });
}

/** @param {SurfaceView} view */
function listenToWheel(view) {
  view.element.addEventListener("wheel", (event) => {
    event.preventDefault();
    const [x, y] = placeOf(view, event);
    change(view, () => view.turn.zoom(event.deltaY > 0 ? 1 / ZOOM : ZOOM, x, y));
  }, { passive: false });
}

/**
 * One finger or the left button turns; two fingers, or another button or the shift key, move; what is between two fingers stays there.
 * @param {SurfaceView} view
 */
function listenToPointers(view) {
  const { element, turn } = view;
  /** @type {Map<number, Finger>} */
  const down = new Map();
  element.addEventListener("pointerdown", (event) => {
    const [x, y] = placeOf(view, event);
    down.set(event.pointerId, { x, y });
    element.setPointerCapture(event.pointerId);
  });
  element.addEventListener("pointermove", (event) => {
    const [x, y] = placeOf(view, event), before = down.get(event.pointerId);
    if (!before) return readSoon(view, x, y);
    const fingers = [...down.values()], first = spanOf(fingers);
    const [right, under] = [x - before.x, y - before.y];
    [before.x, before.y] = [x, y];
    const then = spanOf(fingers);
    change(view, () => {
      if (first && then) {
        turn.move(then.x - first.x, then.y - first.y);
        turn.zoom(then.apart / Math.max(first.apart, 1), then.x, then.y);
      } else if (event.shiftKey || event.buttons > 1) turn.move(right, under);
      else turn.push(right * RAD_PER_PX, under * RAD_PER_PX);
    });
  });
  for (const name of /** @type {const} */ (["pointerup", "pointercancel"])) {
    element.addEventListener(name, (event) => down.delete(event.pointerId));
  }
  element.addEventListener("pointerleave", () => view.readOut(null));
  element.addEventListener("contextmenu", (event) => event.preventDefault());
  element.addEventListener("dblclick", () => change(view, () => turn.behold(turn.box)));
}

let isReading = false;

/**
 * Read out what is under the pointer, at most once a frame.
 * @param {SurfaceView} view
 * @param {number} x
 * @param {number} y
 */
function readSoon(view, x, y) {
  if (isReading || !view.isReady) return;
  isReading = true;
  requestAnimationFrame(() => {
    isReading = false;
    view.readOut(view.nearest(x, y));
  });
}

/**
 * The middle between two fingers, and how far they are apart; null where there are not two.
 * @param {readonly Finger[]} fingers
 */
function spanOf(fingers) {
  if (fingers.length !== 2) return null;
  const [a, b] = fingers;
  return { x: (a.x + b.x) / 2, y: (a.y + b.y) / 2, apart: Math.hypot(b.x - a.x, b.y - a.y) };
}

/**
 * @param {SurfaceView} view
 * @param {MouseEvent} event
 * @returns {[x: number, y: number]}
 */
function placeOf({ element }, event) {
  const box = element.getBoundingClientRect();
  return [event.clientX - box.left, event.clientY - box.top];
}

/**
 * The buttons, for who has neither wheel nor keys.
 * @param {SurfaceView} view
 */
function addButtons(view) {
  const { turn } = view;
  /** @type {[sign: string, name: string, act: () => void][]} */
  const buttons = [
    ["+", gettext("Zoom in"), () => turn.zoom(ZOOM)], ["\u2212", gettext("Zoom out"), () => turn.zoom(1 / ZOOM)],
    ["\u2922", gettext("Show all"), () => turn.behold(turn.box)],
  ];
  document.querySelector('.zooms[data-of="surface"]')?.append(...buttons.map(([sign, name, act]) => {
    const button = make("button", sign);
    button.setAttribute("type", "button");
    button.setAttribute("aria-label", name);
    button.title = name;
    button.className = "small";
    button.addEventListener("click", () => change(view, act));
    return button;
  }));
}
