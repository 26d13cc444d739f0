// A stack of canvases with a shared size: what changes rarely below, what changes often above. And the palette.

const LAYERS = ["ground", "marks", "cursor"];

export const INK = {
  text: "#1b2733", soft: "#5a6b7b", faint: "#c9d2da", line: "#22313f", band: "#e3eeea", limit: "#6d8f84", ground: "#ffffff",
  in: "#3f9483", near: "#8a7a10", unsure: "#b37400", over: "#c2410c", under: "#1d5fae", gap: "#d9dfe5",
};

export class Sheet {
  constructor(element, onResize) {
    this.element = element;
    this.layers = {};
    for (const name of LAYERS) {
      const canvas = document.createElement("canvas");
      element.append(canvas);
      this.layers[name] = canvas.getContext("2d");
    }
    this.width = this.height = 0;
    new ResizeObserver(() => {
      this.fit();
      onResize();
    }).observe(element);
    this.fit();
  }

  fit() {
    const box = this.element.getBoundingClientRect();
    this.ratio = window.devicePixelRatio || 1;
    this.width = Math.floor(box.width);
    this.height = Math.floor(box.height);
    this.text = Math.max(11, Math.round(parseFloat(getComputedStyle(document.documentElement).fontSize) * 0.86));
    for (const pen of Object.values(this.layers)) {
      pen.canvas.width = this.width * this.ratio;
      pen.canvas.height = this.height * this.ratio;
    }
  }

  pen(layer) {
    const pen = this.layers[layer];
    pen.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
    pen.clearRect(0, 0, this.width, this.height);
    pen.font = `${this.text}px ${getComputedStyle(document.body).fontFamily}`;
    pen.lineJoin = "round";
    return pen;
  }
}

// Marks by class: what is out of tolerance has a shape of its own, so that colour is never alone.
export function mark(pen, kind, x, y, size, up = -1) {
  pen.beginPath();
  if (kind === "unsure") {
    pen.moveTo(x, y - size);
    pen.lineTo(x + size, y);
    pen.lineTo(x, y + size);
    pen.lineTo(x - size, y);
  } else {
    const tip = kind === "under" ? -up : up;
    pen.moveTo(x, y + tip * size);
    pen.lineTo(x + size, y - tip * size * 0.8);
    pen.lineTo(x - size, y - tip * size * 0.8);
  }
  pen.closePath();
  pen.fillStyle = INK[kind];
  pen.fill();
  pen.lineWidth = 1;
  pen.strokeStyle = INK.ground;
  pen.stroke();
}

// A label that stays inside the sheet, on a ground of its own.
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
  pen.fillStyle = "rgba(255, 255, 255, 0.94)";
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

// Steps of 1, 2 or 5 times a power of ten, about `count` of them over a span.
export function niceStep(span, count) {
  const rough = span / Math.max(count, 1);
  const power = 10 ** Math.floor(Math.log10(rough));
  const share = rough / power;
  return power * (share > 5 ? 10 : share > 2 ? 5 : share > 1 ? 2 : 1);
}

export function signed(value, digits = 4) {
  const words = Math.abs(value).toFixed(digits);
  return (Number(words) === 0 ? "" : value > 0 ? "+" : "\u2212") + words;
}

// Enough digits to tell limits and deviations of this size apart.
export const digitsFor = (zone) => (zone.upper_mm - zone.lower_mm < 0.02 ? 5 : 4);

export function wordsOf(point, zone) {
  const word = ["CONFORM", "NOT PROVEN", "NOT CONFORM"][point.verdict] ?? "";
  return `${signed(point.deviation, digitsFor(zone))} mm  ${word}\nstation ${point.station.toFixed(2)} mm\nx ${point.x.toFixed(3)}  y ${point.y.toFixed(3)}`;
}
