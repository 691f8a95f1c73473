import { h } from "turnlight/dom.js";
import { ask } from "turnlight/service.js";

const FORMATS = {
  viewer: ["Viewer", "One HTML file to mail: the material under a lamp"],
  gltf: ["glTF", "For Blender, game engines, the web"],
  materialx: ["MaterialX", "For film and product rendering"],
  folder: ["Folder", "PNG and EXR maps"],
};

/** A session's maps in the form that another program takes. */
export function screen({ argument: name }) {
  const status = h("p", { role: "status" });
  const button = h("button", { class: "primary" }, "Export");
  const form = h("form", { class: "card form", onsubmit: send },
    h("fieldset", { class: "wide" }, h("legend", {}, "Format"), h("div", { class: "choices" },
      Object.entries(FORMATS).map(([key, [label, text]], i) => h("label", { class: "choice" },
        h("input", { type: "radio", name: "format", value: key, checked: i === 0 }),
        h("span", {}, h("b", {}, label), h("small", {}, text)))))),
    h("div", { class: "field" }, h("label", { for: "size" }, "Pixels along a side"),
      h("select", { id: "size", name: "size" }, ["As captured", 256, 512, 1024, 2048].map((size, i) =>
        h("option", { value: i ? String(size) : "" }, String(size))))),
    h("div", { class: "field checks" },
      h("label", {}, h("input", { type: "checkbox", name: "tileable" }), " Edges meet (tileable)"),
      h("label", {}, h("input", { type: "checkbox", name: "height" }), " Height from the normals")),
    h("div", { class: "row end wide" }, h("a", { class: "button", href: `#/result/${encodeURIComponent(name)}` }, "Back"), button),
    h("div", { class: "wide" }, status));
  return h("div", { class: "page narrow" }, h("h1", {}, "Export"), h("p", { class: "lead" }, name), form);

  async function send(event) {
    event.preventDefault();
    const said = new FormData(form);
    button.disabled = true;
    status.textContent = "Making it…";
    try {
      const reply = await ask("POST", `/sessions/${encodeURIComponent(name)}/export`, {
        format: said.get("format"), tileable: said.has("tileable"), height: said.has("height"),
        size_px: said.get("size") ? Number(said.get("size")) : null,
      });
      const [, file] = /filename="([^"]+)"/.exec(reply.headers.get("content-disposition"));
      const address = URL.createObjectURL(await reply.blob());
      h("a", { href: address, download: file }).click();
      setTimeout(() => URL.revokeObjectURL(address), 60000);
      status.textContent = `${file} is in your downloads.`;
    } catch (error) {
      status.textContent = error.message;
    }
    button.disabled = false;
  }
}
