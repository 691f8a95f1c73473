import { h } from "turnlight/dom.js";
import { ask, attempt } from "turnlight/service.js";
import { diagram, legend } from "turnlight/diagram.js";

/** What would be shot, and how long it takes. */
export function screen() {
  const said = h("p", { class: "lead" }, "Planning…");
  const body = h("div", { class: "split" });
  load();
  return h("div", { class: "page" }, h("h1", {}, "Plan"), said, body);

  function load() {
    return attempt(async () => {
      const [rig, plan, sample] = await Promise.all([ask("GET", "/rig"), ask("GET", "/plan"), ask("GET", "/sample")]);
      const shots = plan.shots.map((shot) => ({ ...shot, number: shot.index + 1 }));
      const { picture, draw } = diagram(rig);
      draw({ shots, taken: new Set(), current: null });
      said.textContent = `${sample.name}: ${sample.side_mm} mm, ${sample.thickness_mm} mm thick, preset ${sample.preset}`;
      body.replaceChildren(
        h("div", { class: "card centred" }, picture, legend({ planned: "used by a shot" })),
        h("div", { class: "card" },
          h("p", { class: "figure" }, h("b", {}, String(shots.length)), " shots in about ", h("b", {}, minutes(plan.minutes))),
          h("p", {}, `The table turns ${Math.round(plan.total_turn_deg)}° in all.`),
          h("div", { class: "scroll", tabindex: 0, role: "region", "aria-label": "Shots" }, h("table", {},
            h("thead", {}, h("tr", {}, ["Shot", "Table", "LED", "Exposure"].map((name) => h("th", { scope: "col" }, name)))),
            h("tbody", {}, shots.map((shot) => h("tr", {}, h("td", {}, String(shot.number)), h("td", {}, `${shot.angle_deg}°`),
              h("td", {}, shot.leds.join(", ")), h("td", {}, `${shot.exposure_us / 1000} ms`)))))),
          h("div", { class: "row end" }, h("a", { class: "button", href: "#/sample" }, "Change"),
            h("a", { class: "button primary", href: "#/capture" }, "Next: capture"))));
    });
  }
}

function minutes(value) {
  return value < 1.5 ? `${Math.round(value * 60)} s` : `${Math.round(value)} min`;
}
