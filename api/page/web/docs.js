// The calls of this service, from its own /openapi.json, to read and to try. Texts of the document and of answers become text nodes.

import { el, fill } from "./dom.js";
import { authorized, isUnreachable, useToken } from "./service.js";
import { themeChoice } from "./theme.js";

/**
 * Parts of an OpenAPI document, as far as they are read.
 * @typedef {{ [word: string]: any }} Schema
 * @typedef {{ name: string, in: "path" | "query" | "header", required?: boolean, description?: string, schema: Schema }} Parameter
 * @typedef {{ method: string, path: string, id: string, tag: string, brief: string, text: string, parameters: Parameter[], body?: { type: string, schema: Schema, example?: unknown, required: boolean }, responses: { [status: string]: any } }} Call
 */

/** Headers of an answer that callers use. */
const HEADERS = ["content-type", "etag", "location", "retry-after", "x-request-id", "allow", "www-authenticate", "deprecation"];

/** What is looked for first comes first. */
const FIRST = ["plan", "missions"];
/** As much of an answer is shown, characters. */
const SHOWN_MAX = 200_000;

const main = /** @type {HTMLElement} */ (document.getElementById("main"));
/** @type {{ [name: string]: Schema }} */
let shapes = {};

/** Text with its `code`. @param {string} [text] */
function prose(text = "") {
  return text.split("`").map((part, i) => (i % 2 ? el("code", {}, part) : part));
}

/** @param {any} document @returns {Call[]} */
function callsOf(document) {
  return Object.entries(document.paths).flatMap(([path, item]) => Object.entries(item).map(([method, call]) => {
    const [type, content] = Object.entries(call.requestBody?.content ?? {})[0] ?? [];
    const body = type ? { type, schema: content.schema, example: content.example, required: Boolean(call.requestBody.required) } : undefined;
    return { method, path, id: call.operationId, tag: call.tags?.[0] ?? "other", brief: call.summary ?? "", text: call.description ?? "", parameters: call.parameters ?? [], body, responses: call.responses };
  }));
}

/** The schema that is meant, and the name that it has. @param {Schema} schema @returns {[Schema, string]} */
function resolved(schema) {
  const name = schema?.$ref?.split("/").pop() ?? "";
  return name ? [shapes[name] ?? {}, name] : [schema ?? {}, ""];
}

/** What a value may be, in words. @param {Schema} schema @returns {string} */
function kindOf(schema) {
  const [meant, name] = resolved(schema);
  if (name) return name;
  const some = (meant.oneOf ?? meant.anyOf)?.filter((/** @type {Schema} */ one) => one.type !== "null");
  if (some?.length) return [...new Set(some.map(kindOf))].join(" or ");
  if (meant.const !== undefined) return JSON.stringify(meant.const);
  if (meant.enum) return meant.enum.map((/** @type {unknown} */ value) => JSON.stringify(value)).join(" | ");
  const kinds = [meant.type].flat().filter((kind) => kind !== "null");
  if (kinds[0] === "array") return `list of ${kindOf(meant.items ?? {})}`;
  return kinds.join(" or ") || "any";
}

/** Range, length and default, in words. @param {Schema} schema */
function limitsOf(schema) {
  const from = schema.minimum ?? schema.minItems ?? schema.minLength, to = schema.maximum ?? schema.maxItems ?? schema.maxLength;
  const of = schema.maxItems !== undefined ? " items" : schema.maxLength !== undefined ? " characters" : "";
  const range = from !== undefined && to !== undefined ? `${from} to ${to}${of}` : to !== undefined ? `at most ${to}${of}` : from !== undefined ? `from ${from}${of}` : "";
  return [range, schema.default !== undefined && `default ${JSON.stringify(schema.default)}`].filter(Boolean).join(", ");
}

/** The schema whose members are shown for `schema`: its own, that of its items, or the only one that is not null. @param {Schema} schema @returns {Schema} */
function withMembers(schema) {
  const [meant] = resolved(schema);
  if (meant.items) return withMembers(meant.items);
  const some = (meant.oneOf ?? meant.anyOf)?.filter((/** @type {Schema} */ one) => one.type !== "null") ?? [];
  if (!meant.properties && some.length === 1) return withMembers(some[0]);
  if (!meant.properties && typeof meant.additionalProperties === "object") return withMembers(meant.additionalProperties);
  return meant;
}

/**
 * The members of a shape. Those of members are made when they are opened: a shape may hold itself.
 * @param {Schema} schema @returns {HTMLElement}
 */
function membersOf(schema) {
  const meant = withMembers(schema);
  const parts = meant.properties ? [meant] : [...(meant.allOf ?? []), ...(meant.oneOf ?? meant.anyOf ?? [])].map(withMembers);
  const rows = parts.flatMap((part) => Object.entries(part.properties ?? {}).map(([name, member]) => {
    const [its] = resolved(member), limits = limitsOf(its), must = part.required?.includes(name);
    const head = [el("code", {}, name), " ", el("small", {}, kindOf(member), limits && `, ${limits}`), must && el("span", { class: "must" }, " required")];
    const about = el("div", {}, prose(member.description ?? its.description));
    const inner = withMembers(member);
    if (!inner.properties && !inner.oneOf && !inner.allOf) return el("li", {}, head, about);
    const place = el("div", {});
    const more = el("details", { ontoggle: () => { if (more.open && !place.firstChild) place.append(membersOf(member)); } }, el("summary", {}, head), about, place);
    return el("li", {}, more);
  }));
  return rows.length ? el("ul", {}, rows) : el("p", {}, el("small", {}, kindOf(schema)));
}

/** A first body of a schema: what is required. @param {Schema} schema @returns {unknown} */
function skeleton(schema) {
  const [meant] = resolved(schema);
  if (meant.example !== undefined) return meant.example;
  if (meant.default !== undefined) return meant.default;
  if (meant.const !== undefined) return meant.const;
  if (meant.enum) return meant.enum[0];
  if (meant.properties) return Object.fromEntries((meant.required ?? []).map((/** @type {string} */ name) => [name, skeleton(meant.properties[name])]));
  const some = meant.oneOf ?? meant.anyOf ?? meant.allOf;
  if (some) return skeleton(some[0]);
  const [kind] = [meant.type].flat();
  return { array: [], object: {}, string: "", boolean: false, number: meant.minimum ?? 0, integer: meant.minimum ?? 0 }[/** @type {string} */ (kind)] ?? null;
}

/** The text that a body begins with. A time 0 in an example means now. @param {Call["body"]} body */
function firstBody(body) {
  if (!body || body.type === "application/octet-stream") return "";
  const now = Math.floor(Date.now() / 1000);
  return JSON.stringify(body.example ?? skeleton(body.schema), (name, value) => (name === "t_s" && value === 0 ? now : value), 1);
}

/** @param {string} text */
function quoted(text) {
  return `'${text.replaceAll("'", "'\\''")}'`;
}

/** @param {string} text */
function pretty(text) {
  try {
    return JSON.stringify(JSON.parse(text), null, 2);
  } catch {
    return text;
  }
}

/** The form of a call, and its answer. @param {Call} call */
function form(call) {
  const fields = call.parameters.map((parameter) => ({ parameter, input: el("input", { required: Boolean(parameter.required), value: parameter.in === "header" ? "" : String(parameter.schema.default ?? parameter.schema.enum?.[0] ?? ""), autocomplete: "off", spellcheck: false }) }));
  const text = call.body && el("textarea", { spellcheck: false, autocomplete: "off", value: firstBody(call.body), oninput: () => write() });
  const curl = el("pre", { class: "curl", tabIndex: 0, "aria-label": "curl" }), said = el("span", { class: "said", role: "status" }), answer = el("div", { class: "answer", role: "status" });
  const request = () => {
    const headers = new Headers(), query = new URLSearchParams();
    let path = call.path;
    for (const { parameter, input } of fields) {
      const value = input.value.trim();
      if (parameter.in === "path") path = path.replace(`{${parameter.name}}`, value ? encodeURIComponent(value) : `{${parameter.name}}`);
      else if (value && parameter.in === "query") query.append(parameter.name, value);
      else if (value) headers.set(parameter.name, value);
    }
    const body = text?.value ? text.value : undefined;
    if (body !== undefined && call.body) headers.set("content-type", call.body.type);
    return { url: path + (query.size ? `?${query}` : ""), headers, body };
  };
  const write = () => {
    const { url, headers, body } = request(), method = call.method.toUpperCase();
    const needsToken = authorized().has("authorization") && ["-H \"authorization: Bearer $TOKEN\""];
    const words = ["curl -s", method !== "GET" && `-X ${method}`, quoted(location.origin + url), needsToken, [...headers].map(([name, value]) => `-H ${quoted(`${name}: ${value}`)}`), body !== undefined && `--data-binary ${quoted(body)}`];
    fill(curl, words.flat().filter(Boolean).join(" "));
  };
  let running = /** @type {AbortController | null} */ (null);
  const stop = el("button", { type: "button", hidden: true, onclick: () => running?.abort() }, "Stop");
  const send = async (/** @type {Event} */ event) => {
    event.preventDefault();
    running?.abort();
    const mine = running = new AbortController();
    const { url, headers, body } = request(), began = performance.now();
    stop.hidden = false;
    fill(answer, el("p", { class: "loading" }, "Sent…"));
    try {
      const got = await fetch(url, { method: call.method.toUpperCase(), headers: authorized(headers), body, signal: mine.signal });
      await show(got, performance.now() - began, answer);
    } catch (error) {
      if (running === mine) fill(answer, el("p", { class: "notice" }, mine.signal.aborted ? "Stopped." : isUnreachable(error) ? "The service does not answer." : String(error)));
    } finally {
      if (running === mine) stop.hidden = true;
    }
  };
  const copy = async () => {
    await navigator.clipboard?.writeText(curl.textContent ?? "").then(() => fill(said, "copied"), () => fill(said, "select the line to copy it"));
  };
  const element = el("form", { class: "call-form", onsubmit: send, oninput: write },
    fields.map(({ parameter, input }) => el("label", {}, el("span", {}, el("code", {}, parameter.name), " ", el("small", {}, [parameter.in, kindOf(parameter.schema), limitsOf(parameter.schema), parameter.required && "required"].filter(Boolean).join(", "))), input, el("small", {}, prose(parameter.description)))),
    text && el("label", {}, el("span", {}, "Body ", el("small", {}, call.body?.type)), text),
    el("span", { class: "row" }, el("button", { type: "submit", class: call.method === "delete" ? "danger" : "primary" }, "Try it"), stop, el("button", { type: "button", onclick: copy }, "Copy as curl"), said), answer, curl);
  write();
  return element;
}

/** Shows an answer as it comes, up to `SHOWN_MAX`. @param {Response} got @param {number} ms @param {HTMLElement} place */
async function show(got, ms, place) {
  const type = got.headers.get("content-type") ?? "", state = el("span", { class: `chip state ${got.ok ? "good" : "bad"}` }, `${got.status} ${got.statusText}`);
  const size = el("small", {}), text = el("pre", { tabIndex: 0, "aria-label": "Answer" });
  const headers = HEADERS.filter((name) => got.headers.has(name)).map((name) => `${name}: ${got.headers.get(name)}`);
  fill(place, el("p", {}, state, ` ${ms.toFixed(0)} ms `, size), headers.length > 0 && el("pre", { tabIndex: 0, "aria-label": "Headers" }, headers.join("\n")), text);
  if (!/json|text|xml|csv/.test(type)) {
    const bytes = (await got.arrayBuffer()).byteLength;
    fill(text, bytes ? `${bytes} bytes, not text: see the curl line` : "no body");
    return;
  }
  const reader = /** @type {ReadableStream<Uint8Array>} */ (got.body).getReader(), decoder = new TextDecoder();
  let all = "";
  for (;;) {
    const { done, value } = await reader.read();
    if (done) break;
    all += decoder.decode(value, { stream: true });
    fill(text, all.slice(0, SHOWN_MAX));
    if (all.length > SHOWN_MAX) {
      await reader.cancel();
      fill(size, `, the first ${SHOWN_MAX} characters`);
      return;
    }
  }
  if (/json$/.test(type.split(";")[0])) fill(text, pretty(all));
}

/** @param {Call} call */
function callView(call) {
  const place = el("div", { class: "call-body" });
  const open = () => {
    if (!view.open || place.firstChild) return;
    const ok = Object.entries(call.responses).find(([status]) => status.startsWith("2"));
    const shape = ok && Object.values(ok[1].content ?? {})[0]?.schema;
    place.append(
      el("div", { class: "shape" }, el("p", {}, prose(call.text)), call.body && [el("h3", {}, "Body ", el("small", {}, kindOf(call.body.schema))), membersOf(call.body.schema)],
        shape && [el("h3", {}, "Answer ", el("small", {}, kindOf(shape))), el("details", {}, el("summary", {}, "Members"), membersOf(shape))],
        el("h3", {}, "Statuses"), el("ul", {}, Object.entries(call.responses).map(([status, { description }]) => el("li", {}, el("code", {}, status), " ", prose(description))))),
      form(call));
  };
  const view = el("details", { class: "call panel", id: call.id, ontoggle: open }, el("summary", {}, el("span", { class: `verb ${call.method}` }, call.method.toUpperCase()), el("code", {}, call.path), el("span", { class: "brief" }, prose(call.brief))), place);
  return view;
}

/** @param {any} document */
function showAll(document) {
  shapes = document.components?.schemas ?? {};
  const calls = callsOf(document).map((call) => ({ call, view: callView(call), words: [call.method, call.path, call.tag, call.brief, call.text].join(" ").toLowerCase() }));
  const sections = [...new Set(calls.map(({ call }) => call.tag))].sort((a, b) => (FIRST.indexOf(a) >>> 0) - (FIRST.indexOf(b) >>> 0)).map((tag) => ({ tag, element: el("section", {}, el("h2", {}, tag), calls.filter(({ call }) => call.tag === tag).map(({ view }) => view)) }));
  const found = el("span", { class: "said", role: "status" });
  const filter = () => {
    const wanted = search.value.toLowerCase().split(/\s+/).filter(Boolean);
    for (const { view, words } of calls) view.hidden = !wanted.every((word) => words.includes(word));
    for (const { tag, element } of sections) element.hidden = calls.every(({ call, view }) => call.tag !== tag || view.hidden);
    fill(found, wanted.length ? `${calls.filter(({ view }) => !view.hidden).length} of ${calls.length} calls` : "");
  };
  const search = el("input", { type: "search", oninput: filter });
  const token = el("input", { type: "password", autocomplete: "current-password", placeholder: authorized().has("authorization") ? "in use" : "none", onchange: () => { useToken(token.value.trim()); fill(found, token.value.trim() ? "The token is used in this tab." : "No token is used."); } });
  fill(main, el("div", { class: "docs" }, el("h1", {}, `${document.info.title} `, el("small", {}, document.info.version)), el("p", {}, prose(document.info.description)),
    el("div", { class: "docs-head" }, el("label", { class: "search" }, "Search", search), el("label", {}, "Token, if the service requires one", token), found), sections.map(({ element }) => element)));
  const toAddress = () => {
    const view = calls.find(({ call }) => `#${call.id}` === location.hash)?.view;
    if (!view) return;
    search.value = "";
    filter();
    view.open = true;
    view.scrollIntoView();
  };
  addEventListener("hashchange", toAddress);
  toAddress();
}

document.getElementById("theme-place")?.append(themeChoice());
fill(main, el("p", { class: "loading", role: "status" }, "Loading…"));
fetch("/openapi.json").then((answer) => answer.json()).then(showAll).catch((error) => fill(main, el("p", { class: "notice", role: "alert" }, `The service's description could not be read: ${error}`)));
