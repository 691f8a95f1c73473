import { h, percent } from "turnlight/dom.js";
import { ask } from "turnlight/service.js";

/** The live view: what is overexposed, how sharp it is, which markers are seen. */
export function screen({ onLeave }) {
  const image = h("img", { class: "live", alt: "What the camera sees" });
  const clipped = h("dd", {}, "…");
  const markers = h("dd", {}, "…");
  const sharp = h("dd", {}, "…");
  const meter = h("progress", { max: 1, value: 0, "aria-label": "Focus, of the sharpest so far" });
  const problem = h("p", { class: "problem", role: "alert" });
  const led = h("select", { id: "led" });
  let on = true;
  let best = 0;
  ask("GET", "/rig").then(({ leds }) => led.append(...leds.map((_, i) => h("option", { value: String(i) }, `LED ${i}`))), () => {});
  led.addEventListener("change", () => { best = 0; });
  look();
  onLeave(() => { on = false; });
  return h("div", { class: "page" }, h("h1", {}, "Frame"),
    h("p", { class: "lead" }, "Every marker in the picture, the sample sharp, and none of it pink: pink is overexposed."),
    h("div", { class: "looking" },
      h("figure", { class: "card view" }, image),
      h("div", { class: "card" },
        h("label", { for: "led" }, "Light"), led,
        h("dl", { class: "facts" }, h("dt", {}, "Overexposed"), clipped, h("dt", {}, "Markers"), markers,
          h("dt", {}, "Focus"), sharp),
        meter, h("p", { class: "hint" }, "Focus is told in percent of the sharpest so far. Turn the lens until the bar no longer grows."), problem,
        h("div", { class: "row end" }, h("a", { class: "button primary", href: "#/plan" }, "Next: the plan")))));

  async function look() {
    while (on) {
      try {
        const seen = await ask("POST", `/view?led=${led.value || 0}`);
        image.src = `data:image/jpeg;base64,${seen.image}`;
        clipped.textContent = percent(seen.clipped);
        markers.textContent = `${seen.markers_seen} seen`;
        best = Math.max(best, seen.focus);
        meter.value = best ? seen.focus / best : 0;
        sharp.textContent = percent(meter.value, 0);
        problem.textContent = seen.trouble ?? "";
        await pause(250);
      } catch (error) {
        problem.textContent = error.message;
        await pause(2000);
      }
    }
  }
}

const pause = (ms) => new Promise((done) => setTimeout(done, ms));
