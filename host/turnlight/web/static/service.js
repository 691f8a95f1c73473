// The service: requests that tell the technician why not, and the event stream, which comes back by itself.

import { toast } from "turnlight/dom.js";

const SILENT_MS = 13000;

export class Refusal extends Error {
  constructor(status, sentence) {
    super(sentence);
    this.status = status;
  }
}

/** JSON, or the Response itself if it is none. @throws {Refusal} with the service's sentence. */
export async function ask(method, path, body) {
  let reply;
  try {
    reply = await fetch(`/api${path}`, {
      method,
      headers: body === undefined ? {} : { "content-type": "application/json" },
      body: body === undefined ? undefined : JSON.stringify(body),
    });
  } catch {
    throw new Refusal(0, "The rig's computer does not answer; see that it is on and that you are in its network.");
  }
  const isJson = reply.headers.get("content-type")?.includes("json");
  const content = isJson ? await reply.json() : reply;
  if (!reply.ok) throw new Refusal(reply.status, sentence(content));
  return content;
}

/** Does it, and says so if it was refused, unless for want of the token: the door says that. True if it was done. */
export async function attempt(work) {
  try {
    await work();
    return true;
  } catch (error) {
    if (error.status !== 401) toast(error.message);
    return false;
  }
}

function sentence({ detail }) {
  if (typeof detail === "string") return detail;
  const [first] = detail ?? [];
  return first ? `${first.loc.at(-1)}: ${first.msg}.` : "The service refused.";
}

/** Calls back with every event, and with whether we are connected. */
export function listen(onEvent, onLink) {
  let wait = 500;
  let socket;
  let silence;
  const heard = () => {
    clearTimeout(silence);
    silence = setTimeout(() => socket.close(), SILENT_MS);
  };
  const connect = () => {
    socket = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/api/events`);
    socket.onopen = () => { wait = 500; heard(); onLink(true); };
    socket.onmessage = ({ data }) => {
      heard();
      const event = JSON.parse(data);
      if (event.kind !== "alive") onEvent(event);
    };
    socket.onclose = () => {
      clearTimeout(silence);
      onLink(false);
      setTimeout(connect, wait);
      wait = Math.min(wait * 1.6, 5000);
    };
  };
  addEventListener("online", () => socket.readyState > 1 && (wait = 500));
  connect();
}
