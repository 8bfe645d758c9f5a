// The sliders: made from what the program says can be changed, and sent when they are moved.

import { element } from "/elements.js";

// 1.5 as « 1,5 »; what rounds to zero has no sign
export function french(value, digits) {
  const text = value.toFixed(digits);
  return (Number(text) === 0 ? text.replace("-", "") : text).replace(".", ",").replace("-", "−");
}

// A line must not break before « : ; ? ! », nor inside guillemets.
export const bound = (text) => text.replace(/ ([:;?!»…%])/g, "\u00a0$1").replace(/« /g, "«\u00a0");

export class Controls {
  constructor(place, list, change) {
    this.inputs = new Map();
    this.change = change;
    this.waiting = {};
    this.held = new Map(); // until when a slider that was just moved is left alone, ms
    const groups = new Map();
    for (const one of list) groups.set(one.group, [...(groups.get(one.group) ?? []), one]);
    for (const [name, ones] of groups)
      place.append(element("fieldset", {}, element("legend", {}, name), ...ones.map((one) => this.slider(one))));
  }

  slider(one) {
    const input = element("input", {
      type: "range", id: one.name, min: one.low, max: one.high, step: one.step, "aria-describedby": `${one.name}-help`,
    });
    const output = element("output", { for: one.name, id: `${one.name}-value` });
    input.addEventListener("input", () => {
      this.held.set(one.name, performance.now() + 1000);
      this.write(one.name, Number(input.value));
      this.later(one.name, Number(input.value) / one.scale);
    });
    this.inputs.set(one.name, { one, input, output });
    return element("div", { class: "slider" }, element("label", { for: one.name }, one.title), output, input,
      element("span", { class: "help", id: `${one.name}-help` }, bound(one.help)));
  }

  write(name, shown) {
    const { one, input, output } = this.inputs.get(name);
    const text = french(shown, one.digits);
    if (output.dataset.text === text) return;
    output.dataset.text = text;
    output.replaceChildren(text, ...(one.unit ? [" ", element("small", {}, one.unit)] : []));
    input.setAttribute("aria-valuetext", `${text} ${one.unit}`);
  }

  // Moves come faster than answers: they are gathered for a moment.
  later(name, value) {
    if (!Object.keys(this.waiting).length) setTimeout(() => { this.change(this.waiting); this.waiting = {}; }, 60);
    this.waiting[name] = value;
  }

  show(settings) {
    const now = performance.now();
    for (const [name, { one, input }] of this.inputs) {
      if ((this.held.get(name) ?? 0) > now || name in this.waiting) continue;
      const shown = settings[name] * one.scale;
      if (Number(input.value) !== shown) input.value = shown;
      this.write(name, shown);
    }
  }

  // What differs between two settings, as the second has it: « Kp 24,0 ».
  apart(before, after) {
    const parts = [];
    for (const { one } of this.inputs.values()) {
      const [a, b] = [before[one.name] * one.scale, after[one.name] * one.scale];
      if (Math.abs(a - b) > 1e-9) parts.push(`${one.title} ${french(b, one.digits)}`);
    }
    return parts;
  }
}
