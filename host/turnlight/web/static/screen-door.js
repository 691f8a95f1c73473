import { h } from "turnlight/dom.js";
import { ask } from "turnlight/service.js";

/** Asks for the token. */
export function screen(onOpen) {
  const field = h("input", { id: "token", type: "password", autocomplete: "current-password", required: true, autofocus: true });
  const problem = h("p", { class: "problem", role: "alert" });
  const plain = location.protocol === "http:" && !["localhost", "127.0.0.1", "[::1]"].includes(location.hostname);
  const enter = async (event) => {
    event.preventDefault();
    try {
      await ask("POST", "/door", { token: field.value.trim() });
      onOpen();
    } catch (error) {
      problem.textContent = error.status === 401 ? "That is not the token; look for a letter too many or too few." : error.message;
    }
  };
  return h("form", { class: "card door", onsubmit: enter },
    h("h1", {}, "This rig asks for a token"),
    h("p", { class: "hint" }, "It is in the file that the service names at its start."),
    h("div", { class: "field" }, h("label", { for: "token" }, "Token"), field),
    plain && h("p", { class: "warning" }, "This connection is not encrypted: whoever listens on this network can read the token."),
    problem, h("button", { class: "primary" }, "Open"));
}
