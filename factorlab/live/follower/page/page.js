// The page of the line follower: what the robot does, and sliders that change it while it drives.

import { element, fill } from "/elements.js";
import { bound, Controls, french } from "/controls.js";
import { GroundMap } from "/map.js";
import { Strip } from "/strips.js";
import { order } from "/orders.js";
import { watchTheme } from "/theme.js";

const MOST = 8000; // steps of the way that are drawn
const at = (id) => document.getElementById(id);
const map = new GroundMap(at("map"));
const strips = [
  new Strip(at("strips"), "Écart latéral à la ligne, cm (15 dernières secondes ; bande verte : ± 2 cm)",
    { column: 7, scale: 100, digits: 1, unit: "cm", colour: "truth", least: 3, band: 2 }),
  new Strip(at("strips"), "Commande du PID : vitesse angulaire, rad/s",
    { column: 8, scale: 1, digits: 2, unit: "rad/s", colour: "guess", least: 1 }),
];
let setup = null;
let controls = null;
let state = null;
let way = [];
let ghost = [];
let wayOf = 0; // number of the drive that `way` is of
let told = 0; // how many of its steps came
let drawing = false;
let lineOf = 0; // number of the line that the map has
let over = false;

async function send(wish) {
  if (over) return;
  try {
    const told = await order(wish);
    say(told.fault);
    show(told.state);
  } catch {
    leave();
  }
}

function say(text) {
  at("message").textContent = text;
  at("message").hidden = !text;
}

function leave() {
  over = true;
  at("fault").textContent = "Le programme est terminé. Relancez « factorlab l19 suiveur » : cette page revient d'elle-même.";
  at("fault").hidden = false;
  for (const one of document.querySelectorAll("main button, main input, select")) one.disabled = true;
}

// The browser asks again and again after the server is gone; its first answer is a new session.
function hear(event) {
  if (over) {
    location.reload();
    return;
  }
  const next = JSON.parse(event.data);
  const { number, begin, rows } = next.way;
  if (number !== wayOf || begin < told) {
    if (number !== wayOf) ghost = way;
    [way, wayOf, told] = [[], number, begin];
  }
  way.push(...rows);
  told += rows.length;
  if (way.length > MOST) way.splice(0, way.length - MOST);
  show(next);
}

// Drawn when the screen is: a page that nobody looks at costs nothing.
function draw() {
  if (drawing) return;
  drawing = true;
  requestAnimationFrame(() => {
    drawing = false;
    map.draw(way, ghost, state.step);
    for (const strip of strips) strip.draw(way);
    drawCamera(state.step);
  });
}

async function show(next) {
  state = next;
  if (next.line !== lineOf) {
    lineOf = next.line;
    ghost = [];
    map.line = (await (await fetch("/line.json")).json()).points;
  }
  const { step, journey } = next;
  controls.show(next.settings);
  showChoices(next);
  showHeadline(next);
  draw();
  const cm = (value, digits = 1) => (value === null || value === undefined ? "–" : `${french(100 * value, digits)} cm`);
  write("time", step ? `${french(step.t_s, 1)} s` : "–");
  write("offset", cm(step?.offset_m));
  write("rms", cm(journey.rms_m, 2));
  write("error", step ? cm(Math.hypot(step.pose[0] - step.estimate[0], step.pose[1] - step.estimate[1])) : "–");
  write("confidence", step ? `${french(100 * step.confidence, 0)} %` : "–");
  showAttempts(next);
  document.body.dataset.steps = journey.steps;
  document.body.dataset.journey = journey.number;
  document.body.dataset.lost = String(Boolean(step?.lost));
}

function write(id, words) {
  const text = bound(words);
  if (at(id).textContent !== text) at(id).textContent = text;
}

function showChoices({ settings, pace, paused }) {
  for (const [id, value] of [["curve", settings.curve], ["detector", settings.detector], ["pace", String(pace)], ["seed", String(settings.seed)]])
    if (document.activeElement !== at(id) && at(id).value !== value) at(id).value = value;
  if (state.own && !at("detector").disabled) {
    at("detector").replaceChildren(element("option", { value: settings.detector }, `le vôtre : ${state.own}`));
    at("detector").disabled = true;
  }
  write("pause", paused ? "Reprendre" : "Pause");
  at("pause").disabled = over || state.ended;
  at("restart").className = state.ended ? "primary" : "";
}

// What the robot does, in words; where it has lost the line, what may be done about it.
function showHeadline({ journey, step, paused, ended, fault }) {
  let [text, kind, advice] = ["Le robot suit la ligne", "good", ""];
  if (fault) [text, kind] = [fault, "bad"];
  else if (step?.lost) {
    [text, kind] = [`Ligne perdue à ${french(journey.lost_s, 1)} s`, "bad"];
    advice = advise(state.settings);
  } else if (journey.arrived) [text, kind] = [`Arrivé : ${journey.steps} pas, écart RMS ${french(100 * journey.rms_m, 2)} cm`, "good"];
  else if (ended) [text, kind] = ["Terminé", "idle"];
  else if (paused) [text, kind] = ["En pause", "idle"];
  else if (!step) [text, kind] = ["Préparation …", "idle"];
  else if (step.unseen_s > 0.3) [text, kind] = ["La caméra ne voit plus la ligne : le robot roule d'après l'EKF et sa carte", "warn"];
  else if (Math.abs(step.offset_m) > 0.04) [text, kind] = ["Le robot s'écarte de la ligne", "warn"];
  else if (journey.lost_s !== null) text = `Le robot a retrouvé la ligne, perdue à ${french(journey.lost_s, 1)} s`;
  write("headline", text);
  at("headline").className = `headline ${kind}`;
  write("advice", advice);
  at("advice").hidden = !advice;
  const badge = step?.lost ? "ligne perdue" : paused ? "en pause" : "";
  write("badge", badge);
  at("badge").hidden = !badge;
}

function advise(settings) {
  const { noise, blur_s: blur, speed_m_s: speed, kp, bridging_s: blind, detector } = settings;
  const tries = [];
  const limit = { threshold: 25, bands: blind > 0.3 ? 110 : 90, find_line: 140 }[detector]; // grey levels, about
  if (state.own) tries.push(`regardez ce que ${state.own} répond sur cette image`);
  else if (noise >= limit) tries.push("baissez le bruit de l'image");
  if (!state.own && detector === "threshold" && noise > 0) tries.push("choisissez le filtre adapté");
  if (blur > 0.3) tries.push("baissez le flou");
  if (kp < 22 * speed) tries.push("montez Kp : à cette vitesse, le robot ne tourne pas assez");
  if (speed > 0.5) tries.push("ralentissez");
  if (blind < 0.3) tries.push("laissez-lui le temps de rouler sans voir");
  if (!tries.length) tries.push("revenez aux réglages d'origine, puis ne changez qu'une chose à la fois");
  return `Le robot s'est arrêté. Essayez : ${tries.join(" ; ")}. S'il revoit la ligne, il repart ; sinon, « Recommencer » (R).`;
}

function drawCamera(step) {
  const canvas = at("camera");
  if (!step) return;
  const [width, height] = step.size;
  const times = 10; // marks between the pixels
  if (canvas.width !== width * times) [canvas.width, canvas.height] = [width * times, height * times];
  const grey = Uint8Array.from(atob(step.image), (one) => one.charCodeAt(0));
  const image = new ImageData(width, height);
  grey.forEach((value, k) => image.data.set([value, value, value, 255], 4 * k));
  const small = new OffscreenCanvas(width, height);
  small.getContext("2d").putImageData(image, 0, 0);
  const pen = canvas.getContext("2d");
  pen.imageSmoothingEnabled = false;
  pen.drawImage(small, 0, 0, width * times, height * times);
  const style = getComputedStyle(document.documentElement);
  for (const [name, column, row] of [["bottom", step.bottom_px, step.rows[0]], ["middle", step.middle_px, step.rows[1]]]) {
    if (column === null || !step.found) continue;
    pen.beginPath();
    pen.arc((column + 0.5) * times, (row + 0.5) * times, 1.2 * times, 0, 2 * Math.PI);
    pen.fillStyle = style.getPropertyValue(`--${name}`);
    pen.fill();
    pen.lineWidth = 3;
    pen.strokeStyle = "#fff";
    pen.stroke();
  }
}

// A line a drive: what was changed against the one before, and what came of it.
function showAttempts({ before, journey }) {
  const all = [...before, journey].filter((one) => one.steps);
  const lines = all.map((one, k) => [
    one.number,
    k ? controls.apart(all[k - 1].settings, one.settings).join(", ") || "comme avant" : "au début",
    one.changes,
    one.rms_m,
    one.lost_s,
    one.t_s,
  ]).slice(-6);
  const head = element("thead", {}, element("tr", {}, ...["essai", "changé", "RMS", "tenu"].map((one) =>
    element("th", { scope: "col", class: one === "changé" ? "word" : "" }, one))));
  fill(at("attempts"), lines.length ? [lines] : [], (rows) => element("table", {}, element("caption", {}, "Les essais"), head,
    element("tbody", {}, ...rows.map(([number, what, changes, rms, lost, t]) => element("tr", {},
      element("td", {}, String(number)),
      element("td", { class: "what" }, what + (changes ? " ; changé en route" : "")),
      element("td", {}, `${french(100 * rms, 1)} cm`),
      element("td", { class: lost === null ? "" : "worse" }, lost === null ? `${french(t, 0)} s` : `perdu à ${french(lost, 0)} s`))))));
}

function press(id) {
  if (over || !state) return;
  if (id === "pause" && !state.ended) send({ do: state.paused ? "resume" : "pause" });
  if (id === "restart") send({ do: "restart" });
  if (id === "reseed") send({ do: "set", settings: { seed: state.settings.seed + 1 } });
  if (id === "defaults") {
    const { curve, seed, ...rest } = setup.defaults;
    send({ do: "set", settings: rest });
  }
  if (id === "zoom") {
    map.close = !map.close;
    at("zoom").setAttribute("aria-pressed", String(map.close));
    draw();
  }
}

function listen() {
  for (const id of ["pause", "restart", "reseed", "defaults", "zoom"]) at(id).addEventListener("click", () => press(id));
  at("curve").addEventListener("change", () => send({ do: "set", settings: { curve: at("curve").value } }));
  at("detector").addEventListener("change", () => send({ do: "set", settings: { detector: at("detector").value } }));
  at("pace").addEventListener("change", () => send({ do: "pace", pace: Number(at("pace").value) }));
  at("seed").addEventListener("change", () => send({ do: "set", settings: { seed: Number(at("seed").value) } }));
  at("controls").addEventListener("submit", (event) => event.preventDefault());
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey || event.target.closest("button, a, select, summary, input[type=number]")) return;
    const id = { " ": "pause", r: "restart", g: "reseed", z: "zoom" }[event.key.toLowerCase()];
    if (id) {
      event.preventDefault();
      press(id);
    }
  });
  addEventListener("resize", () => {
    if (state) draw();
  });
}

watchTheme(at("theme"));

addEventListener("load", async () => {
  setup = await (await fetch("/setup.json")).json();
  controls = new Controls(at("controls"), setup.controls, (settings) => send({ do: "set", settings }));
  at("curve").replaceChildren(...Object.entries(setup.curves).map(([name, title]) => element("option", { value: name }, `${name} : ${title}`)));
  at("detector").replaceChildren(...Object.entries(setup.detectors).map(([name, title]) => element("option", { value: name }, title)));
  at("pace").replaceChildren(...setup.paces.map((pace) => element("option", { value: String(pace) }, `× ${String(pace).replace(".", ",")}`)));
  listen();
  const events = new EventSource("/events");
  events.addEventListener("message", hear);
  events.addEventListener("over", leave);
  events.addEventListener("error", leave);
});
