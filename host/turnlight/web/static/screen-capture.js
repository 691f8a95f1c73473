import { duration, h, percent, s } from "turnlight/dom.js";
import { ask, attempt } from "turnlight/service.js";
import { active, run, watch } from "turnlight/run.js";
import { diagram, legend } from "turnlight/diagram.js";
import { relit } from "turnlight/relit.js";
import { FLATS, flat } from "turnlight/flats.js";
import { chips } from "turnlight/chips.js";

/** One big button; then the table, the LEDs and the maps as they become better. */
export function screen({ onLeave }) {
  const page = h("div", { class: "page wide" });
  let view = null;
  onLeave(watch(update));
  update({ kind: "shown" });
  return page;

  function update(event) {
    const wanted = active() ? "running" : "ready";
    if (view?.kind !== wanted || event.kind === "started") {
      view = wanted === "ready" ? before() : during();
      page.replaceChildren(...view.parts);
    }
    view.update?.(event);
  }
}

function before() {
  const title = h("h1", {}, "Capture");
  const said = h("p", { class: "lead" }, "…");
  const button = h("button", { class: "go", onclick: go }, h("span", {}, "Capture"));
  attempt(async () => {
    const [sample, plan] = await Promise.all([ask("GET", "/sample"), ask("GET", "/plan")]);
    title.textContent = sample.name;
    said.textContent = `${plan.shots.length} shots, preset ${sample.preset}`;
  });
  return { kind: "ready", parts: [h("div", { class: "centred start" }, title, said, button,
    h("p", { class: "hint" }, "Or press the button on the rig. Hold that one to stop."),
    h("a", { href: "#/sample" }, "Change the sample"))] };

  async function go() {
    button.disabled = true;
    if (!(await attempt(() => ask("POST", "/run")))) button.disabled = false;
  }
}

function during() {
  const cause = h("div", { class: "halted", role: "alert", hidden: true });
  const doing = h("p", { class: "doing", role: "status" });
  const bar = h("progress", { max: 1, value: 0, "aria-label": "Shots done" });
  const left = h("span", {});
  const change = h("div", { class: "change" });
  const table = h("div", { class: "card centred" });
  const material = relit();
  const maps = FLATS.map((name) => h("figure", {}, h("canvas", { role: "img", "aria-label": `${name} map`, width: 1, height: 1 }), h("figcaption", {}, name)));
  const quality = h("div", { class: "chips", role: "list", "aria-label": "Shots" });
  let session = null;
  let drawing;
  let version = -1;
  let loading = false;
  let wanted = false;
  ask("GET", "/rig").then((rig) => {
    drawing = diagram(rig);
    table.replaceChildren(drawing.picture, legend({ planned: "to come", lit: "now", done: "done" }));
    draw();
  }, () => {});
  refresh();
  const parts = [
    h("h1", {}, run.sample || "Capture"), cause,
    h("div", { class: "progress" }, doing, left), bar,
    h("div", { class: "stagegrid" },
      h("div", { class: "card material" }, material.element),
      h("div", { class: "card maps" }, maps),
      h("div", { class: "side" }, table,
        h("div", { class: "card" }, h("h2", {}, "How much the maps still change"), change, h("h2", {}, "Shots"), quality))),
  ];
  return { kind: "running", parts, update };

  function update(event) {
    draw();
    if (["started", "shot", "rebuilt", "skipped", "snapshot", "finished", "shown"].includes(event.kind)) refresh();
  }

  function draw() {
    const done = run.shots.size;
    doing.textContent = {
      homing: "Homing, and finding the exposures…", running: `Shot ${Math.min(done + 1, run.count)} of ${run.count}`,
      pausing: "Pausing after this shot…", paused: "Paused", interrupted: `Interrupted at ${done} of ${run.count}`,
      finishing: "Finishing…", faulted: "Failed",
    }[run.state] ?? "";
    if (run.enough && run.state === "running") doing.textContent += " – the maps hardly change any more: you may stop";
    left.textContent = run.secondsLeft && run.state === "running" ? `${duration(run.secondsLeft)} left` : "";
    bar.value = run.count ? done / run.count : 0;
    change.replaceChildren(spark(run.changes), h("p", {}, run.changes.length
      ? `The last picture changed them by ${percent(run.changes.at(-1))}.` : "From the second picture on."));
    const broken = ["interrupted", "faulted"].includes(run.state);
    cause.hidden = !broken;
    if (broken) {
      cause.replaceChildren(h("h2", {}, run.state === "interrupted" ? "Interrupted" : "Failed"), h("p", {}, run.cause ?? ""),
        h("p", {}, `${run.shots.size} shots are safe. `, run.state === "interrupted"
          ? "Resume homes the table and goes on; Finish makes do with what there is." : ""));
    }
    if (drawing && session) drawing.draw({ shots: session.shots, taken: run.shots, current: run.state === "running" ? run.current : null });
  }

  /** One request at a time; what came meanwhile is asked for afterwards. */
  async function refresh() {
    wanted = true;
    if (loading || !run.session) return;
    loading = true;
    while (wanted) {
      wanted = false;
      try {
        session = await ask("GET", `/sessions/${encodeURIComponent(run.session)}`);
        quality.replaceChildren(...chips(session, run.state === "running" || run.state === "paused"));
        draw();
        if (session.has_maps && version !== run.mapsVersion) {
          version = run.mapsVersion;
          const now = await material.load(run.session);
          FLATS.forEach((name, i) => flat(maps[i].querySelector("canvas"), now, name));
        }
      } catch { /* the next event asks again */ }
    }
    loading = false;
  }
}

function spark(changes) {
  const top = Math.max(...changes, 0.01);
  const width = 240 / Math.max(changes.length, 8);
  return s("svg", { viewBox: "0 0 240 60", class: "spark", role: "img", "aria-label": "How much each picture changed the maps", preserveAspectRatio: "none" },
    changes.map((value, i) => s("rect", { x: i * width + 1, width: width - 2, y: 60 - 58 * value / top, height: 58 * value / top, rx: 2 })));
}
