// A stack of canvases with a shared size: what changes rarely below, what changes often above. And what is drawn on them alike.

/** @import { PointClass } from "./points.js" */
/** @typedef {CanvasRenderingContext2D} Pen */
/** @typedef {"ground" | "marks" | "cursor"} Layer */

/** @type {Layer[]} */
const LAYERS = ["ground", "marks", "cursor"];

/** What the style sheets call --draw-NAME. */
const INKS = /** @type {const} */ ([
  "text", "soft", "faint", "line", "band", "limit", "ground", "label", "in", "near", "not-proven", "over", "under", "gap", "region",
  "chosen", "region-ground", "uncertain-ground", "heat-under-3", "heat-under-2", "heat-under-1", "heat-0", "heat-over-1", "heat-over-2",
  "heat-over-3", "heat-mark", "heat-none",
]);

/** The colours of drawings, as the style sheets have them. @type {Record<typeof INKS[number], string>} */
export const INK = /** @type {any} */ ({});

/** Take over the colours of the style sheets, and have everything drawn anew with them. */
export function readInk() {
  const style = getComputedStyle(document.documentElement);
  for (const name of INKS) INK[name] = style.getPropertyValue(`--draw-${name}`).trim();
  document.dispatchEvent(new Event("ink"));
}

export class Sheet {
  /**
   * @param {HTMLElement} element
   * @param {() => void} onResize
   */
  constructor(element, onResize) {
    this.element = element;
    this.width = this.height = 0;
    this.ratio = 1;
    this.text = 11; // size of letters, px
    this.layers = new Map(LAYERS.map((layer) => [layer, addCanvas(element)]));
    this.fit();
    new ResizeObserver(() => {
      this.fit();
      onResize();
    }).observe(element);
    document.addEventListener("ink", onResize);
  }

  fit() {
    const box = this.element.getBoundingClientRect();
    this.ratio = window.devicePixelRatio || 1;
    this.width = Math.floor(box.width);
    this.height = Math.floor(box.height);
    this.text = Math.max(11, Math.round(parseFloat(getComputedStyle(document.documentElement).fontSize) * 0.86));
    for (const pen of this.layers.values()) {
      pen.canvas.width = this.width * this.ratio;
      pen.canvas.height = this.height * this.ratio;
    }
  }

  /**
   * The pen of a layer, which is empty again.
   * @param {Layer} layer
   */
  pen(layer) {
    const pen = /** @type {Pen} */ (this.layers.get(layer));
    pen.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
    pen.clearRect(0, 0, this.width, this.height);
    pen.font = `${this.text}px ${getComputedStyle(document.body).fontFamily}`;
    pen.lineJoin = "round";
    return pen;
  }

  clear() {
    for (const layer of LAYERS) this.pen(layer);
  }
}

/** @param {HTMLElement} element */
function addCanvas(element) {
  const canvas = document.createElement("canvas"), pen = canvas.getContext("2d");
  if (!pen) throw new Error("this browser cannot draw");
  element.append(canvas);
  return pen;
}

/**
 * Mark a point by its class: what is out of tolerance has a shape of its own, so that colour is never alone.
 * @param {Pen} pen
 * @param {PointClass} kind
 * @param {number} x
 * @param {number} y
 * @param {number} size
 */
export function mark(pen, kind, x, y, size) {
  pen.beginPath();
  if (kind === "not-proven") {
    pen.moveTo(x, y - size);
    pen.lineTo(x + size, y);
    pen.lineTo(x, y + size);
    pen.lineTo(x - size, y);
  } else {
    const up = kind === "under" ? 1 : -1;
    pen.moveTo(x, y + up * size);
    pen.lineTo(x + size, y - up * size * 0.8);
    pen.lineTo(x - size, y - up * size * 0.8);
  }
  pen.closePath();
  pen.fillStyle = INK[kind];
  pen.fill();
  pen.lineWidth = 1;
  pen.strokeStyle = INK.ground;
  pen.stroke();
}

/**
 * A cross: in the place of a run that has no verdict, or where a value was found.
 * @param {Pen} pen
 * @param {number} x
 * @param {number} y
 * @param {number} size
 */
export function cross(pen, x, y, size, ink = INK.soft) {
  pen.strokeStyle = ink;
  pen.lineWidth = 2;
  pen.beginPath();
  for (const side of [-1, 1]) {
    pen.moveTo(x - size, y - side * size);
    pen.lineTo(x + size, y + side * size);
  }
  pen.stroke();
}

/**
 * A ring around a point.
 * @param {Pen} pen
 * @param {number} x
 * @param {number} y
 * @param {number} radius
 * @param {number} width
 */
export function ring(pen, x, y, radius, width) {
  pen.strokeStyle = INK.text;
  pen.lineWidth = width;
  pen.beginPath();
  pen.arc(x, y, radius, 0, 2 * Math.PI);
  pen.stroke();
}

/**
 * Words beside a place, on a ground of their own and always inside the sheet.
 * @param {Pen} pen
 * @param {Sheet} sheet
 * @param {string} words
 * @param {number} x
 * @param {number} y
 * @param {string} ink
 */
export function label(pen, sheet, words, x, y, ink, strong = false) {
  const lines = words.split("\n");
  const font = pen.font;
  if (strong) pen.font = `600 ${font}`;
  const high = sheet.text * 1.35, pad = sheet.text * 0.5;
  const wide = Math.max(...lines.map((line) => pen.measureText(line).width)) + 2 * pad;
  const tall = lines.length * high + pad;
  const left = Math.min(Math.max(x + 12, 4), sheet.width - wide - 4);
  const top = Math.min(Math.max(y - tall - 10, 4), sheet.height - tall - 4);
  pen.beginPath();
  pen.roundRect(left, top, wide, tall, 5);
  pen.fillStyle = INK.label;
  pen.fill();
  pen.lineWidth = 1.5;
  pen.strokeStyle = ink;
  pen.stroke();
  pen.fillStyle = INK.text;
  pen.textAlign = "left";
  pen.textBaseline = "middle";
  lines.forEach((line, k) => pen.fillText(line, left + pad, top + pad / 2 + high * (k + 0.5)));
  pen.font = font;
}
