// The phone's page: take photo after photo, hear what is wrong with one, see the material get better.

import { h, s, toast } from "turnlight/dom.js";
import { ask, attempt } from "turnlight/service.js";
import { relit } from "turnlight/relit.js";
import { screen as exporting } from "turnlight/screen-export.js";
import { Uploads } from "turnlight/uploads.js";

const MAPS = ["normal", "diffuse", "roughness", "specular"];
const ACCEPTED = "image/*,.heic,.heif,.dng,.tif,.tiff";
const AGAIN_MS = 1500;

const main = document.getElementById("main");
const uploads = new Uploads(show);
const material = relit();
const maps = MAPS.map((name) => h("figure", {}, h("img", { alt: `${name} map` }), h("figcaption", {}, name)));
const parts = {
  material: h("div", { class: "material" }, h("section", { class: "card", "aria-label": "The material" },
    material.element, h("div", { class: "maps" }, maps))),
  intro: h("section", { class: "card intro" }, h("h2", {}, "Photograph a sample"), h("ol", { class: "steps" },
    step("Lay the printed frame on it.", "turnlight frame makes one to print. All of it has to be in the picture."),
    step("Switch the flash on.", "Draw the curtains if the room is bright."),
    step("Take the first from straight above.", "The frame fills the picture. Then go round it."))),
  said: h("section", { class: "card said", role: "status" }),
  open: h("section", { class: "card", hidden: true }),
  used: h("section", { class: "card", hidden: true }),
  more: h("section", { class: "card" }),
  exported: h("a", { class: "button primary" }, "Export the maps"),
};
const page = h("div", { class: "hand" }, parts.said, parts.material,
  h("div", { class: "rest" }, parts.intro, parts.open, parts.used, parts.exported, parts.more));
let state = null;
let shownMaps = null;
let newest = { photo: 0, refusal: 0, isRefusal: false };

start();

async function start() {
  const token = location.hash.startsWith("#/") ? "" : location.hash.slice(1);
  if (token) {
    await ask("POST", "/door", { token }).catch(() => {});
    history.replaceState(null, "", "/"); // where nobody reads it over a shoulder, and no history keeps it
  }
  const { open } = await ask("GET", "/door").catch(() => ({ open: true }));
  if (!open) {
    main.replaceChildren(h("section", { class: "card narrow" }, h("h2", {}, "Open the link again"),
      h("p", {}, "This page is for who has the link. Point the camera at the code that turnlight handheld shows on the computer; each start makes a new one.")));
    return;
  }
  addEventListener("hashchange", route);
  buttons();
  route();
  follow();
}

/** Asks for what is new, again and again; a phone that slept just goes on. */
async function follow() {
  let version = -1;
  const line = document.getElementById("link");
  for (;;) {
    try {
      state = await ask("GET", `/handheld?after=${version}`);
      line.textContent = "";
      if (version === -1) once();
      version = state.version;
      uploads.limit = state.largest_upload;
      show();
    } catch (error) {
      if (error.status === 401) return location.reload();
      line.textContent = "Not connected; trying again…";
      line.className = "lost";
      await new Promise((done) => setTimeout(done, AGAIN_MS));
    }
  }
}

function route() {
  const [, screen, name = ""] = location.hash.split("/");
  main.replaceChildren(screen === "export" ? exporting({ argument: decodeURIComponent(name) }) : page);
  document.getElementById("shoot").hidden = screen === "export";
  scrollTo(0, 0);
}

/** What does not change. */
function once() {
  document.getElementById("sample").textContent = state.sample;
  document.title = `${state.sample} – Turnlight`;
  parts.exported.href = `#/export/${encodeURIComponent(state.session)}`;
  const wide = matchMedia("(min-width: 60rem)").matches;
  parts.more.replaceChildren(h("details", {
    open: wide && state.photos.length === 0,
    ontoggle: ({ target }) => { if (target.open && !wide) target.scrollIntoView({ block: "nearest" }); },
  },
    h("summary", {}, "With a phone, or another one"),
    h("p", {}, "Point its camera at this. Both may take photos at the same time."),
    h("img", { class: "qr", src: "/api/link.svg", alt: "QR code of this page's link", width: 240, height: 240 }),
    h("p", { class: "address" }, state.link)));
}

function show() {
  if (!state) return;
  const photos = [...state.photos].reverse();
  const used = photos.filter((photo) => photo.used);
  const unused = photos.filter((photo) => !photo.used);
  parts.intro.hidden = photos.length > 0 || state.arrivals.length > 0 || uploads.pending.length > 0;
  parts.material.hidden = state.maps === null;
  parts.exported.hidden = state.maps === null;
  tell(photos);
  const refusals = state.arrivals.filter(({ turn }) => turn === "refused").reverse();
  const open = () => [...uploads.pending.map(sending), ...refusals.map(refused), ...unused.map(notUsed)];
  parts.open.hidden = uploads.pending.length + refusals.length + unused.length === 0;
  anew(parts.open, [uploads.pending.map(({ failed }) => failed), state.arrivals, unused], () => [
    h("h2", {}, uploads.pending.length ? "On their way" : "Not used"), h("ul", { class: "rows" }, open())]);
  parts.used.hidden = used.length === 0;
  anew(parts.used, used, () => [
    h("h2", {}, used.length === 1 ? "One photo is used" : `${used.length} photos are used`),
    h("div", { class: "used" }, used.map((photo) => h("button", {
      class: photo.sentences.length || photo.warning ? "forced" : "", "aria-label": `Photo ${photo.number}, ${photo.name}`, onclick: () => look(photo),
    }, thumbnail(photo), h("span", {}, String(photo.number)))))]);
  if (state.maps !== null && state.maps !== shownMaps) {
    shownMaps = state.maps;
    const at = `/api/sessions/${encodeURIComponent(state.session)}/maps`;
    maps.forEach((figure, i) => { figure.firstChild.src = `${at}/${MAPS[i]}.jpg?v=${state.maps}`; });
    attempt(async () => {
      await material.load(state.session);
      parts.material.dataset.maps = state.maps;
    });
  }
}

/** A part made anew if what it shows has changed: a button that is being pressed stays where it is. */
function anew(part, shown, make) {
  const key = JSON.stringify(shown);
  if (part.dataset.key === key) return;
  part.dataset.key = key;
  part.replaceChildren(...make());
}

/** The one thing to know now. */
function tell(photos) {
  const [latest] = photos;
  const refusal = state.arrivals.findLast(({ turn }) => turn === "refused");
  if ((refusal?.number ?? 0) > newest.refusal) newest = { ...newest, refusal: refusal.number, isRefusal: true };
  if ((latest?.number ?? 0) > newest.photo) newest = { ...newest, photo: latest.number, isRefusal: false };
  const busy = state.arrivals.filter(({ turn }) => turn !== "refused").length + uploads.pending.filter(({ failed }) => !failed).length;
  const used = photos.filter((photo) => photo.used).length;
  const [kind, title, text] =
    busy > 0 ? ["busy", busy === 1 ? "Looking at the photo…" : `Looking at ${busy} photos…`, "You may take the next one meanwhile."]
    : refusal && newest.isRefusal ? ["bad", "That file cannot be used", refusal.sentence]
    : !latest ? ["", "", ""]
    : latest.used ? ["good", `Photo ${latest.number} is used`, latest.warning ?? next(used)]
    : ["bad", `Photo ${latest.number} is not used`, latest.sentences[0]];
  parts.said.hidden = photos.length === 0 && busy === 0 && !refusal;
  parts.said.className = `card said ${kind}`;
  anew(parts.said, [title, text], () => [
    busy ? h("span", { class: "spinner", "aria-hidden": "true" }) : "", h("p", {}, h("b", {}, title), text)]);
}

function next(used) {
  if (used < 2) return "Now from another side, at about 45°.";
  if (used < 5) return `Go on round the sample; ${5 - used} more make good maps.`;
  return "Enough for good maps; more make them better.";
}

function sending(upload) {
  const bar = h("progress", { max: 1, value: upload.share, "aria-label": "Sent" });
  upload.progressed = (share) => { bar.value = share; };
  return h("li", {}, h("span", { class: "shot", "aria-hidden": "true" }, "↑"),
    h("p", {}, h("b", {}, upload.file.name), h("br"), upload.failed ?? "Sending…"),
    upload.failed ? h("div", { class: "row" },
      upload.again && h("button", { class: "primary", onclick: () => uploads.retry(upload) }, "Send again"),
      h("button", { onclick: () => uploads.forget(upload) }, "Leave it"))
      : bar);
}

function refused(arrival) {
  return h("li", {}, h("span", { class: "shot", "aria-hidden": "true" }, "!"), h("p", { class: "problem" }, arrival.sentence),
    h("div", { class: "row" }, h("button", { onclick: () => attempt(() => ask("POST", `/arrivals/${arrival.number}/dismiss`)) }, "All right")));
}

function notUsed(photo) {
  return h("li", {}, thumbnail(photo), h("p", {}, h("b", {}, `Photo ${photo.number}`), h("br"), photo.sentences[0] ?? "Left out."),
    photo.can_be_forced && h("div", { class: "row" }, h("button", {
      onclick: ({ currentTarget }) => { currentTarget.disabled = true; change(photo, "force"); },
    }, photo.sentences.length ? "Use it all the same" : "Use it again")));
}

function thumbnail(photo) {
  return h("img", { class: "shot", src: `/api/photos/${photo.number}.jpg`, alt: "", loading: "lazy", width: 72, height: 72 });
}

function look(photo) {
  const dialog = h("dialog", { "aria-label": `Photo ${photo.number}`, onclose: () => dialog.remove() },
    h("img", { src: `/api/photos/${photo.number}.jpg`, alt: `Photo ${photo.number}` }),
    h("b", {}, `Photo ${photo.number}`), h("p", { class: "hint" }, photo.name), [...photo.sentences, ...(photo.warning ? [photo.warning] : [])].map((text) => h("p", { class: "warning" }, text)),
    h("form", { method: "dialog", class: "row" },
      h("button", { onclick: () => change(photo, "leave-out") }, "Leave it out"), h("button", { class: "primary" }, "Keep it")));
  document.body.append(dialog);
  dialog.showModal();
}

async function change(photo, verb) {
  const done = await attempt(() => ask("POST", `/photos/${photo.number}/${verb}`));
  if (done) toast(verb === "force" ? `Photo ${photo.number} is used.` : `Photo ${photo.number} is left out.`);
}

function buttons() {
  const bar = document.getElementById("shoot");
  const camera = s("svg", { viewBox: "0 0 24 24", "aria-hidden": "true" },
    s("path", { d: "M3 8h4l2-3h6l2 3h4v11H3z" }), s("circle", { cx: 12, cy: 13, r: 3.6 }));
  const field = (attributes) => h("input", { type: "file", accept: ACCEPTED, ...attributes, onchange: ({ target }) => {
    uploads.add([...target.files]);
    target.value = "";
  } });
  bar.replaceChildren(
    h("label", { class: "button primary" }, camera, "Take a photo", field({ capture: "environment" })),
    h("label", { class: "button" }, "Choose", field({ multiple: true })));
  bar.hidden = false;
}

function step(title, text) {
  return h("li", {}, h("span", {}, h("b", {}, title), text));
}
