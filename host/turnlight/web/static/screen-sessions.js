import { h, toast, when } from "turnlight/dom.js";
import { ask, attempt } from "turnlight/service.js";

const AT_ONCE = 40;
const AGAIN_MS = 300;

/** Search, open, delete with undo. */
export function screen({ onLeave }) {
  const field = h("input", { id: "words", type: "search", placeholder: "Name or barcode", autocomplete: "off", oninput: later });
  const count = h("p", { class: "lead", role: "status" }, "…");
  const list = h("ul", { class: "card sessions", hidden: true });
  const nothing = h("p", { class: "card nothing", hidden: true });
  const more = h("button", { hidden: true, onclick: () => load(false) }, "Show more");
  let timer, latest = 0;
  load(true);
  onLeave(forget);
  return h("div", { class: "page" }, h("h1", {}, "Sessions"), count,
    h("div", { class: "search" }, h("label", { for: "words" }, "Search"), field), nothing, list, h("div", { class: "row end" }, more));

  function later() {
    forget();
    timer = setTimeout(() => load(true), 150);
  }

  /** What is asked for from now on is all that counts; an answer that comes late is not shown. */
  function forget() {
    clearTimeout(timer);
    return ++latest;
  }

  function load(anew) {
    const asked = forget();
    return attempt(async () => {
      const offset = anew ? 0 : list.childElementCount;
      const query = new URLSearchParams({ words: field.value, offset: String(offset), limit: String(AT_ONCE) });
      const found = await ask("GET", `/sessions?${query}`);
      if (asked !== latest) return;
      count.textContent = (found.total === 1 ? "1 session" : `${found.total} sessions`) + (found.complete ? "" : " so far…");
      if (!found.complete && offset === 0) timer = setTimeout(() => load(true), AGAIN_MS);
      if (anew) list.replaceChildren();
      list.append(...found.sessions.map(line));
      list.hidden = found.total === 0;
      nothing.hidden = !list.hidden;
      nothing.replaceChildren(...(field.value.trim() ? ["No session has these words in its name or barcode."]
        : ["The sessions that you capture will be here. ", h("a", { href: "#/ready" }, "Capture the first")]));
      more.hidden = list.childElementCount >= found.total;
    });
  }

  function line(session) {
    const at = encodeURIComponent(session.name);
    const picture = session.saved > 0 && h("img", { src: `/api/sessions/${at}/maps/preview.jpg`, alt: "", loading: "lazy", width: 64, height: 64 });
    picture?.addEventListener?.("error", () => picture.remove());
    return h("li", {}, h("div", { class: "thumb" }, picture),
      h("a", { href: session.readable ? `#/result/${at}` : undefined }, h("b", {}, session.sample),
        h("small", {}, [when(session.started), session.state, session.barcode].filter(Boolean).map((part) => h("span", {}, part)))),
      h("button", { "aria-label": `Delete ${session.sample} of ${when(session.started)}`, onclick: () => remove(session) }, "Delete"));
  }

  async function remove({ name, sample }) {
    const done = await attempt(() => ask("DELETE", `/sessions/${encodeURIComponent(name)}`));
    if (!done) return;
    await load(true);
    toast(`${sample} is deleted.`, { label: "Undo", run: async () => {
      await attempt(() => ask("POST", `/sessions/${encodeURIComponent(name)}/restore`));
      load(true);
    } });
  }
}
