// Elements without markup in strings: text stays text, whoever wrote it.

const SVG = "http://www.w3.org/2000/svg";

/** h("button", { class: "big", onclick }, "Go") */
export function h(name, attributes = {}, ...children) {
  return fill(document.createElement(name), attributes, children);
}

export function s(name, attributes = {}, ...children) {
  return fill(document.createElementNS(SVG, name), attributes, children);
}

function fill(element, attributes, children) {
  for (const [key, value] of Object.entries(attributes)) {
    if (value === undefined || value === null || value === false) continue;
    if (key.startsWith("on")) element.addEventListener(key.slice(2), value);
    else if (key === "value" || key === "checked") element[key] = value;
    else element.setAttribute(key, value === true ? "" : value);
  }
  element.append(...children.flat(3).filter((child) => child !== null && child !== undefined && child !== false));
  return element;
}

let toastTimer;
/** A sentence at the lower edge; action: { label, run }. */
export function toast(text, action) {
  const line = h("div", { class: "toast" }, h("span", {}, text),
    action && h("button", { onclick: () => { line.remove(); action.run(); } }, action.label));
  document.getElementById("toasts").replaceChildren(line);
  clearTimeout(toastTimer);
  toastTimer = setTimeout(() => line.remove(), action ? 30000 : 6000);
}

export const percent = (share, digits = 1) => `${(100 * share).toFixed(digits)}\u00a0%`;

export function duration(seconds) {
  const rounded = Math.max(0, Math.round(seconds));
  return rounded < 90 ? `${rounded} s` : `${Math.round(rounded / 60)} min`;
}

const MOMENT = new Intl.DateTimeFormat(undefined, { dateStyle: "medium", timeStyle: "short" }); // slow to make

export function when(text) {
  return MOMENT.format(new Date(text));
}

/** With a capital and a full stop, as what a person reads has them. */
export function sentence(text) {
  return text && text.charAt(0).toUpperCase() + text.slice(1) + (/[.…]$/.test(text) ? "" : ".");
}
