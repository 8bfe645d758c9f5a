// Tables, quantities, and the panels of single tasks.

import { element, shape } from "/elements.js";

export function quantity({ value, unit, digits, sigma }) {
  if (value === null) return ["–"];
  // one digit of σ that is not zero says how far the value's digits mean something
  const fine = sigma > 0 ? Math.min(5, Math.max(digits, Math.ceil(-Math.log10(sigma)))) : digits;
  const text = value.toFixed(fine) + (sigma === null ? "" : ` ± ${sigma.toFixed(fine)}`);
  return unit ? [text, " ", element("small", {}, unit)] : [text];
}

export function table({ title, columns, rows }) {
  const words = columns.map((_, k) => rows.some((row) => typeof row[k] === "string"));
  const kind = (k) => (words[k] ? "word" : "");
  const head = columns.map((one, k) =>
    element("th", { class: kind(k), scope: "col" }, one.name, ...(one.unit ? [element("small", {}, one.unit)] : [])));
  const cell = (value, k) => (value === null ? "–" : typeof value === "number" ? value.toFixed(columns[k].digits) : String(value));
  const body = rows.map((row) =>
    element("tr", {}, ...row.map((value, k) => element("td", { class: kind(k) }, cell(value, k)))));
  return element("div", { class: "wide" }, element("table", {}, element("caption", {}, title),
    element("thead", {}, element("tr", {}, ...head)), element("tbody", {}, ...body)));
}

export function drawPanel(place, panel, state, send) {
  const told = JSON.stringify(panel ?? {});
  if (place.dataset.told === told) return;
  place.dataset.told = told;
  const parts = [];
  if (panel?.coverage) parts.push(coverage(panel.coverage));
  if (panel?.meters) parts.push(meters(panel.meters));
  if (panel?.files?.length) parts.push(saves(panel.files));
  place.replaceChildren(...parts);
}

// Where on the image board corners have been seen; the outline is where the next board should be.
function coverage({ size, cells, views, next }) {
  const [width, height] = size;
  const rows = cells.length;
  const columns = cells[0].length;
  const most = Math.max(1, ...cells.flat());
  const boxes = cells.flatMap((row, r) => row.map((count, c) => shape("rect", {
    x: (c * width) / columns, y: (r * height) / rows, width: width / columns, height: height / rows,
    fill: "var(--good)", "fill-opacity": count ? 0.15 + (0.55 * count) / most : 0,
    stroke: "var(--line)", "stroke-width": width / 640,
  })));
  const outline = (points, style) => shape("polygon", { points: points.map((p) => p.join(",")).join(" "), fill: "none", ...style });
  const seen = views.map((points) => outline(points, { stroke: "var(--soft)", "stroke-width": width / 480, "stroke-opacity": 0.7 }));
  const wanted = next ? [outline(next, { stroke: "var(--accent)", "stroke-width": width / 160, "stroke-dasharray": `${width / 50} ${width / 80}` })] : [];
  return element("div", { class: "coverage" }, element("h2", {}, next ? "Corners so far, and where to hold the board next" : "Corners so far"),
    shape("svg", { viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": "Coverage of the image by board corners" }, ...boxes, ...seen, ...wanted));
}

function meters(list) {
  return element("div", { class: "meters" }, ...list.map(({ name, share, text }) =>
    element("div", { class: "meter" }, element("span", { class: "soft" }, name),
      element("i", {}, shape("svg", { viewBox: "0 0 100 10", preserveAspectRatio: "none" },
        shape("rect", { width: 100 * Math.min(1, share), height: 10, fill: share >= 1 ? "var(--good)" : "var(--warn)" }))),
      element("b", {}, text))));
}

function saves(list) {
  return element("div", { class: "files" }, ...list.map((name) =>
    element("a", { class: "button", href: `/files/${name}`, download: name }, name)));
}
