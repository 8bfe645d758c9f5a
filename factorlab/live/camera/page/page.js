// The page of a live camera: a picture, the state behind it, and buttons that send commands.

import { element, fill } from "/elements.js";
import { drawPanel, quantity, table } from "/panels.js";
import { Traces } from "/charts.js";
import { order } from "/orders.js";
import { watchTheme } from "/theme.js";

const at = (id) => document.getElementById(id);
const traces = new Traces(at("traces"));
let state = null;
let marks = true;
let over = false;

async function send(wish) {
  try {
    const told = await order(wish);
    show(told.state);
    if (told.fault) {
      at("message").textContent = told.fault;
      at("message").hidden = false;
    }
  } catch {
    leave();
  }
}

function leave() {
  over = true;
  at("fault").textContent = "factorlab live has ended. Start it again: this page comes back by itself.";
  at("fault").hidden = false;
  for (const button of document.querySelectorAll("button:not(#theme)")) button.disabled = true;
}

// The browser asks again and again after the server is gone; its first answer is a new session.
function hear(event) {
  if (over) location.reload();
  else show(JSON.parse(event.data));
}

function show(next) {
  const before = state;
  state = next;
  const reading = next.reading ?? { headline: "", state: "idle", numbers: [], tables: [], notes: [], traces: {}, panel: {} };
  showSource(next);
  showTasks(next);
  showButtons(next);
  showRates(next);
  at("headline").textContent = reading.headline || (next.frame ? "…" : "waiting for frames");
  at("headline").className = `headline ${reading.state}`;
  at("message").textContent = next.message;
  at("message").hidden = !next.message;
  fill(at("notes"), reading.notes, (note) => element("li", {}, note));
  fill(at("numbers"), reading.numbers, (one) =>
    element("div", {}, element("dt", {}, one.name), element("dd", {}, ...quantity(one))));
  drawPanel(at("panel"), reading.panel, next, send);
  fill(at("tables"), reading.tables, table);
  if (before && (before.task !== next.task || next.frame?.index < before.frame?.index)) traces.clear();
  if (next.frame) traces.add(next.frame.t_s, reading.traces);
  document.body.dataset.task = next.task;
  document.body.dataset.frame = next.frame?.index ?? -1;
}

function showSource(next) {
  const { name, size, live, left_out } = next.source;
  const called = live && /^\d+$/.test(name) ? `camera ${name}` : name;
  at("source").textContent = `${called} · ${size[0]}×${size[1]}` + (left_out.length ? ` · ${left_out.length} left out` : "");
  at("source").title = [called, ...left_out].join("\n");
  at("fault").textContent = next.fault;
  at("fault").hidden = !next.fault;
  at("waiting").hidden = Boolean(next.frame);
  at("picture").width = size[0];
  at("picture").height = size[1];
}

function showTasks(next) {
  fill(at("tasks"), next.tasks, (one, index) => {
    const button = element("button", { type: "button", role: "tab", title: String(index + 1) }, one.title);
    button.addEventListener("click", () => send({ do: "task", name: one.name }));
    return button;
  });
  [...at("tasks").children].forEach((button, k) =>
    button.setAttribute("aria-selected", String(next.tasks[k].name === next.task)));
}

function showButtons(next) {
  at("pause").textContent = next.ended ? (next.source.live ? "Reconnect" : "Play again") : next.paused ? "Resume" : "Pause";
  at("record").textContent = next.recording ? "Stop recording" : "Record";
  at("record").setAttribute("aria-pressed", String(Boolean(next.recording)));
  at("record").disabled = over || (next.ended && !next.recording);
  marks = next.overlay;
  at("marks").setAttribute("aria-pressed", String(marks));
  const last = next.recorded.at(-1);
  at("recording").textContent = next.recording
    ? `${next.recording.seconds.toFixed(1)} s to ${next.recording.folder}`
    : last ? `${last.frames} frames, ${last.duration_s.toFixed(1)} s in ${last.folder}`
      + (last.lost ? `; ${last.lost} lost, the disk is too slow` : "") : "";
  const badge = next.recording ? "● REC" : next.ended ? (next.fault ? "broken off" : "ended") : next.paused ? "paused" : "";
  at("badge").textContent = badge;
  at("badge").className = next.recording ? "badge rec" : "badge";
  at("badge").hidden = !badge;
  fill(at("actions"), next.actions, (one, index) => {
    const button = element("button", { type: "button", class: index === 0 && next.task === "calibrate" ? "primary" : "" }, one.title);
    button.addEventListener("click", () => send({ do: "act", name: one.name }));
    return button;
  });
}

function showRates(next) {
  const { fps, latency_ms, latency_high_ms, work_ms, skipped } = next.rates;
  fill(at("fps"), [fps ? fps.toFixed(fps < 10 ? 1 : 0) : "–"], String);
  const slowest = latency_high_ms === null ? "" : ` < ${latency_high_ms.toFixed(0)} ms in 95 %`;
  fill(at("latency"), [latency_ms === null ? "–" : `${latency_ms.toFixed(0)} ms`], String);
  at("latency").title = `from a frame's arrival to its picture with marks${slowest}`;
  fill(at("work"), [work_ms === null ? "–" : `${work_ms.toFixed(1)} ms`], String);
  fill(at("skipped"), [String(skipped)], String);
  at("skipped").title = "frames left out because the one before was still being worked on";
  fill(at("time"), [next.frame ? `${next.frame.t_s.toFixed(1)} s` : "–"], String);
}

function toggle(id) {
  if (over || !state) return;
  if (id === "pause") send({ do: state.ended ? "again" : state.paused ? "resume" : "pause" });
  if (id === "record") send({ do: state.recording ? "stop" : "record" });
  if (id === "marks") send({ do: "overlay", on: !marks });
}

for (const id of ["pause", "record", "marks"]) at(id).addEventListener("click", () => toggle(id));
document.addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.altKey || event.metaKey || event.target.closest("button, a, input")) return;
  const key = event.key.toLowerCase();
  const id = { " ": "pause", r: "record", m: "marks" }[key];
  if (id) { event.preventDefault(); toggle(id); }
  if (key === "s") at("snapshot").click();
  const task = state?.tasks[Number(key) - 1];
  if (task) send({ do: "task", name: task.name });
});

watchTheme(at("theme"));

addEventListener("load", () => {
  at("picture").src = "/stream.mjpg"; // after the page is complete: a stream never is
  const events = new EventSource("/events");
  events.addEventListener("message", hear);
  events.addEventListener("over", leave);
  events.addEventListener("error", leave);
});
