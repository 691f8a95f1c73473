import { h } from "turnlight/dom.js";
import { ask, attempt } from "turnlight/service.js";

const NAMES = { rig: "Rig", camera: "Camera", light: "Light", disk: "Disk", model: "Model" };
const AGAIN_MS = 3000;

/** Five lights; each red one says cause and fix. */
export function ready({ onLeave }) {
  const list = h("ul", { class: "lights" });
  const summary = h("p", { class: "lead", role: "status" }, "Looking…");
  const next = h("a", { class: "button primary", href: "#/sample" }, "Next: the sample");
  const again = h("button", { onclick: () => look("POST") }, "Look again");
  let timer;
  const draw = ({ ok, looked, lights }) => {
    summary.textContent = !looked ? "Looking at everything…"
      : ok ? "Everything is ready." : "Something needs a hand.";
    const shown = looked ? lights : Object.keys(NAMES).map((name) => ({ name, ok: null, text: "…" }));
    list.replaceChildren(...shown.map(({ name, ok: good, text }) =>
      h("li", { class: good === null ? "wait" : good ? "ok" : "bad" },
        h("span", { class: "bulb", role: "img", "aria-label": good === null ? "looking" : good ? "ready" : "not ready" }),
        h("div", {}, h("h2", {}, NAMES[name] ?? name), h("p", {}, sentence(text))))));
    clearTimeout(timer);
    if (!looked) timer = setTimeout(() => look("GET"), 500);
    else if (!ok) timer = setTimeout(() => look("POST"), AGAIN_MS);
  };
  const look = async (method) => {
    again.disabled = true;
    if (!(await attempt(async () => draw(await ask(method, "/ready"))))) timer = setTimeout(() => look("GET"), AGAIN_MS);
    again.disabled = false;
  };
  look("GET");
  onLeave(() => clearTimeout(timer));
  return h("div", { class: "page" }, h("h1", {}, "Ready"), summary, list, h("div", { class: "row end" }, again, next));
}

function sentence(text) {
  return text.charAt(0).toUpperCase() + text.slice(1) + (/[.…]$/.test(text) ? "" : ".");
}
