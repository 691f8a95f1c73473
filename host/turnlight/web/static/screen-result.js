import { h, percent, when } from "turnlight/dom.js";
import { ask, attempt } from "turnlight/service.js";
import { again } from "turnlight/chips.js";
import { relit } from "turnlight/relit.js";

/** What came of a session: the material, how it grew, and each shot. */
export function result({ argument: name }) {
  const at = `/sessions/${encodeURIComponent(name)}`;
  const page = h("div", { class: "page wide" }, h("h1", {}, "Result"), h("p", { role: "status" }, "Loading…"));
  attempt(async () => fill(await ask("GET", at)));
  return page;

  function fill(session) {
    const taken = session.shots.filter((shot) => shot.state === "taken");
    const flagged = session.shots.filter((shot) => shot.state === "skipped" || shot.state === "dropped" || (shot.quality && shot.quality !== "good"));
    const material = relit();
    if (session.has_maps) attempt(() => material.load(name));
    const steps = session.history.filter((count) => count < taken.length);
    const tabs = h("div", { class: "tabs", role: "group", "aria-label": "Compare with" });
    tabs.append(...[null, ...steps].map((count) => h("button", {
      "aria-pressed": String(count === null),
      onclick: (event) => {
        [...tabs.children].forEach((tab) => tab.setAttribute("aria-pressed", String(tab === event.currentTarget)));
        attempt(() => material.compare(name, count));
      },
    }, count === null ? "All only" : `After ${count}`)));
    page.replaceChildren(h("h1", {}, session.sample),
      h("p", { class: "lead" }, `${taken.length} of ${session.shots.length} shots, ${when(session.started)}`,
        session.operator && `, ${session.operator}`, session.barcode && `, ${session.barcode}`),
      h("div", { class: "row" },
        h("a", { class: "button primary", href: `#/export/${encodeURIComponent(name)}` }, "Export"),
        taken.length < session.shots.length && h("button", { onclick: goOn }, "Take the missing shots"),
        h("a", { class: "button", href: "#/sample" }, "Next sample")),
      session.has_maps ? h("div", { class: "split" },
        h("div", { class: "card material" }, material.element,
          steps.length > 0 && h("div", { class: "compare" }, h("span", {}, "Left half"), tabs)),
        h("div", { class: "card" }, h("h2", {}, "How the maps grew"), growth(session, taken.length)))
        : h("p", { class: "card" }, "There are no maps yet: no shot was taken."),
      flagged.length > 0 && h("section", { class: "card" }, h("h2", {}, "Look at these"),
        h("ul", { class: "flags" }, flagged.map((shot) => h("li", {},
          h("span", { class: `chip ${shot.state === "taken" ? shot.quality : shot.state}` }, String(shot.number)),
          h("p", {}, shot.reasons.join(" ") || shot.state),
          h("button", { onclick: () => again(session, shot.number) }, "Take again"))))),
      h("section", { class: "card" }, h("h2", {}, "Shots"), h("ul", { class: "shots" }, taken.map((shot) => h("li", {},
        h("img", { src: `/api${at}/shots/${shot.number}.jpg`, alt: `Shot ${shot.number}`, loading: "lazy", width: 480, height: 360 }),
        h("p", {}, h("span", { class: `chip ${shot.quality}` }, String(shot.number)),
          ` ${shot.angle_deg}°, LED ${shot.leds.join(", ")}`, shot.change !== null && h("small", {}, ` ${percent(shot.change)}`)),
        h("button", { "aria-label": `Take again: shot ${shot.number}`, onclick: () => again(session, shot.number) }, "Take again"))))));
  }

  function growth(session, count) {
    const columns = [...session.history.filter((n) => n < count), null];
    const cell = (map, after) => h("td", {}, h("img", {
      src: `/api${at}/maps/${map}.jpg${after ? `?after=${after}` : ""}`, alt: `${map} after ${after ?? count} shots`, loading: "lazy", width: 256, height: 256,
    }));
    return h("div", { class: "scroll", tabindex: 0, role: "region", "aria-label": "Maps by number of shots" }, h("table", { class: "growth" },
      h("thead", {}, h("tr", {}, h("td", {}), columns.map((n) => h("th", { scope: "col" }, String(n ?? count))))),
      h("tbody", {}, ["normal", "diffuse", "roughness", "specular", "preview"].map((map) =>
        h("tr", {}, h("th", { scope: "row" }, map === "preview" ? "relit" : map), columns.map((n) => cell(map, n)))))));
  }

  function goOn() {
    attempt(async () => {
      await ask("POST", `${at}/resume`, {});
      location.hash = "#/capture";
    });
  }
}
