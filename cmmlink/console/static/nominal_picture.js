// The nominal of a new plan as it was understood: its curve, where it starts, and which way it runs.

import { byId, within } from "./dom.js";

/** @import { Understood } from "./protocol.js" */

const SVG = "http://www.w3.org/2000/svg";
const WIDTH = 400, HEIGHT = 220, MARGIN = 22;
const ARROWS = [0.08, 0.4, 0.72]; // places along the curve
const ARROW = 9, DOT = 5;

/** @param {Understood} understood */
export function drawNominal({ points_mm: points, closed }) {
  const svg = within(byId("nominal-picture"), "svg");
  svg.setAttribute("viewBox", `0 0 ${WIDTH} ${HEIGHT}`);
  svg.replaceChildren();
  if (!points.length) return;
  const places = placesOf(points), [x, y] = places[0];
  const path = places.map(([px, py], k) => `${k ? "L" : "M"}${px.toFixed(2)} ${py.toFixed(2)}`).join("");
  svg.append(
    element("path", { class: closed ? "curve inside" : "curve", d: closed ? `${path}Z` : path }),
    ...ARROWS.map((share) => arrow(places, Math.round(share * (places.length - 2)))),
    element("circle", { class: "start", cx: x, cy: y, r: DOT }),
  );
}

/**
 * Where the points lie on the picture, as large as it holds them; y points up.
 * @param {readonly (readonly [number, number])[]} points
 * @returns {(readonly [number, number])[]}
 */
export function placesOf(points) {
  const xs = points.map(([x]) => x), ys = points.map(([, y]) => y);
  const [left, right, low, high] = [Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)];
  const scale = Math.min((WIDTH - 2 * MARGIN) / Math.max(right - left, 1e-9), (HEIGHT - 2 * MARGIN) / Math.max(high - low, 1e-9));
  return points.map(([x, y]) => [WIDTH / 2 + (x - (left + right) / 2) * scale, HEIGHT / 2 - (y - (low + high) / 2) * scale]);
}

/**
 * An arrow head on the curve, which points the way that stations count.
 * @param {(readonly [number, number])[]} places
 * @param {number} k
 */
function arrow(places, k) {
  const [[x, y], [nextX, nextY]] = [places[k], places[k + 1]], far = Math.hypot(nextX - x, nextY - y) || 1;
  const [along, across] = [[(nextX - x) / far, (nextY - y) / far], [-(nextY - y) / far, (nextX - x) / far]];
  const corner = (/** @type {number} */ ahead, /** @type {number} */ aside) =>
    `${(x + ARROW * (ahead * along[0] + aside * across[0])).toFixed(2)},${(y + ARROW * (ahead * along[1] + aside * across[1])).toFixed(2)}`;
  return element("polygon", { class: "arrow", points: [corner(1, 0), corner(-0.6, 0.6), corner(-0.6, -0.6)].join(" ") });
}

/**
 * @param {string} tag
 * @param {Record<string, string | number>} attributes
 */
function element(tag, attributes) {
  const made = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, String(value));
  return made;
}
