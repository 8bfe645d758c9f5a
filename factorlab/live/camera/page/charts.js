// Small line charts of the last seconds.

import { element, shape } from "/elements.js";

const SECONDS = 12;
const WIDTH = 300;
const HEIGHT = 64;

export class Traces {
  constructor(place) {
    this.place = place;
    this.clear();
  }

  clear() {
    this.series = new Map();
    this.place.replaceChildren();
  }

  add(t, values) {
    for (const [name, value] of Object.entries(values)) {
      if (!this.series.has(name)) this.series.set(name, this.start(name));
      const one = this.series.get(name);
      if (one.points.length && t <= one.points.at(-1)[0]) continue;
      one.points.push([t, value]);
      while (one.points[0][0] < t - SECONDS) one.points.shift();
      this.draw(one, t);
    }
  }

  start(name) {
    const lines = shape("g", {});
    const zero = shape("line", { x1: 0, x2: WIDTH });
    const last = element("b", {});
    const [low, high] = [element("span", {}), element("span", {})];
    this.place.append(element("div", { class: "trace" }, element("span", { class: "soft" }, name), last,
      shape("svg", { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, preserveAspectRatio: "none", role: "img", "aria-label": name }, zero, lines),
      element("div", { class: "ends" }, low, high)));
    return { points: [], lines, zero, last, low, high };
  }

  draw(one, now) {
    const values = one.points.map(([, value]) => value).filter((value) => value !== null);
    if (!values.length) return;
    let [low, high] = [Math.min(...values), Math.max(...values)];
    const space = Math.max(high - low, 1e-3 * Math.max(Math.abs(high), Math.abs(low)), 1e-9);
    [low, high] = [low - 0.12 * space, high + 0.12 * space];
    const x = (t) => (WIDTH * (t - now + SECONDS)) / SECONDS;
    const y = (value) => HEIGHT * (1 - (value - low) / (high - low));
    const runs = [[]];
    for (const [t, value] of one.points) {
      if (value === null) runs.push([]);
      else runs.at(-1).push(`${x(t).toFixed(1)},${y(value).toFixed(1)}`);
    }
    one.lines.replaceChildren(...runs.filter((run) => run.length > 1)
      .map((run) => shape("polyline", { points: run.join(" ") })));
    const crosses = low < 0 && high > 0;
    one.zero.setAttribute("y1", crosses ? y(0) : -9);
    one.zero.setAttribute("y2", crosses ? y(0) : -9);
    const last = one.points.at(-1)[1];
    one.last.textContent = last === null ? "–" : short(last);
    one.low.textContent = `${short(Math.min(...values))} … ${short(Math.max(...values))}`;
    one.high.textContent = `last ${SECONDS} s`;
  }
}

function short(value) {
  const size = Math.abs(value);
  return value.toFixed(size >= 100 ? 0 : size >= 10 ? 1 : size >= 1 ? 2 : 3);
}
