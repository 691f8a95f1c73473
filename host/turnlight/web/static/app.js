// The page: which screen is shown, what is in reach on all of them, and the link to the service.

import { h, toast } from "turnlight/dom.js";
import { ask, attempt, listen } from "turnlight/service.js";
import { active, apply, run, setLinked, watch } from "turnlight/run.js";
import { ready } from "turnlight/screen-ready.js";
import { sample } from "turnlight/screen-sample.js";
import { frame } from "turnlight/screen-frame.js";
import { planned } from "turnlight/screen-plan.js";
import { calibrate } from "turnlight/screen-calibrate.js";
import { capture } from "turnlight/screen-capture.js";
import { result } from "turnlight/screen-result.js";
import { exporting } from "turnlight/screen-export.js";
import { sessions } from "turnlight/screen-sessions.js";
import { door } from "turnlight/screen-door.js";

const SCREENS = { ready, sample, frame, plan: planned, capture, sessions, calibrate, result, export: exporting };
const STEPS = { ready: "Ready", sample: "Sample", frame: "Frame", plan: "Plan", capture: "Capture", sessions: "Sessions" };
const WORDS = { homing: "Homing", running: "Capturing", pausing: "Pausing", paused: "Paused", interrupted: "Interrupted",
  finishing: "Finishing", faulted: "Failed", calibrating: "Calibrating" };
const WITHIN = { calibrate: "ready", result: "sessions", export: "sessions" };

const main = document.getElementById("main");
let leave = () => {};
let shown = "";

start();

async function start() {
  const { open } = await ask("GET", "/door").catch(() => ({ open: true }));
  if (!open) {
    main.replaceChildren(door(() => location.reload()));
    return;
  }
  addEventListener("hashchange", show);
  watch(reach);
  watch((event) => {
    if (event.kind === "refused") toast(event.cause);
    if (event.kind === "finished" && shown.startsWith("capture")) {
      location.hash = `#/result/${encodeURIComponent(run.session)}`;
    }
    if (event.kind === "started" && ["ready", "sample", "plan", "frame"].includes(shown)) location.hash = "#/capture";
  });
  listen(apply, linked);
  show();
}

function linked(isLinked) {
  const line = document.getElementById("link");
  line.textContent = isLinked ? "" : "Not connected to the rig's computer; trying again…";
  line.classList.toggle("lost", !isLinked);
  setLinked(isLinked);
}

function show() {
  const [, screen = "ready", argument = ""] = location.hash.split("/");
  const make = SCREENS[screen] ?? ready;
  leave();
  shown = screen;
  const leavers = [];
  const page = make({ argument: decodeURIComponent(argument), onLeave: (callback) => leavers.push(callback) });
  leave = () => leavers.forEach((callback) => callback());
  main.replaceChildren(page);
  main.className = `screen-${screen}`;
  const title = page.querySelector("h1")?.textContent ?? "";
  document.title = `${title} – Turnlight`;
  document.getElementById("nav").replaceChildren(...Object.entries(STEPS).map(([key, label]) =>
    h("a", { href: `#/${key}`, "aria-current": key === screen ? "page" : key === WITHIN[screen] ? "true" : undefined }, label)));
  scrollTo(0, 0);
  reach();
}

/** Pause, stop and stop-now, on every screen while the rig is at work. */
function reach() {
  const bar = document.getElementById("reach");
  const { state = "", where, progress, buttons } = atWork() ?? {};
  bar.hidden = !state;
  document.body.classList.toggle("running", state !== "");
  if (state && bar.dataset.key === state) { // a button that is being pressed stays where it is
    bar.querySelector("b").textContent = progress;
    return;
  }
  bar.dataset.key = state;
  if (!state) return;
  const focused = bar.contains(document.activeElement) ? document.activeElement.dataset.path : null;
  bar.replaceChildren(
    h("a", { href: where }, h("span", { class: `lamp ${state}` }), `${WORDS[state] ?? state} `, h("b", {}, progress)),
    h("div", { class: "row" }, buttons.map(([path, label, kind]) =>
      h("button", { class: kind, "data-path": path, onclick: () => attempt(() => ask("POST", path)) }, label))));
  if (focused) bar.querySelector(`[data-path="${focused}"]`)?.focus();
}

/** What the rig is at, how far, and what may be asked of it; null at rest. */
function atWork() {
  const measuring = run.calibration?.steps.find(({ name }) => name === run.calibration.running);
  if (measuring) {
    return { state: "calibrating", where: "#/calibrate", buttons: [["/calibration/stop", "Stop now", "danger"]],
      progress: measuring.count ? `${measuring.number}/${measuring.count}` : "" };
  }
  if (!active()) return null;
  const stop = ["/run/stop", "Stop"];
  const now = ["/run/stop-now", "Stop now", "danger"];
  const buttons = {
    homing: [stop, now],
    running: [["/run/pause", "Pause"], stop, now],
    pausing: [["/run/resume", "Go on"], stop, now],
    paused: [["/run/resume", "Go on", "primary"], stop, now],
    interrupted: [["/run/resume", "Resume", "primary"], ["/run/stop", "Finish"], ["/run/dismiss", "Leave"]],
    faulted: [["/run/dismiss", "Leave"]],
  }[run.state] ?? [];
  return { state: run.state, where: "#/capture", buttons, progress: run.count ? `${run.shots.size}/${run.count}` : "" };
}
