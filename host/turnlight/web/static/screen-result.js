import { h, percent, toast, when } from "turnlight/dom.js";
import { ask, attempt } from "turnlight/service.js";
import { active, run, watch } from "turnlight/run.js";
import { again } from "turnlight/chips.js";
import { FLATS } from "turnlight/flats.js";
import { relit } from "turnlight/relit.js";

/** What came of a session: the material, how it grew, and each shot. */
export function screen({ argument: name, onLeave }) {
  const at = `/sessions/${encodeURIComponent(name)}`;
  const page = h("div", { class: "page wide" }, h("h1", {}, "Result"), h("p", { role: "status" }, "Loading…"));
  const bar = h("progress", { max: 1, "aria-label": "Refined" });
  let refining = false;
  load();
  follow();
  onLeave(watch(follow));
  return page;

  function load() {
    return attempt(async () => fill(await ask("GET", at)));
  }

  /** How far refining is; its result once it is there. */
  function follow() {
    const now = run.refining;
    const is = now?.session === name && now.share < 1;
    if (is) bar.value = now.share;
    if (is === refining) return;
    refining = is;
    if (!is && now.problem) toast(now.problem);
    load();
  }

  function refine() {
    return attempt(() => ask("POST", `${at}/refine`));
  }

  function fill(session) {
    const byHand = session.photos.length > 0;
    const pictures = byHand ? session.photos : session.shots;
    const taken = byHand ? session.photos.filter(({ used }) => used) : session.shots.filter(({ state }) => state === "taken");
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
    }, count === null ? "all" : `${count}`)));
    page.replaceChildren(h("h1", {}, session.sample),
      h("p", { class: "lead" }, `${taken.length} of ${pictures.length} ${byHand ? "photos by hand" : "shots"}, ${when(session.started)}`,
        session.operator && `, ${session.operator}`, session.barcode && `, ${session.barcode}`),
      h("div", { class: "row" },
        session.has_maps && h("a", { class: "button primary", href: `#/export/${encodeURIComponent(name)}` }, "Export"),
        session.has_maps && !refining && h("button", { onclick: refine, disabled: active() }, session.refined ? "Refine again" : "Refine"),
        !byHand && taken.length < pictures.length && h("button", { onclick: goOn }, "Take the missing shots"),
        h("a", { class: "button", href: "#/sample" }, "Next sample")),
      session.has_maps ? h("div", { class: "split" },
        h("div", { class: "card material" }, material.element,
          steps.length > 0 && h("div", { class: "compare" }, h("span", {}, "Left half after"), tabs)),
        h("div", { class: "column" },
          h("section", { class: "card" }, h("h2", {}, steps.length ? "How the maps grew" : "The maps"), growth(session, taken.length)),
          trust(session)))
        : h("p", { class: "card nothing" }, `There are no maps yet: no ${byHand ? "photo could be used" : "shot was taken"}.`),
      ...(byHand ? photos(session.photos) : shots(session, taken)));
  }

  function shots(session, taken) {
    const flagged = session.shots.filter((shot) => shot.state === "skipped" || shot.state === "dropped" || (shot.quality && shot.quality !== "good"));
    return [
      flagged.length > 0 && h("section", { class: "card" }, h("h2", {}, "Look at these"),
        h("ul", { class: "flags" }, flagged.map((shot) => h("li", {},
          h("span", { class: `chip ${shot.state === "taken" ? shot.quality : shot.state}` }, String(shot.number)),
          h("p", {}, shot.reasons.join(" ") || shot.state),
          h("button", { onclick: () => again(session, shot.number) }, "Take again"))))),
      taken.length > 0 && h("section", { class: "card" }, h("h2", {}, "Shots"), h("ul", { class: "shots" }, taken.map((shot) => h("li", {},
        picture(shot, `Shot ${shot.number}`),
        h("p", {}, h("span", { class: `chip ${shot.quality}` }, String(shot.number)),
          h("span", {}, `${shot.angle_deg}°, LED ${shot.leds.join(", ")}`,
            shot.change !== null && h("small", {}, `changed ${percent(shot.change)}`))),
        h("button", { "aria-label": `Take again: shot ${shot.number}`, onclick: () => again(session, shot.number) }, "Take again"))))),
    ].filter(Boolean);
  }

  function photos(taken) {
    return [h("section", { class: "card" }, h("h2", {}, "Photos"), h("ul", { class: "shots" }, taken.map((photo) => h("li", {},
      picture(photo, `Photo ${photo.number}`),
      h("p", {}, h("span", { class: `chip ${photo.used ? "good" : "dropped"}` }, String(photo.number)),
        h("span", {}, photo.name, h("small", {}, photo.reasons.join(" ") || (photo.used ? "" : "not used"))))))))];
  }

  function picture({ number }, alt) {
    return h("img", { src: `/api${at}/shots/${number}.jpg`, alt, loading: "lazy", width: 480, height: 360 });
  }

  /** The maps after so many shots, side by side; only as they are where nothing was kept of before. */
  function growth(session, count) {
    const image = (map, after) => h("img", {
      src: `/api${at}/maps/${map}.jpg?${after ? `after=${after}` : `v=${session.refined ?? run.mapsVersion}`}`, alt: `${map} after ${after ?? count} shots`, loading: "lazy", width: 256, height: 256,
    });
    const columns = [...session.history.filter((n) => n < count), null];
    if (columns.length === 1) {
      return h("div", { class: "maps" }, FLATS.map((map) => h("figure", {}, image(map, null), h("figcaption", {}, map))));
    }
    return h("div", { class: "scroll", tabindex: 0, role: "region", "aria-label": "Maps by number of shots" }, h("table", { class: "growth" },
      h("thead", {}, h("tr", {}, h("td", {}), columns.map((n) => h("th", { scope: "col" }, n ?? (session.refined ? "refined" : count))))),
      h("tbody", {}, [...FLATS, "preview"].map((map) =>
        h("tr", {}, h("th", { scope: "row" }, map === "preview" ? "relit" : map), columns.map((n) => h("td", {}, image(map, n))))))));
  }

  /** How well the session explains itself, and where its maps may be off. */
  function trust({ quality, doubts, refined }) {
    if (refining) {
      return h("section", { class: "card" }, h("h2", {}, "Refining"), bar, h("p", { class: "hint" }, "The maps are fitted to the photographs under the known lights; this takes some seconds, and the page need not stay open."));
    }
    if (!refined) {
      return h("section", { class: "card" }, h("h2", {}, "How sure they are"),
        h("p", { class: "hint" }, "Refining fits the maps to the photographs under the known lights. It then tells how far each value may be off, and how well the shots agree."));
    }
    return h("section", { class: "card" }, h("h2", {}, "How sure they are"),
      quality && agreement(quality),
      doubts.length > 0 && h("div", { class: "doubts" }, doubts.map(({ map, median, full, unit }) => h("figure", {},
        h("img", { src: `/api${at}/uncertainty/${map}.jpg?v=${Date.parse(refined)}`, alt: `Where the ${map} map may be off`, loading: "lazy", width: 256, height: 256 }),
        h("figcaption", {}, h("b", {}, map), ` ± ${off(median, unit)}`, h("span", { class: "scale" }, h("i", {}), `${off(full, unit)}`))))),
      doubts.length > 0 && h("p", { class: "hint" }, "Half of what 95 of 100 errors lie within: the figure is the median, the brightest places reach the right end of the scale."));
  }

  function agreement({ relighting_error: error, relighting_error_by_shot: byShot, bad_shots: bad, highlight_reachable: reach }) {
    const shots = Object.entries(byShot);
    const worst = Math.max(...shots.map(([, value]) => value), 0.01);
    return [
      h("p", { class: "figure" }, error === null ? "Too few shots to tell how well they agree."
        : [h("b", {}, percent(error)), " off, where a shot is predicted by the others"]),
      shots.length > 0 && h("ol", { class: "bars" }, shots.map(([number, value]) => h("li", { title: `Shot ${number}: ${percent(value)}` },
        h("progress", { max: worst, value, "aria-label": `Shot ${number}: ${percent(value)} off` }), h("small", {}, number)))),
      bad.length > 0 && h("p", { class: "warning" }, `${bad.length === 1 ? "Shot" : "Shots"} ${bad.join(", ")} contradicted the others and was left out.`),
      reach !== null && h("p", { class: "hint" }, `Some shot can catch the highlight on ${percent(reach, 0)} of the sample.`),
    ];
  }

  function goOn() {
    attempt(async () => {
      await ask("POST", `${at}/resume`, {});
      location.hash = "#/capture";
    });
  }
}

function off(value, unit) {
  return `${Number(value.toPrecision(2))}${unit}`;
}
