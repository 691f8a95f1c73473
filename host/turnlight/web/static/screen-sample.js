import { h } from "turnlight/dom.js";
import { ask, attempt } from "turnlight/service.js";

/** Name or barcode, operator, preset, size and thickness; the service remembers them. */
export function screen() {
  const form = h("form", { class: "card form", onsubmit: save });
  const problem = h("p", { class: "problem", role: "alert" });
  load();
  return h("div", { class: "page narrow" }, h("h1", {}, "Sample"),
    h("p", { class: "lead" }, "Lay it flat inside the markers, its front to you."), form);

  async function load() {
    await attempt(async () => {
      const [now, rig] = await Promise.all([ask("GET", "/sample"), ask("GET", "/rig")]);
      const text = (name, label, options = {}) => field(name, label,
        h("input", { id: name, name, value: now[name], maxlength: 80, autocomplete: "off", ...options }));
      const number = (name, label, max, min) => field(name, label,
        h("input", { id: name, name, type: "number", inputmode: "decimal", step: "any", min, max, value: now[name], required: true }));
      form.replaceChildren(
        text("name", "Name", { required: true, autofocus: true, enterkeyhint: "next" }),
        text("barcode", "Barcode", { onkeydown: scanned, placeholder: "Scan, or leave empty" }),
        text("operator", "Operator"),
        h("div", { class: "pair" }, number("side_mm", "Side, mm", rig.largest_side_mm, 1), number("thickness_mm", "Thickness, mm", 50, 0)),
        h("fieldset", { class: "wide" }, h("legend", {}, "Preset"), h("div", { class: "choices" },
          Object.entries(rig.presets).map(([key, preset]) => h("label", { class: "choice" },
            h("input", { type: "radio", name: "preset", value: key, checked: key === now.preset }),
            h("span", {}, h("b", {}, key), h("small", {}, [preset.title, `${preset.shots} shots`].filter(Boolean).join(", "))))))),
        h("div", { class: "wide" }, problem),
        h("div", { class: "row end wide" }, h("a", { class: "button", href: "#/frame" }, "Look through the camera"),
          h("button", { class: "primary" }, "Next: the plan")));
    });
  }

  /** A scanner ends with Enter, which is not meant to send the form. */
  function scanned(event) {
    if (event.key !== "Enter") return;
    event.preventDefault();
    if (["", "sample"].includes(form.elements.name.value.trim())) form.elements.name.value = event.target.value;
    form.elements.operator.focus();
  }

  async function save(event) {
    event.preventDefault();
    const said = Object.fromEntries(new FormData(form));
    const sent = { ...said, side_mm: Number(said.side_mm), thickness_mm: Number(said.thickness_mm) };
    try {
      await ask("PUT", "/sample", sent);
      location.hash = "#/plan";
    } catch (error) {
      problem.textContent = error.message;
    }
  }
}

function field(id, label, input) {
  return h("div", { class: "field" }, h("label", { for: id }, label), input);
}
