// Speaks to the service that the page came from, with the user's token where it wants one.

/**
 * @typedef {{ pointer?: string, parameter?: string, code: string, detail: string, given?: unknown, limit?: unknown }} FieldError
 * @typedef {{ type: string, title: string, status: number, detail: string, code: string, errors: FieldError[] }} ProblemDocument
 */

/** Longest silence of an event stream: a comment comes every 15 s. */
const SILENCE_MAX_MS = 40_000;
const PATIENCE_MS = 1_000;
const PATIENCE_MAX_MS = 10_000;
/** A short answer that takes longer does not come, ms. */
const ANSWER_MAX_MS = 15_000;
/** A page that is hidden for so long gives its stream back: a browser has six connections to a service for all of its tabs. */
const HIDDEN_MAX_MS = 10_000;

/** The service refused. */
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

/** Where the token is kept: in this tab alone. */
const TOKEN = "token";

/** Asks the user for a token, which may follow one that was refused; the page's shell replaces it. */
export const door = {
  /** @type {(refused: boolean) => Promise<void>} */
  ask: () => Promise.reject(new Error("a token is needed")),
};

/** @param {string} token */
export function useToken(token) {
  sessionStorage.setItem(TOKEN, token);
}

/**
 * Fetches `path`. Refusals throw a `Refusal`; where the service cannot be reached, fetch's own error is thrown.
 * @param {string} path
 * @param {RequestInit} [options]
 * @returns {Promise<Response>}
 */
export async function ask(path, options = {}) {
  for (;;) {
    const token = sessionStorage.getItem(TOKEN);
    const headers = new Headers(options.headers);
    if (token) headers.set("authorization", `Bearer ${token}`);
    const answer = await fetch(path, { ...options, headers });
    if (answer.ok) return answer;
    if (answer.status === 401) {
      await door.ask(token !== null);
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
  const late = AbortSignal.timeout(ANSWER_MAX_MS);
  const signal = options?.signal ? AbortSignal.any([options.signal, late]) : late;
  return (await ask(path, { ...options, signal })).json();
}

/**
 * Posts JSON, once however often it is sent where a `key` is given.
 * @param {string} path
 * @param {unknown} body a text is sent as it is
 * @param {{ key?: string, method?: string, signal?: AbortSignal }} [how]
 * @returns {Promise<any>}
 */
export function send(path, body, { key, method = "POST", signal } = {}) {
  const headers = new Headers();
  if (body !== undefined) headers.set("content-type", "application/json");
  if (key) headers.set("idempotency-key", key);
  return askJson(path, { method, headers, signal, body: typeof body === "string" || body === undefined ? body : JSON.stringify(body) });
}

/** A name for a request that is new. */
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
  // By hand: not every browser goes through a stream with `for await`.
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
 * How long to wait before the next attempt: longer each time, until `served` says that one went well.
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
 * Follows a mission's events until it is over, from the one after `after` on. Comes back by itself after a break, as an
 * `EventSource` would, which can send no token. While the page is hidden nothing is followed.
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
      if (error instanceof Refusal && error.problem.status === 404) return reader.state("over", "this mission is gone");
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
