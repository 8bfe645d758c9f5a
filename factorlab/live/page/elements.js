// Elements made from data, for every page.

const SVG = "http://www.w3.org/2000/svg";

export function element(name, attributes, ...children) {
  return made(document.createElement(name), attributes, children);
}

export function shape(name, attributes, ...children) {
  return made(document.createElementNS(SVG, name), attributes, children);
}

function made(node, attributes, children) {
  for (const [key, value] of Object.entries(attributes)) if (value !== "") node.setAttribute(key, value);
  node.append(...children);
  return node;
}

// Fill a place from a list, and leave it alone while the list stays the same: what is selected stays so.
export function fill(place, list, make) {
  const told = JSON.stringify(list);
  if (place.dataset.told === told) return;
  place.dataset.told = told;
  place.replaceChildren(...list.map(make));
}
