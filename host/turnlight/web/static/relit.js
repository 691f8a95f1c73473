// The material in three dimensions, under a light that follows the pointer, or the arrow keys.

import { h } from "turnlight/dom.js";
import { unpackBytes } from "turnlight/maps.js";
import { orbit, STEEPEST } from "turnlight/orbit.js";
import { Relighter, SHOWN } from "turnlight/relight.js";
import { ask } from "turnlight/service.js";

const DISTANCE = 4;
const HEIGHT = 2.4;
const FARTHEST = 5;
const TILTED = { turn: 0.5, tilt: 0.8 };
const GROUND = [24 / 255, 25 / 255, 28 / 255];
const STEPS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };

/** { element, load(session, after), compare(session, after) } */
export function relit() {
  const canvas = h("canvas", { width: 768, height: 768, tabindex: 0, role: "application",
    "aria-label": "The material. Arrow keys move the light, with Shift they turn the view." });
  const lamp = h("span", { class: "spot", hidden: true, "aria-hidden": "true" });
  const choices = tabs("What is shown", SHOWN, (name) => { shown = name; });
  const drag = tabs("Dragging moves", ["light", "view"], (name) => {
    turning = name === "view";
    if (turning && !angles.tilt) angles = TILTED;
  });
  const flat = h("button", { hidden: true, onclick: () => turn(0, 0) }, "From above");
  const problem = h("p", { class: "problem", role: "alert" });
  const element = h("figure", { class: "relit" }, h("div", { class: "stage" }, canvas, lamp), choices,
    h("div", { class: "view" }, h("span", {}, "Drag the"), drag, flat), problem);
  let relighter;
  let material;
  let second;
  let shown = "relit";
  let turning = false;
  let held = null; // where the sample is held while a drag turns it
  let light = [-1.1, 1.1, HEIGHT];
  let angles = { turn: 0, tilt: 0 };
  let camera = place();
  let asked = false;
  try {
    relighter = new Relighter(canvas);
  } catch (error) {
    problem.textContent = error.message;
  }
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    held = turning || event.shiftKey || event.buttons === 2 ? [event.clientX, event.clientY] : null;
    if (!held) aim(event);
  });
  canvas.addEventListener("pointermove", (event) => {
    if (!held) return aim(event);
    swing(event.clientX - held[0], event.clientY - held[1]);
    held = [event.clientX, event.clientY];
  });
  for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, () => { held = null; });
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("dblclick", () => turn(0, 0));
  canvas.addEventListener("keydown", (event) => {
    const step = STEPS[event.key];
    if (!step) return;
    event.preventDefault();
    if (turning || event.shiftKey) turn(angles.turn + 0.1 * step[0], angles.tilt - 0.1 * step[1]);
    else move(light[0] + 0.15 * step[0], light[1] + 0.15 * step[1]);
  });
  return { element, load, compare };

  function aim(event) {
    const box = canvas.getBoundingClientRect();
    const at = camera.onSample((event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height);
    if (at) move(...mirrored(at, HEIGHT + camera.view[2], camera.view[2]));
  }

  /** The light's place for which a mirror would show it at `at`; with the heights exchanged, the reverse. */
  function mirrored(at, from, to) {
    return at.map((v, i) => camera.view[i] + (v - camera.view[i]) * from / to);
  }

  /** x, y in half sides of the sample. */
  function move(x, y) {
    light = [x, y].map((v) => Math.min(Math.max(v, -FARTHEST), FARTHEST)).concat(HEIGHT);
    draw();
  }

  /** By CSS pixels, as if the sample were held by its front. */
  function swing(x, y) {
    const { width } = canvas.getBoundingClientRect();
    turn(angles.turn - 3 * x / width, angles.tilt - 3 * y / width);
  }

  function turn(about, away) {
    angles = { turn: about, tilt: Math.min(Math.max(away, 0), STEEPEST) };
    draw();
  }

  /** The maps, which are shown. */
  async function load(session, after) {
    const maps = await fetched(session, after);
    free(material);
    material = relighter?.material(maps);
    draw();
    return maps;
  }

  /** Shows the maps after so many pictures left of the middle; none at null. */
  async function compare(session, after) {
    const maps = after === null ? null : await fetched(session, after);
    free(second);
    second = maps && relighter?.material(maps);
    draw();
  }

  async function fetched(session, after) {
    const query = after ? `?after=${after}` : "";
    const reply = await ask("GET", `/sessions/${encodeURIComponent(session)}/packed${query}`);
    return unpackBytes(await reply.arrayBuffer());
  }

  function free(old) {
    old?.textures.forEach((texture) => relighter.gl.deleteTexture(texture));
  }

  function tabs(label, names, choose) {
    const group = h("div", { class: "tabs", role: "group", "aria-label": label }, names.map((name, i) =>
      h("button", { "aria-pressed": String(i === 0), onclick: () => {
        [...group.children].forEach((button, k) => button.setAttribute("aria-pressed", String(k === i)));
        choose(name);
        draw();
      } }, name)));
    return group;
  }

  function place() {
    return orbit({ ...angles, distance: DISTANCE, width: canvas.width, height: canvas.height });
  }

  function draw() {
    flat.hidden = angles.tilt === 0;
    canvas.classList.toggle("turning", turning);
    if (asked || !material) return;
    asked = true;
    requestAnimationFrame(() => {
      asked = false;
      camera = place();
      relighter.draw({
        material, light, view: camera.view, plane: camera.plane, ground: GROUND, shown,
        power: light.reduce((sum, v) => sum + v * v, 0), other: second ?? undefined, split: second ? 0 : undefined,
      });
      const [left, top] = camera.onCanvas(
        mirrored(light.slice(0, 2), camera.view[2], HEIGHT + camera.view[2]));
      lamp.style.left = `${left * 100}%`;
      lamp.style.top = `${top * 100}%`;
      lamp.hidden = shown !== "relit" || Math.max(Math.abs(left - 0.5), Math.abs(top - 0.5)) > 0.5;
      Object.assign(canvas.dataset, { light: light.join(), turn: angles.turn, tilt: angles.tilt });
    });
  }
}
