// The page: which screen is shown, what is in reach on all of them, and the link to the service.

import { h, toast } from "turnlight/dom.js";
import { ask, attempt, listen } from "turnlight/service.js";
import { active, apply, run, setLinked, watch } from "turnlight/run.js";

const SCREENS = ["ready", "sample", "frame", "plan", "capture", "sessions", "calibrate", "result", "export"];
const FETCH_REST_MS = 1000;
const STEPS = { ready: "Ready", sample: "Sample", frame: "Frame", plan: "Plan", capture: "Capture", sessions: "Sessions" };
const WORDS = { homing: "Homing", running: "Capturing", pausing: "Pausing", paused: "Paused", interrupted: "Interrupted",
  finishing: "Finishing", faulted: "Failed", calibrating: "Calibrating" };
const WITHIN = { calibrate: "ready", result: "sessions", export: "sessions" };

const main = document.getElementById("main");
let leave = () => {};
let shown = "";

start();

async function start() {
  const [{ open }] = await Promise.all([ask("GET", "/door").catch(() => ({ open: true })), show()]);
  if (!open) {
    leave();
    const { screen: door } = await fetched("door");
    document.getElementById("nav").replaceChildren();
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
  // All should be there if the connection is lost.
  setTimeout(() => SCREENS.forEach((screen) => fetched(screen).catch(() => {})), FETCH_REST_MS);
}

function fetched(screen) {
  return import(`turnlight/screen-${screen}.js`);
}

function asked() {
  const [, screen, argument = ""] = location.hash.split("/");
  return { screen: SCREENS.includes(screen) ? screen : "ready", argument: decodeURIComponent(argument) };
}

function linked(isLinked) {
  const line = document.getElementById("link");
  line.textContent = isLinked ? "" : "Not connected to the rig's computer; trying again…";
  line.classList.toggle("lost", !isLinked);
  setLinked(isLinked);
}

async function show() {
  const { hash } = location;
  const { screen, argument } = asked();
  let make;
  if (!(await attempt(async () => { ({ screen: make } = await fetched(screen)); })) || location.hash !== hash) return;
  shown = screen;
  leave();
  const leavers = [];
  const page = make({ argument, onLeave: (callback) => leavers.push(callback) });
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
