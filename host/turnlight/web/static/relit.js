// The material under a light that follows the pointer, or the arrow keys.

import { h } from "turnlight/dom.js";
import { unpack } from "turnlight/maps.js";
import { Relighter, SHOWN } from "turnlight/relight.js";
import { ask } from "turnlight/service.js";

const VIEW = [0, 0, 4];
const HEIGHT = 2.4;

/** { element, load(session, after), other(session, after), light(x, y) } */
export function relit() {
  const canvas = h("canvas", { width: 768, height: 768, tabindex: 0, role: "application",
    "aria-label": "The material; move the light with the pointer or the arrow keys" });
  const lamp = h("span", { class: "spot", hidden: true, "aria-hidden": "true" });
  const choices = h("div", { class: "tabs", role: "group", "aria-label": "What is shown" }, SHOWN.map((name) =>
    h("button", { "aria-pressed": String(name === "relit"), onclick: () => show(name) }, name)));
  const problem = h("p", { class: "hint" });
  const element = h("figure", { class: "relit" }, h("div", { class: "stage" }, canvas, lamp), choices, problem);
  let relighter;
  let material;
  let second;
  let shown = "relit";
  let light = [-1.1, 1.1, HEIGHT];
  let asked = false;
  try {
    relighter = new Relighter(canvas);
  } catch (error) {
    problem.textContent = error.message;
  }
  canvas.addEventListener("pointermove", aim);
  canvas.addEventListener("pointerdown", (event) => { canvas.setPointerCapture(event.pointerId); aim(event); });
  canvas.addEventListener("keydown", (event) => {
    const step = { ArrowLeft: [-0.15, 0], ArrowRight: [0.15, 0], ArrowUp: [0, 0.15], ArrowDown: [0, -0.15] }[event.key];
    if (!step) return;
    event.preventDefault();
    move(light[0] + step[0], light[1] + step[1]);
  });
  return { element, load, compare, move };

  function aim(event) {
    const box = canvas.getBoundingClientRect();
    move(((event.clientX - box.left) / box.width * 2 - 1) * 1.6, (1 - (event.clientY - box.top) / box.height * 2) * 1.6);
  }

  /** x, y in half sides of the sample. */
  function move(x, y) {
    light = [x, y].map((v) => Math.min(Math.max(v, -2.5), 2.5)).concat(HEIGHT);
    draw();
  }

  async function load(session, after) {
    const got = await fetched(session, after);
    free(material);
    material = got;
    draw();
  }

  /** Shows the maps after so many pictures left of the middle; none at null. */
  async function compare(session, after) {
    const got = after === null ? null : await fetched(session, after);
    free(second);
    second = got;
    draw();
  }

  async function fetched(session, after) {
    if (!relighter) return null;
    const query = after ? `?after=${after}` : "";
    return relighter.material(await unpack(await ask("GET", `/sessions/${encodeURIComponent(session)}/packed${query}`)));
  }

  function free(old) {
    old?.textures.forEach((texture) => relighter.gl.deleteTexture(texture));
  }

  function show(name) {
    shown = name;
    [...choices.children].forEach((button, i) => button.setAttribute("aria-pressed", String(SHOWN[i] === name)));
    draw();
  }

  function draw() {
    if (asked || !material) return;
    asked = true;
    requestAnimationFrame(() => {
      asked = false;
      const step = 2 / canvas.width;
      relighter.draw({
        material, light, view: VIEW, power: light.reduce((sum, v) => sum + v * v, 0), shown, exposure: 1,
        origin: [-1, -1], step: [step, step], other: second ?? undefined, split: second ? 0 : undefined,
      });
      lamp.style.left = `${(light[0] / 1.6 + 1) * 50}%`;
      lamp.style.top = `${(1 - light[1] / 1.6) * 50}%`;
      lamp.hidden = shown !== "relit" || Math.max(Math.abs(light[0]), Math.abs(light[1])) > 1.6;
      canvas.dataset.light = light.join();
    });
  }
}
