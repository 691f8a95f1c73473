// The relighting viewer: pointer moves the light, wheel and pinch zoom, and what it can be compared with.

import { Camera } from "turnlight/camera.js";
import { unpack } from "turnlight/maps.js";
import { Relighter } from "turnlight/relight.js";

const VIEW = [0, 0, 4];
const GROUND = [24 / 255, 25 / 255, 28 / 255];
const $ = (id) => document.getElementById(id);

const content = JSON.parse($("content").textContent);
const canvas = $("canvas");
const state = {
  shown: "relit",
  before: false, // the material before is shown instead
  compare: "off", // what is left of the divider: off, before, photo
  photo: 0,
  tiled: false,
  divider: 0.5, // as a share of the window
  pointer: null, // where on the sample the light is aimed; null: it circles
  held: false,
  height: 1.6,
  stops: content.stops,
};

let redraw = () => {};
start().catch((error) => {
  $("failure").textContent = error.message;
  $("failure").hidden = false;
});

async function start() {
  const relighter = new Relighter(canvas);
  const material = relighter.material(await unpack(content.maps));
  const before = content.before && relighter.material(await unpack(content.before));
  const photos = await Promise.all(content.photos.map((photo) => loadPhoto(relighter, photo)));
  const extent = () => material.extent.map((half) => half * (state.tiled ? 3 : 1));
  const margins = () => ({ sides: innerWidth < 760 ? 14 : 28, top: 84, bottom: $("footer").offsetHeight + 64 });
  const camera = new Camera(canvas, extent, margins);

  let asked = false;
  redraw = () => {
    if (asked) return;
    asked = true;
    requestAnimationFrame((now) => {
      asked = false;
      const scene = { ...lightOf(now, photos), ...camera.window() };
      const byPhoto = state.compare === "photo";
      relighter.draw({
        ...scene,
        material: state.before && state.compare !== "before" ? before : material,
        other: state.compare === "before" ? before : undefined,
        photo: byPhoto ? photos[state.photo].texture : undefined,
        split: state.compare === "off" ? undefined : camera.xOf(state.divider),
        shown: state.shown,
        repeats: state.tiled ? 3 : 1,
        exposure: 2 ** (byPhoto ? state.stops - content.stops : state.stops),
        ground: GROUND,
      });
      overlay(camera, scene.light);
      if (!state.pointer && !byPhoto && !still()) redraw();
    });
  };
  listen(camera);
  controls(Boolean(before), photos.length, camera);
  new ResizeObserver(() => { camera.resize(); redraw(); }).observe(canvas);
  camera.resize();
  redraw();
  window.turnlight = { state, camera, redraw: () => redraw() };
}

/** The light of the photograph that is compared with, or one that stands over the pointer. */
function lightOf(now, photos) {
  if (state.compare === "photo") {
    const { light, view, white } = photos[state.photo];
    return { light, view, white };
  }
  const turn = still() ? 2.3 : now / 2600;
  const aim = state.pointer ?? [0.62 * Math.cos(turn), 0.62 * Math.sin(turn)];
  const spread = (state.height + VIEW[2]) / VIEW[2]; // so that a mirror's highlight is under the pointer
  return {
    light: [aim[0] * spread, aim[1] * spread, state.height],
    view: VIEW,
    power: state.height ** 2 + 0.35,
  };
}

function still() {
  return matchMedia("(prefers-reduced-motion: reduce)").matches;
}

async function loadPhoto(relighter, { image, light, view, white, whiteSize, fit }) {
  const blob = await (await fetch(image)).blob();
  const bitmap = await createImageBitmap(blob, { colorSpaceConversion: "none" });
  const grid = relighter.grid(new Float32Array(white).map((value) => value * fit), whiteSize);
  return { texture: relighter.image(bitmap), light, view, white: grid };
}

function listen(camera) {
  const fingers = new Map();
  let travelled = 0;
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    fingers.set(event.pointerId, [event.offsetX, event.offsetY]);
    travelled = 0;
    if (event.pointerType === "touch") aim(event);
  });
  canvas.addEventListener("pointermove", (event) => {
    const last = fingers.get(event.pointerId);
    const here = [event.offsetX, event.offsetY];
    if (last) travelled += Math.hypot(here[0] - last[0], here[1] - last[1]);
    if (last && fingers.size === 2) {
      const [still] = [...fingers].filter(([id]) => id !== event.pointerId).map(([, at]) => at);
      const [was, is] = [last, here].map((at) => Math.hypot(at[0] - still[0], at[1] - still[1]));
      camera.zoom(is / Math.max(was, 1), (still[0] + here[0]) / 2, (still[1] + here[1]) / 2);
      camera.pan((here[0] - last[0]) / 2, (here[1] - last[1]) / 2);
    } else if (last && event.pointerType !== "touch") {
      camera.pan(here[0] - last[0], here[1] - last[1]);
    } else {
      aim(event);
    }
    if (last) fingers.set(event.pointerId, here);
    redraw();
  });
  const lift = (event) => {
    if (fingers.delete(event.pointerId) && travelled < 4 && event.pointerType !== "touch") {
      state.held = !state.held;
      aim(event, true);
    }
  };
  canvas.addEventListener("pointerup", lift);
  canvas.addEventListener("pointercancel", (event) => fingers.delete(event.pointerId));
  canvas.addEventListener("dblclick", () => { camera.reset(); redraw(); });
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    camera.zoom(Math.exp(-event.deltaY * 0.0015), event.offsetX, event.offsetY);
    redraw();
  }, { passive: false });

  function aim(event, always = false) {
    if (state.held && !always && event.pointerType !== "touch") return;
    state.pointer = camera.sampleAt(event.offsetX, event.offsetY);
    redraw();
  }

  const handle = $("divider");
  handle.addEventListener("pointerdown", (event) => handle.setPointerCapture(event.pointerId));
  handle.addEventListener("pointermove", (event) => {
    if (!handle.hasPointerCapture(event.pointerId)) return;
    state.divider = Math.min(Math.max(event.clientX / innerWidth, 0.02), 0.98);
    redraw();
  });
}

function controls(hasBefore, photoCount, camera) {
  choice("shown", (value) => { state.shown = value; });
  choice("compare", (value) => {
    state.compare = value;
    refresh();
  });
  choice("state", (value) => { state.before = value === "before"; });
  $("tiled").onclick = () => { state.tiled = !state.tiled; camera.reset(); refresh(); };
  $("about").onclick = () => { $("sheet").hidden = !$("sheet").hidden; };
  $("sheet").onclick = (event) => { if (event.target === $("sheet")) $("sheet").hidden = true; };
  $("height").oninput = (event) => { state.height = Number(event.target.value); redraw(); };
  $("stops").value = state.stops;
  $("stops").oninput = (event) => { state.stops = Number(event.target.value); redraw(); };
  $("states").hidden = !hasBefore;
  $("tiled").hidden = !content.tiles;
  $("states").parentElement.hidden = !hasBefore && !content.tiles;
  document.querySelector("[data-compare=before]").hidden = !hasBefore;
  document.querySelector("[data-compare=photo]").hidden = photoCount === 0;
  $("comparisons").hidden = !hasBefore && photoCount === 0;
  content.photos.forEach((photo, number) => {
    const button = document.createElement("button");
    button.style.backgroundImage = `url(${photo.image})`;
    button.title = photo.name;
    button.onclick = () => { state.photo = number; refresh(); };
    $("photos").append(button);
  });
  addEventListener("keydown", (event) => {
    if (event.target.matches("input")) return;
    const names = ["relit", "normal", "diffuse", "roughness", "specular"];
    const named = names[Number(event.key) - 1];
    if (named) document.querySelector(`[data-shown=${named}]`).click();
    if (event.key === "b" && hasBefore) {
      document.querySelector(`[data-state=${state.before ? "after" : "before"}]`).click();
    }
    if (event.key === "s" && photoCount) {
      document.querySelector(`[data-compare=${state.compare === "photo" ? "off" : "photo"}]`).click();
    }
    if (event.key === "Escape") $("sheet").hidden = true;
    if (event.key === "0") { camera.reset(); redraw(); }
  });
  refresh();

  function refresh() {
    document.querySelectorAll("[data-state]").forEach((button) => {
      button.disabled = state.compare === "before";
    });
    $("tiled").setAttribute("aria-pressed", state.tiled);
    $("photos").hidden = state.compare !== "photo";
    [...$("photos").children].forEach((button, number) =>
      button.setAttribute("aria-pressed", number === state.photo));
    $("height").disabled = state.compare === "photo";
    const photo = content.photos[state.photo];
    const fitted = photo && Math.abs(photo.fit - 1) > 0.02 ? `, exposure × ${photo.fit.toFixed(2)}` : "";
    const left = { before: content.beforeName, photo: "Photo" }[state.compare];
    const right = { before: content.afterName, photo: `Relit${fitted}` }[state.compare];
    $("left").textContent = left ?? "";
    $("right").textContent = right ?? "";
    redraw();
  }

  function choice(name, choose) {
    const buttons = [...document.querySelectorAll(`[data-${name}]`)];
    const press = (pressed) =>
      buttons.forEach((button) => button.setAttribute("aria-pressed", button === pressed));
    buttons.forEach((button) => {
      button.onclick = () => { press(button); choose(button.dataset[name]); redraw(); };
    });
    press(buttons[0]);
  }
}

/** What lies over the picture: divider, scale bar and, where it is not under the pointer, the light. */
function overlay(camera, light) {
  const handle = $("divider");
  handle.hidden = state.compare === "off";
  handle.style.left = `${state.divider * 100}%`;
  const [halfWidth, halfHeight] = camera.extent();
  const [left, top] = camera.screenOf([-halfWidth, halfHeight]);
  const [, bottom] = camera.screenOf([-halfWidth, -halfHeight]);
  const lowest = innerHeight - $("footer").offsetHeight;
  handle.style.top = `${Math.max(top, 64) - 34}px`;
  handle.style.bottom = `${innerHeight - Math.min(bottom, lowest - 12)}px`;
  $("photos").style.bottom = `${innerHeight - lowest + 12}px`;
  $("scale").style.transform =
    `translate(${Math.max(left, 14)}px, ${Math.min(bottom + 12, lowest - 40)}px)`;
  if (content.halfSideMm) {
    const pixelsPerMm = camera.scale / content.halfSideMm;
    const [mm] = [1000, 500, 200, 100, 50, 20, 10, 5, 2, 1, 0.5, 0.2, 0.1].filter(
      (length) => length * pixelsPerMm < 150);
    $("bar").style.width = `${mm * pixelsPerMm}px`;
    $("length").textContent = `${mm} mm`;
  }
  const spread = (light[2] + VIEW[2]) / VIEW[2];
  const [x, y] = camera.screenOf([light[0] / spread, light[1] / spread]);
  $("lamp").style.transform = `translate(${x}px, ${y}px)`;
  $("lamp").hidden = state.compare === "photo" || state.shown !== "relit";
  $("lamp").classList.toggle("held", state.held);
}
