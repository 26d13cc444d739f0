// Mouse, fingers and keys of a drawing: zoom, pan, read-out. Both drawings have the same, and all that the mouse does the keys do too.

import { make } from "./dom.js";
import { gettext } from "./words.js";

/** @import { Cursor, Drawing, Place } from "./drawing.js" */
/** @import { HeldPoint } from "./points.js" */

const ZOOM = 1.25;
const STEP_PX = 4; // shortest step of the read-out
const REACH_PX = 600; // farthest that the next point is looked for
const PAN_PX = 60;

/** Steps in pixels to the right and down. @type {Readonly<Record<string, Place>>} */
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

/**
 * Let mouse and keys act on a drawing.
 * @param {Drawing} drawing
 * @param {(cursor: Cursor | null) => void} onCursor hears which point both drawings read out
 * @param {() => HeldPoint | null} worstPoint
 */
export function listen(drawing, onCursor, worstPoint) {
  /** @type {Cursor | null} */
  let cursor = null;
  const read = (/** @type {HeldPoint | null} */ point) => {
    cursor = point && { ...point, by: drawing.name };
    onCursor(cursor);
  };
  listenToMouse(drawing, read);
  listenToFingers(drawing);
  addButtons(drawing);

  const place = () => (cursor ? drawing.place(cursor) : drawing.middle);
  const jump = (/** @type {HeldPoint | null} */ point) => {
    if (!point) return;
    read(point);
    drawing.reveal(point);
  };
  /** @type {Readonly<Record<string, () => void>>} */
  const keys = {
    "+": () => drawing.zoom(1 / ZOOM, place()),
    "=": () => drawing.zoom(1 / ZOOM, place()),
    "-": () => drawing.zoom(ZOOM, place()),
    "0": () => drawing.fit(),
    w: () => jump(worstPoint()),
  };
  const actOf = (/** @type {KeyboardEvent} */ event) => {
    const arrow = ARROWS[event.key];
    if (!arrow) return keys[event.key.toLowerCase()];
    const [dx, dy] = arrow;
    return event.shiftKey ? () => drawing.pan(dx * PAN_PX, dy * PAN_PX) : () => jump(nextPoint(drawing, cursor, place(), arrow));
  };
  drawing.element.addEventListener("keydown", (event) => {
    const act = actOf(event);
    if (!act || !drawing.isReady || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    event.stopPropagation();
    act();
  });
}

/**
 * @param {Drawing} drawing
 * @param {(point: HeldPoint | null) => void} read
 */
function listenToMouse(drawing, read) {
  const { element } = drawing;
  /** @type {Place | null} */
  let dragged = null;
  /** @type {(event: MouseEvent) => Place} */
  const placeOf = (event) => {
    const box = element.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  };
  element.addEventListener("wheel", (event) => {
    event.preventDefault();
    if (drawing.isReady) drawing.zoom(event.deltaY > 0 ? ZOOM : 1 / ZOOM, placeOf(event));
  }, { passive: false });
  element.addEventListener("pointerdown", (event) => {
    dragged = placeOf(event);
    element.setPointerCapture(event.pointerId);
  });
  element.addEventListener("pointerup", () => (dragged = null));
  element.addEventListener("pointermove", (event) => {
    const place = placeOf(event);
    if (!drawing.isReady) return;
    if (dragged && event.buttons && event.isPrimary) {
      drawing.pan(dragged[0] - place[0], dragged[1] - place[1]);
      dragged = place;
    } else read(drawing.nearest(place));
  });
  element.addEventListener("pointerleave", () => read(null));
  element.addEventListener("dblclick", () => drawing.fit());
  element.addEventListener("blur", () => read(null));
}

/**
 * Two fingers zoom and pan: what is between them stays between them.
 * @param {Drawing} drawing
 */
function listenToFingers(drawing) {
  const { element } = drawing;
  /** @type {Map<number, Place>} */
  const fingers = new Map();
  const lift = (/** @type {PointerEvent} */ event) => fingers.delete(event.pointerId);
  element.addEventListener("pointerdown", (event) => {
    if (event.pointerType === "touch") fingers.set(event.pointerId, [event.clientX, event.clientY]);
  });
  element.addEventListener("pointermove", (event) => {
    if (!fingers.has(event.pointerId) || !drawing.isReady) return;
    const before = spanOf([...fingers.values()]);
    fingers.set(event.pointerId, [event.clientX, event.clientY]);
    const after = spanOf([...fingers.values()]), box = element.getBoundingClientRect();
    if (!before || !after) return;
    event.stopImmediatePropagation();
    drawing.pan(before.x - after.x, before.y - after.y);
    drawing.zoom(before.apart / Math.max(after.apart, 1), [after.x - box.left, after.y - box.top]);
  }, true);
  for (const name of /** @type {const} */ (["pointerup", "pointercancel"])) element.addEventListener(name, lift);
}

/**
 * The middle between two fingers, and how far they are apart; null where there are not two.
 * @param {Place[]} fingers
 */
function spanOf(fingers) {
  if (fingers.length !== 2) return null;
  const [[x, y], [u, v]] = fingers;
  return { x: (x + u) / 2, y: (y + v) / 2, apart: Math.hypot(u - x, v - y) };
}

/**
 * The buttons of a drawing, for who has no wheel: closer, farther, all of it.
 * @param {Drawing} drawing
 */
function addButtons(drawing) {
  const zoom = (/** @type {number} */ factor) => drawing.isReady && drawing.zoom(factor, drawing.middle);
  /** @type {[sign: string, name: string, act: () => void][]} */
  const buttons = [
    ["+", gettext("Zoom in"), () => zoom(1 / ZOOM)], ["\u2212", gettext("Zoom out"), () => zoom(ZOOM)],
    ["\u2922", gettext("Show all"), () => drawing.isReady && drawing.fit()],
  ];
  document.querySelector(`.zooms[data-of="${drawing.name}"]`)?.append(...buttons.map(([sign, name, act]) => {
    const button = make("button", sign);
    button.setAttribute("type", "button");
    button.setAttribute("aria-label", name);
    button.title = name;
    button.className = "small";
    button.addEventListener("click", act);
    return button;
  }));
}

/**
 * The next point in a direction: farther and farther away, until it is another than the one that is read out.
 * @param {Drawing} drawing
 * @param {Cursor | null} cursor
 * @param {Place} from
 * @param {Place} step
 */
function nextPoint(drawing, cursor, from, step) {
  let next = null;
  for (let reach = STEP_PX; reach < REACH_PX; reach *= 2) {
    next = drawing.nearest([from[0] + step[0] * reach, from[1] + step[1] * reach]);
    if (next && (next.bin !== cursor?.bin || next.side !== cursor.side)) break;
  }
  return next;
}
