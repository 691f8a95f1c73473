// The page: which screen is shown, what is in reach on all of them, and the link to the service.

import { h, toast } from "turnlight/dom.js";
import { ask, attempt, listen } from "turnlight/service.js";
import { active, apply, run, setLinked, watch } from "turnlight/run.js";
import { ready } from "turnlight/screen-ready.js";
import { sample } from "turnlight/screen-sample.js";
import { frame } from "turnlight/screen-frame.js";
import { planned } from "turnlight/screen-plan.js";
import { capture } from "turnlight/screen-capture.js";
import { result } from "turnlight/screen-result.js";
import { exporting } from "turnlight/screen-export.js";
import { sessions } from "turnlight/screen-sessions.js";
import { door } from "turnlight/screen-door.js";

const SCREENS = { ready, sample, frame, plan: planned, capture, sessions, result, export: exporting };
const STEPS = { ready: "Ready", sample: "Sample", frame: "Frame", plan: "Plan", capture: "Capture", sessions: "Sessions" };

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
    h("a", { href: `#/${key}`, "aria-current": key === screen ? "page" : undefined }, label)));
  scrollTo(0, 0);
  reach();
}

/** Pause, stop and stop-now, on every screen while there is a run. */
function reach() {
  const bar = document.getElementById("reach");
  bar.hidden = !active();
  document.body.classList.toggle("running", active());
  if (bar.hidden) return;
  const progress = run.count ? `${run.shots.size}/${run.count}` : "";
  if (bar.dataset.key === run.state) {
    bar.querySelector("b").textContent = progress; // a button that is being pressed stays where it is
    return;
  }
  const focused = bar.contains(document.activeElement) ? document.activeElement.dataset.verb : null;
  bar.dataset.key = run.state;
  const verb = (name, label, kind = "") =>
    h("button", { class: kind, "data-verb": name, onclick: () => attempt(() => ask("POST", `/run/${name}`)) }, label);
  const buttons = {
    homing: () => [verb("stop", "Stop"), verb("stop-now", "Stop now", "danger")],
    running: () => [verb("pause", "Pause"), verb("stop", "Stop"), verb("stop-now", "Stop now", "danger")],
    pausing: () => [verb("resume", "Go on"), verb("stop", "Stop"), verb("stop-now", "Stop now", "danger")],
    paused: () => [verb("resume", "Go on", "primary"), verb("stop", "Stop"), verb("stop-now", "Stop now", "danger")],
    interrupted: () => [verb("resume", "Resume", "primary"), verb("stop", "Finish"), verb("dismiss", "Leave")],
    faulted: () => [verb("dismiss", "Leave")],
    finishing: () => [],
  }[run.state]?.() ?? [];
  bar.replaceChildren(
    h("a", { href: "#/capture" }, h("span", { class: `lamp ${run.state}` }), `${words(run.state)} `,
      h("b", {}, progress)),
    h("div", { class: "row" }, buttons));
  if (focused) bar.querySelector(`[data-verb="${focused}"]`)?.focus();
}

function words(state) {
  return { homing: "Homing", running: "Capturing", pausing: "Pausing", paused: "Paused",
    interrupted: "Interrupted", finishing: "Finishing", faulted: "Failed" }[state] ?? state;
}
