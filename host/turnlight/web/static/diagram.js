// Rings and table from above: which LED and which table angle each shot has.

import { h, s } from "turnlight/dom.js";

const R = 88;

/** state: { current, taken: Set, shots } */
export function diagram(rig) {
  const lamps = rig.leds.map(({ x, y }) => s("circle", { cx: R * x, cy: -R * y, r: 4, class: "led" }));
  const spokes = s("g", { class: "spokes" });
  const sample = s("g", { class: "sample" },
    s("circle", { r: 26, class: "platter" }), s("rect", { x: -14, y: -14, width: 28, height: 28, rx: 2 }),
    s("path", { d: "M0 -26v6", class: "mark" }));
  const { x, y } = rig.camera;
  const picture = s("svg", { viewBox: "-100 -100 200 200", class: "diagram", role: "img", "aria-label": "LEDs and table from above" },
    s("circle", { r: R, class: "ring" }), s("circle", { r: inner(rig), class: "ring" }), spokes, sample, lamps,
    s("g", { class: "camera", transform: `translate(${R * x} ${-R * y})` },
      s("rect", { x: -8, y: -5.5, width: 16, height: 11, rx: 2 }), s("circle", { r: 3.2 })));
  return { picture, draw };

  function draw({ shots, taken, current }) {
    lamps.forEach((lamp, number) => {
      const uses = shots.filter((shot) => shot.leds.includes(number));
      const lit = uses.some((shot) => shot.number === current);
      const done = uses.length > 0 && uses.every((shot) => taken.has(shot.number));
      lamp.setAttribute("class", `led ${lit ? "lit" : done ? "done" : uses.length ? "planned" : ""}`);
      lamp.setAttribute("r", lit ? 7 : uses.length ? 5 : 3);
    });
    spokes.replaceChildren(...shots.map(({ angle_deg: angle, number }) =>
      s("path", { d: "M0 -30V-36", transform: `rotate(${-angle})`, class: taken.has(number) ? "done" : "" })));
    const now = shots.find((shot) => shot.number === current);
    if (now) sample.style.transform = `rotate(${-now.angle_deg}deg)`;
  }
}

/** What the LEDs' colours mean: words by class. */
export function legend(words) {
  return h("p", { class: "legend hint" }, Object.entries(words).map(([kind, text]) => h("span", {}, h("i", { class: kind }), text)));
}

function inner({ leds }) {
  return R * Math.min(...leds.map(({ x, y }) => Math.hypot(x, y)));
}
