import { h, sentence, when } from "turnlight/dom.js";
import { ask, attempt } from "turnlight/service.js";
import { active, run, watch } from "turnlight/run.js";

const STEPS = {
  dark: ["Dark", "Dark level, noise, and the room's light"],
  geometry: ["Camera and table", "Lens, camera, the table's axis and markers"],
  lights: ["Where the LEDs are", "The place of each LED, seen in a glossy ball"],
  white: ["How bright they are", "Power, lobe and colour of each LED"],
  colour: ["Colour", "From the camera's colours to sRGB"],
};
const AT_HAND = {
  square_mm: ["Board's squares, mm", 1, 100], ball_mm: ["Ball's diameter, mm", 5, 200],
  white_reflectance: ["White board reflects, 0.5 to 1", 0.5, 1], thickness_mm: ["Board and chart, mm thick", 0, 50],
};
const SHEETS = { board: "Board", ball: "Ball's place", platter: "Platter" };

/** A step at a time: what to lay on the table, a live picture, and a verdict with its figures. */
export function screen({ onLeave }) {
  const list = h("ol", { class: "steps" });
  const image = h("img", { class: "live", alt: "What the camera sees", width: 480, height: 360 });
  const caption = h("figcaption", {});
  const view = h("figure", { class: "card view", hidden: true }, image, caption);
  const form = h("form", { class: "form", onsubmit: (event) => event.preventDefault() });
  let shown = null; // the state that was drawn last
  let picture = 0;
  let loading = false;
  image.addEventListener("load", () => { loading = false; view.hidden = false; look(); });
  image.addEventListener("error", () => { loading = false; });
  onLeave(watch(draw));
  if (run.calibration) draw();
  else attempt(async () => { run.calibration ??= await ask("GET", "/calibration"); draw(); });
  return h("div", { class: "page wide" }, h("h1", {}, "Calibrate"),
    h("p", { class: "lead" }, "Do the steps from top to bottom: lay out what each asks for, then measure. What passes is used from then on."),
    h("div", { class: "bench" }, list,
      h("div", { class: "side" },
        view,
        h("section", { class: "card" }, h("h2", {}, "Targets at hand"), form,
          h("p", { class: "hint" }, "To print, at 100 %: ", Object.entries(SHEETS).map(([name, label], i) =>
            [i > 0 && ", ", h("a", { href: `/api/calibration/targets/${name}.pdf`, download: `turnlight-${name}.pdf` }, label)]))))));

  function draw() {
    const now = run.calibration;
    if (!now || (now === shown && active() === list.isBusy)) return;
    if (!form.childElementCount) form.append(...fields(now.at_hand));
    const key = ({ state, text, measured }) => [state, text, measured, now.running, active()].join();
    now.steps.forEach((step, i) => {
      const old = list.children[i];
      if (old?.dataset.key === key(step)) return progress(old, step);
      const item = card(step, i, now);
      item.dataset.key = key(step);
      if (old) old.replaceWith(item);
      else list.append(item);
    });
    shown = now;
    list.isBusy = active();
    look();
  }

  function card(step, i, now) {
    const [title, what] = STEPS[step.name];
    const next = now.steps.find(({ state }) => state !== "passed")?.name ?? null;
    const measuring = step.state === "measuring";
    const item = h("li", { class: `card step ${step.state}`, "aria-current": measuring ? "step" : undefined },
      h("span", { class: "verdict", role: "img", "aria-label": { open: "not measured", measuring: "being measured" }[step.state] ?? step.state }, 
        { passed: "✓", failed: "!" }[step.state] ?? String(i + 1)),
      h("div", { class: "what" }, h("h2", {}, title), h("p", { class: "hint" }, what),
        step.state === "open" || step.state === "failed" ? h("p", {}, step.instruction) : null,
        measuring && [h("p", { role: "status" }), h("progress", { "aria-label": `Frames of ${title}`, max: 1 })],
        h("p", { class: step.state === "failed" ? "problem" : "said", role: step.state === "failed" ? "alert" : undefined }, sentence(step.text)),
        step.limits.length > 0 && h("details", { open: step.state === "failed" }, h("summary", {}, "Figures"), figures(step.limits)),
        step.measured && h("p", { class: "hint" }, `${step.state === "passed" ? "Measured" : "Still in use: what was measured"} ${when(step.measured)}`)),
      !measuring && h("button", { class: step.name === next ? "primary" : "", disabled: now.running !== null || active(),
        "aria-label": `${verb(step)}: ${title}`, onclick: (event) => start(step.name, event.currentTarget) }, verb(step)));
    progress(item, step);
    return item;
  }

  function progress(item, { number, count }) {
    const bar = item.querySelector("[role=status] + progress");
    if (!bar) return;
    bar.previousElementSibling.textContent = count ? `Frame ${number} of ${count}` : "Homing the table…";
    if (count) bar.value = number / count;
  }

  async function start(name, button) {
    if (!form.reportValidity()) return;
    button.disabled = true;
    const at_hand = Object.fromEntries([...new FormData(form)].map(([key, value]) => [key, Number(value)]));
    if (!(await attempt(() => ask("POST", `/calibration/${name}`, at_hand)))) button.disabled = false;
  }

  /** The latest picture, one at a time. */
  function look() {
    const now = run.calibration;
    const step = now.steps.find(({ name }) => name === now.running);
    if (step) caption.textContent = `${STEPS[step.name][0]}, as the camera sees it`;
    if (loading || now.picture === 0 || now.picture === picture) return;
    loading = true;
    picture = now.picture;
    image.src = `/api/calibration/picture.jpg?n=${picture}-${Date.now()}`;
  }
}

function figures(limits) {
  return h("table", { class: "limits" }, h("tbody", {}, limits.map(({ name, value, limit, unit, passed }) =>
    h("tr", { class: passed ? "ok" : "bad" }, h("th", { scope: "row" }, name),
      h("td", {}, h("b", {}, amount(value, unit), passed ? "" : h("span", { role: "img", "aria-label": "too much" }, " !"))),
      h("td", {}, h("progress", { max: 1, value: Math.min(value / limit, 1), "aria-label": `${name}, of what is allowed` })), h("td", {}, `≤ ${amount(limit, unit)}`)))));
}

function amount(value, unit) {
  if (unit.startsWith("of ")) return `${Number((100 * value).toPrecision(2))} %`;
  return `${Number(value.toPrecision(2))}${unit === "°" || !unit ? unit : ` ${unit}`}`;
}

function fields(at_hand) {
  return Object.entries(AT_HAND).map(([name, [label, min, max]]) => h("div", { class: "field" },
    h("label", { for: name }, label),
    h("input", { id: name, name, type: "number", inputmode: "decimal", step: "any", min, max, required: true, value: at_hand[name] })));
}

function verb({ state }) {
  return { open: "Measure", failed: "Try again" }[state] ?? "Measure again";
}
