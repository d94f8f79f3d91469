// Calls the service of this page, with the user's token if it requires one.

/**
 * @typedef {{ pointer?: string, parameter?: string, code: string, detail: string, given?: unknown, limit?: unknown }} FieldError
 * @typedef {{ type: string, title: string, status: number, detail: string, code: string, errors: FieldError[] }} ProblemDocument
 */

/** Longest silence of an event stream: a comment comes every 15 s. */
const SILENCE_MAX_MS = 40_000;
const PATIENCE_MS = 1_000;
const PATIENCE_MAX_MS = 10_000;
/** Timeout of a short answer, ms. */
const ANSWER_MAX_MS = 15_000;
/** A page that is hidden for so long closes its stream: a browser shares six connections among its tabs. */
const HIDDEN_MAX_MS = 10_000;

/** A refusal of the service. */
export class Refusal extends Error {
  /** @param {ProblemDocument} problem */
  constructor(problem) {
    super(problem.detail || problem.title);
    this.problem = problem;
  }
}

/** Whether it is fetch's own error: the service cannot be reached, or does not answer in time. @param {unknown} error */
export function isUnreachable(error) {
  return error instanceof TypeError || (error instanceof DOMException && ["AbortError", "NetworkError", "TimeoutError"].includes(error.name));
}

/** The token is kept in this tab only. */
const TOKEN = "token";

/** Asks the user for a token. The page's shell replaces this. */
export const door = {
  /** @type {(refused: boolean) => Promise<void>} */
  ask: () => Promise.reject(new Error("a token is required")),
};

/** @param {string} token none if it is empty */
export function useToken(token) {
  if (token) sessionStorage.setItem(TOKEN, token);
  else sessionStorage.removeItem(TOKEN);
}

/** `headers` with the token of this tab, if there is one. @param {HeadersInit} [headers] */
export function authorized(headers) {
  const all = new Headers(headers), token = sessionStorage.getItem(TOKEN);
  if (token) all.set("authorization", `Bearer ${token}`);
  return all;
}

/**
 * Fetches `path`. A refusal throws a `Refusal`; an unreachable service throws the error of fetch.
 * @param {string} path
 * @param {RequestInit} [options]
 * @returns {Promise<Response>}
 */
export async function ask(path, options = {}) {
  for (;;) {
    const headers = authorized(options.headers);
    const answer = await fetch(path, { ...options, headers });
    if (answer.ok) return answer;
    if (answer.status === 401) {
      await door.ask(headers.has("authorization"));
      continue;
    }
    throw new Refusal(await problemOf(answer));
  }
}

/**
 * @param {Response} answer
 * @returns {Promise<ProblemDocument>}
 */
async function problemOf(answer) {
  const nothing = { type: "about:blank", title: `HTTP ${answer.status}`, status: answer.status, detail: "", code: "http", errors: [] };
  try {
    return { ...nothing, ...(await answer.json()) };
  } catch {
    return nothing;
  }
}

/**
 * @param {string} path
 * @param {RequestInit} [options]
 * @returns {Promise<any>}
 */
export async function askJson(path, options) {
  const late = new AbortController(), timer = setTimeout(() => late.abort(new DOMException(`no answer in ${ANSWER_MAX_MS / 1000} s`, "TimeoutError")), ANSWER_MAX_MS);
  const signal = options?.signal ? AbortSignal.any([options.signal, late.signal]) : late.signal;
  try {
    return await (await ask(path, { ...options, signal })).json();
  } finally {
    clearTimeout(timer);
  }
}

/**
 * Posts JSON. With a `key` a repeated request is carried out once.
 * @param {string} path
 * @param {unknown} body a text is sent as it is
 * @param {{ key?: string, ifMatch?: number, method?: string, signal?: AbortSignal }} [how]
 * @returns {Promise<any>}
 */
export function send(path, body, { key, ifMatch, method = "POST", signal } = {}) {
  const headers = new Headers();
  if (body !== undefined) headers.set("content-type", "application/json");
  if (key) headers.set("idempotency-key", key);
  if (ifMatch) headers.set("if-match", `"${ifMatch}"`);
  return askJson(path, { method, headers, signal, body: typeof body === "string" || body === undefined ? body : JSON.stringify(body) });
}

/** A new idempotency key. */
export function freshKey() {
  return Array.from(crypto.getRandomValues(new Uint8Array(12)), (byte) => byte.toString(16).padStart(2, "0")).join("");
}

/**
 * The lines of a text as they arrive.
 * @param {Response} answer
 * @returns {AsyncGenerator<string[], void>}
 */
export async function* lines(answer) {
  if (!answer.body) return;
  // Not every browser iterates a stream with `for await`.
  const reader = answer.body.pipeThrough(new TextDecoderStream()).getReader();
  let rest = "";
  try {
    for (;;) {
      const { done, value } = await reader.read();
      if (done) break;
      const parts = (rest + value).split("\n");
      rest = parts.pop() ?? "";
      if (parts.length) yield parts;
    }
    if (rest) yield [rest];
  } finally {
    reader.cancel().catch(() => {});
  }
}

/**
 * Waits before the next attempt: longer each time, until `served` reports a success.
 */
export class Patience {
  constructor() {
    this.ms = PATIENCE_MS;
  }

  served() {
    this.ms = PATIENCE_MS;
  }

  async wait() {
    const { ms } = this;
    this.ms = Math.min(2 * ms, PATIENCE_MAX_MS);
    await new Promise((resume) => setTimeout(resume, ms));
  }
}

/** Comes back when the page can be seen. @param {AbortSignal} signal */
async function seen(signal) {
  while (document.hidden && !signal.aborted) await new Promise((resume) => document.addEventListener("visibilitychange", resume, { once: true }));
}

/**
 * Follows a mission's events after the one numbered `after`, until the mission is over. It reconnects after a break, as an
 * `EventSource` would, but that cannot send a token. While the page is hidden it pauses.
 * @param {string} mission
 * @param {number} after
 * @param {{ take: (sequence: number, event: any) => void, state: (name: "live" | "lost" | "over", detail: string) => void }} reader
 * @param {AbortSignal} signal
 */
export async function follow(mission, after, reader, signal) {
  const patience = new Patience();
  let last = after;
  while (!signal.aborted) {
    await seen(signal);
    const attempt = new AbortController();
    const stop = () => attempt.abort();
    let silence = setTimeout(stop, SILENCE_MAX_MS), hidden = 0;
    const looked = () => {
      clearTimeout(hidden);
      if (document.hidden) hidden = window.setTimeout(stop, HIDDEN_MAX_MS);
    };
    signal.addEventListener("abort", stop);
    document.addEventListener("visibilitychange", looked);
    try {
      const answer = await ask(`/v1/missions/${encodeURIComponent(mission)}/events?after=${last}`, { signal: attempt.signal });
      if (answer.status === 204) return reader.state("over", "");
      reader.state("live", "");
      let id = NaN, data = "";
      for await (const some of lines(answer)) {
        clearTimeout(silence);
        silence = setTimeout(stop, SILENCE_MAX_MS);
        patience.served();
        for (const line of some) {
          if (line === "" && data) {
            if (Number.isFinite(id)) last = id;
            reader.take(id, JSON.parse(data));
            [id, data] = [NaN, ""];
          } else if (line.startsWith("id:")) id = Number(line.slice(3));
          else if (line.startsWith("data:")) data += line.slice(5).trimStart();
        }
      }
      reader.state("lost", "the stream ended");
    } catch (error) {
      if (signal.aborted) return;
      if (document.hidden) continue;
      if (error instanceof Refusal && error.problem.status === 404) return reader.state("over", "this mission was deleted");
      reader.state("lost", error instanceof Refusal ? error.message : "the service does not answer");
    } finally {
      clearTimeout(silence);
      clearTimeout(hidden);
      signal.removeEventListener("abort", stop);
      document.removeEventListener("visibilitychange", looked);
    }
    await patience.wait();
  }
}
