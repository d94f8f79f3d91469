// A live mission played to the page from a recording of the real service (`record.mjs`): the mission's answers and its event stream are the recorded ones,
// everything else is the service's. Time goes on by `pass` alone, for the mission and for the page.
//
// A recording is lines of JSON: first what a page that opens the mission loads, then, with the seconds since, members of the mission's answer that
// changed (`mission`), the scene (`scene`), an event of the stream (`event`), or an order of the page and its answer (`order`), which is waited for.

import { readFileSync } from "node:fs";
import { createServer, request } from "node:http";
import { isDeepStrictEqual } from "node:util";

const FRAME_MS = 20;

const json = (answer, body, status = 200, headers = {}) => answer.writeHead(status, { "content-type": "application/json", ...headers }).end(JSON.stringify(body));

/** The recording called `name`; `renamed` has other texts for some of it: ids, the title, a note. */
export function recorded(name, renamed = {}) {
  let text = readFileSync(new URL(`recordings/${name}.ndjson`, import.meta.url), "utf8");
  // A row of the table is a text within the JSON.
  for (const [before, now] of Object.entries(renamed)) text = text.replaceAll(JSON.stringify(before), () => JSON.stringify(now)).replaceAll(`,${before},`, () => `,${JSON.stringify(now).slice(1, -1)},`);
  const [opening, ...frames] = text.trim().split("\n").map((line) => JSON.parse(line));
  return { opening, frames };
}

/** `mission` with the members that changed. */
export function changed(mission, { plan, ...others }) {
  return { ...mission, ...others, ...plan && { plan: { ...mission.plan, ...plan } } };
}

/** Plays the recording `name` to `page`, which is `ahead_s` ahead of the service. */
export async function play(page, service, name, { renamed, ahead_s = 0 } = {}) {
  const { opening, frames } = recorded(name, renamed), { id } = opening.mission, path = `/v1/missions/${id}`, events = [], streams = new Set();
  let { mission, scene } = opening, now = 0, next = 0, sent = 0, isCut = false;
  const write = (answer, text) => {
    sent += text.length;
    answer.write(text);
  };
  const sse = ({ id: sequence, event, data }) => `id: ${sequence}\nevent: ${event}\nretry: 1000\ndata: ${JSON.stringify(data)}\n\n`;
  const isOver = () => ["finished", "failed"].includes(mission.status);
  const take = (frame) => {
    if (frame.mission) mission = changed(mission, frame.mission);
    if (frame.scene) ({ scene } = frame);
    if (!frame.event) return;
    events.push(frame);
    for (const stream of streams) write(stream, sse(frame));
  };
  /** Everything until `to`, or until an order that the page has not given. */
  const goOn = (to) => {
    for (now = to; next < frames.length && frames[next].at <= to; next += 1) {
      if (frames[next].order) throw new Error(`${name}: the page has not ordered ${JSON.stringify(frames[next].order)}, ${frames[next].at} s`);
      take(frames[next]);
    }
    if (isOver()) for (const stream of streams) stream.end();
  };
  const lines = (answer, kinds, after) => {
    answer.writeHead(200, { "content-type": "application/x-ndjson" });
    write(answer, events.filter(({ id, event }) => id > after && kinds.split(",").includes(event)).map(({ id: sequence, data }) => `${JSON.stringify({ sequence, ...data })}\n`).join(""));
    answer.end();
  };
  const ordered = (asked, answer, body) => {
    const frame = frames.slice(next).find((frame) => frame.order), order = { method: asked.method, path: asked.url.slice(path.length), body: body ? JSON.parse(body) : null };
    if (!frame || frame.at > now + 1 || !isDeepStrictEqual(order, frame.order)) return json(answer, { title: "not recorded", detail: `${JSON.stringify(order)} at ${now} s, but ${JSON.stringify(frame?.order)} at ${frame?.at} s` }, 500);
    for (; frames[next] !== frame; next += 1) take(frames[next]);
    [now, next, mission] = [frame.at, next + 1, frame.answer];
    json(answer, mission, 200, { etag: `"${mission.revision}"` });
  };
  const answers = {
    "/v1/missions": (answer) => json(answer, { missions: [mission] }),
    [path]: (answer) => json(answer, mission, 200, { etag: `"${mission.revision}"` }),
    [`${path}/scene`]: (answer) => json(answer, scene),
    [`${path}/reference`]: (answer, query) => json(answer, opening.reference ?? opening.references[query.get("craft")]),
    [`${path}/record`]: (answer, query) => {
      if (query.get("format") !== "csv") return lines(answer, query.get("kinds"), Number(query.get("after") ?? 0));
      answer.writeHead(200, { "content-type": "text/csv" });
      write(answer, opening.csv);
      answer.end();
    },
    [`${path}/events`]: (answer, query) => {
      const missed = events.filter((event) => event.id > Number(query.get("after")));
      if (isOver() && !missed.length) return answer.writeHead(204).end();
      answer.writeHead(200, { "content-type": "text/event-stream" });
      answer.flushHeaders();
      for (const event of missed) write(answer, sse(event));
      if (isOver()) return answer.end();
      streams.add(answer);
      answer.on("close", () => streams.delete(answer));
    },
  };
  const server = createServer((asked, answer) => {
    if (isCut) return asked.socket.destroy();
    const { pathname, searchParams } = new URL(asked.url, "http://localhost"), recordedAnswer = answers[decodeURIComponent(pathname)];
    // What a page read before it was left does not count.
    if (pathname === "/") sent = 0;
    if (asked.method === "GET" && recordedAnswer) return recordedAnswer(answer, searchParams);
    if (pathname.startsWith(path)) {
      let body = "";
      return asked.on("data", (some) => { body += some; }).on("end", () => ordered(asked, answer, body));
    }
    asked.pipe(request(`${service.url}${asked.url}`, { method: asked.method, headers: asked.headers }, (its) => its.pipe(answer.writeHead(its.statusCode, its.headers))));
  });
  await new Promise((resume) => server.listen(0, "127.0.0.1", resume));
  const url = `http://127.0.0.1:${server.address().port}`, time = 1000 * (opening.mission.t_s + ahead_s);
  for (const frame of opening.events) events.push(frame);
  await page.clock.install({ time: time - 1000 });
  await page.clock.pauseAt(time);

  /** Returns when the page has read what it asked for and what the stream has, and has drawn it. What is drawn may be asked for first. */
  const settled = async () => {
    for (let frame = 0; frame < 2; frame += 1) {
      await page.evaluate((letters) => window.readUntil(letters), isCut ? 0 : sent);
      await page.clock.runFor(FRAME_MS);
    }
  };
  return {
    url, id, settled, mission: () => mission,
    async open(hash = `#/mission/${id}`) {
      await page.goto(`${url}/${hash}`);
      await page.locator("main h1").first().waitFor();
      await settled();
    },
    /** So many seconds pass. */
    async pass(seconds) {
      for (let second = 0; second < seconds; second += 1) {
        goOn(now + 1);
        await settled();
        await page.clock.runFor(1000 - 2 * FRAME_MS);
      }
      await settled();
    },
    /** What is before the next order passes. */
    async passUntilOrder() {
      const order = frames.slice(next).find((frame) => frame.order);
      while (now + 1 < order.at) await this.pass(1);
    },
    /** The service is gone, and comes back at the moment that it is then. */
    cut() {
      isCut = true;
      server.closeAllConnections();
    },
    mend() {
      isCut = false;
    },
    async close() {
      server.closeAllConnections();
      await new Promise((resume) => server.close(resume));
    },
  };
}
