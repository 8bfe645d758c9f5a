// Charts of the last seconds, with numbers at the axis.

import { element } from "/elements.js";
import { french } from "/controls.js";
import { colours, sharp } from "/map.js";

const SECONDS = 15;
const LEFT = 44; // px for the numbers

export class Strip {
  // `least`: the axis reaches at least so far up and down; `band`: a strip that is asked for.
  constructor(place, title, { column, scale, digits, unit, colour, least, band }) {
    Object.assign(this, { column, scale, digits, unit, colour, least, band });
    this.canvas = element("canvas", { role: "img", "aria-label": title });
    this.value = element("b", {});
    place.append(element("div", { class: "strip" }, element("span", { class: "soft" }, title), this.value, this.canvas));
  }

  draw(way) {
    const { pen, width, height } = sharp(this.canvas);
    const [ink, soft, grid, good] = colours(this.colour, "soft", "line", "good");
    const end = Math.max(SECONDS, way.length ? way.at(-1)[0] : 0);
    let first = way.length;
    while (first > 0 && way[first - 1][0] >= end - SECONDS) first -= 1;
    const rows = way.slice(first);
    const values = rows.map((row) => row[this.column] * this.scale);
    const most = nice(Math.max(this.least, ...values.map(Math.abs)));
    const x = (t) => LEFT + ((width - LEFT - 6) * (t - end + SECONDS)) / SECONDS;
    const y = (value) => height / 2 - ((height / 2 - 9) * value) / most;
    pen.font = "11px system-ui, 'DejaVu Sans', sans-serif";
    if (this.band) {
      pen.globalAlpha = 0.13;
      pen.fillStyle = good;
      pen.fillRect(LEFT, y(this.band), width - LEFT - 6, y(-this.band) - y(this.band));
      pen.globalAlpha = 1;
    }
    pen.fillStyle = soft;
    pen.strokeStyle = grid;
    pen.lineWidth = 1;
    pen.textAlign = "right";
    pen.textBaseline = "middle";
    for (const value of [-most, 0, most]) {
      pen.beginPath();
      pen.moveTo(LEFT, y(value));
      pen.lineTo(width - 6, y(value));
      pen.stroke();
      pen.fillText(french(value, most < 1 ? 2 : most < 10 ? 1 : 0), LEFT - 5, y(value));
    }
    pen.beginPath();
    rows.forEach((row, k) => pen[k ? "lineTo" : "moveTo"](x(row[0]), y(values[k])));
    pen.strokeStyle = ink;
    pen.lineWidth = 1.7;
    pen.lineJoin = "round";
    pen.stroke();
    this.value.textContent = values.length ? `${french(values.at(-1), this.digits)} ${this.unit}` : "–";
  }
}

// The next of 1, 2, 5 times a power of ten.
function nice(value) {
  const power = 10 ** Math.floor(Math.log10(value));
  return power * [1, 2, 5, 10].find((one) => one * power >= value * 0.999);
}
