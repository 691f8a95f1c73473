// A chip per shot: how good it is, why no better, and what to do about it.

import { h, toast } from "turnlight/dom.js";
import { ask, attempt } from "turnlight/service.js";
import { run } from "turnlight/run.js";

const WORDS = { good: "good", fair: "usable", poor: "poor" };

export function chips(session, live) {
  return session.shots.map((shot) => {
    const kind = shot.state === "taken" ? shot.quality : shot.state;
    const said = [`Shot ${shot.number}: ${WORDS[kind] ?? kind}.`, ...shot.reasons].join(" ");
    const retake = { label: "Take again", run: () => again(session, shot.number) };
    return h("span", { role: "listitem" }, h("button", {
      class: `chip ${kind}`, "aria-label": said, title: said, disabled: shot.state === "planned",
      onclick: () => toast(said, live || run.state === "idle" ? retake : undefined),
    }, String(shot.number)));
  });
}

/** Within the run that is on, or as a run of its own. */
export function again(session, number) {
  const isNow = run.session === session.name && run.state !== "idle";
  return attempt(async () => {
    if (isNow) await ask("POST", `/run/shots/${number}/retake`);
    else await ask("POST", `/sessions/${encodeURIComponent(session.name)}/resume`, { retake: [number] });
    toast(`Shot ${number} will be taken again.`);
    if (!isNow) location.hash = "#/capture";
  });
}
