import { h, sentence, when } from "turnlight/dom.js";
import { ask, attempt } from "turnlight/service.js";
import { run, watch } from "turnlight/run.js";

const NAMES = { rig: "Rig", camera: "Camera", light: "Light", disk: "Disk", model: "Model" };
const AGAIN_MS = 3000;

/** Five lights; each red one says cause and fix. */
export function screen({ onLeave }) {
  const list = h("ul", { class: "card lights" });
  const summary = h("p", { class: "lead", role: "status" }, "Looking…");
  const next = h("a", { class: "button primary", href: "#/sample" }, "Next: the sample");
  const again = h("button", { onclick: () => look("POST") }, "Look again");
  const measured = h("p", {});
  const calibration = h("li", { class: "aside" }, h("span", { class: "bulb none", "aria-hidden": "true" }),
    h("div", {}, h("h2", {}, "Calibration"), measured), h("a", { class: "button", href: "#/calibrate" }, "Calibrate"));
  let timer;
  const draw = ({ ok, looked, lights }) => {
    summary.textContent = !looked ? "Looking at everything…"
      : ok ? "Everything is ready." : "Something needs a hand.";
    const shown = looked ? lights : Object.keys(NAMES).map((name) => ({ name, ok: null, text: "…" }));
    list.replaceChildren(...shown.map(({ name, ok: good, text }) =>
      h("li", { class: good === null ? "wait" : good ? "ok" : "bad" },
        h("span", { class: "bulb", role: "img", "aria-label": good === null ? "looking" : good ? "ready" : "not ready" }),
        h("div", {}, h("h2", {}, NAMES[name] ?? name), h("p", {}, sentence(text))))), calibration);
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
  const tell = () => { measured.textContent = calibrated(run.calibration); };
  onLeave(watch(tell));
  tell();
  return h("div", { class: "page" }, h("h1", {}, "Ready"), summary, list,
    h("div", { class: "row end" }, again, next));
}

function calibrated(now) {
  const dates = (now?.steps ?? []).map(({ measured }) => measured).filter(Boolean).sort();
  if (!now) return "…";
  if (!dates.length) return "Nothing has been measured: the rig is taken to be as its file says.";
  const left = now.steps.length - dates.length;
  return `Measured ${when(dates[0])}${left ? `; ${left} of ${now.steps.length} steps are still to be done` : ""}.`;
}
