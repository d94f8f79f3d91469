// Orders to a mission, for callers whose role allows them.

import { el, fill } from "./dom.js";
import { askJson, freshKey, Refusal, send } from "./service.js";

/**
 * @typedef {import("./app.js").Context} Context
 * @typedef {import("./types.js").MissionJson} MissionJson
 */

/** Speed factors of a simulated mission. Without one it runs as fast as possible. */
const RUN_SPEEDS = [1, 10, 60, 300];
/**
 * The form of orders, the function that updates it, and what draws a live mission's orders on its map.
 * @param {MissionJson} mission
 * @param {Context} context
 * @param {{ done: (mission: MissionJson) => void, redraw: () => void }} how
 */
export function ordersOf(mission, context, { done, redraw }) {
  const said = el("p", { class: "said", role: "status" });
  const path = `/v1/missions/${encodeURIComponent(mission.id)}`;
  const give = async (/** @type {string} */ what, /** @type {() => Promise<any>} */ action, /** @type {(answer: any) => void} */ then = done) => {
    fill(said, `${what}…`);
    try {
      then(await action());
      fill(said, `${what}: done`);
    } catch (error) {
      fill(said, `${what}: `, error instanceof Refusal ? refusalWords(error) : `no answer (${error}); try again`);
    }
  };
  const order = (/** @type {string} */ what, /** @type {string} */ call, /** @type {unknown} */ body = undefined) => give(what, () => send(`${path}/${call}`, body, { key: freshKey() }));
  const speed = el("select", { "aria-label": "Speed of the simulation" }, el("option", { value: "" }, "as fast as possible"), RUN_SPEEDS.map((factor) => el("option", { value: String(factor), selected: factor === 60 }, `${factor}×`)));
  const run = el("button", { type: "button", class: "primary", onclick: () => order("Run", "run", mission.kind === "simulated" && speed.value ? { speed_factor: Number(speed.value) } : {}) }, "Run");
  const pause = el("button", { type: "button", onclick: () => order("Pause", "pause") }, "Pause");
  const finish = el("button", { type: "button", class: "danger", onclick: () => confirm("End this mission? It cannot be resumed.") && order("Finish", "finish") }, "Finish");
  // The setting is changed only if the mission is still as the page shows it.
  let revision = mission.revision;
  const patch = (/** @type {unknown} */ setting) => send(path, setting, { method: "PATCH", key: freshKey(), ifMatch: revision });
  const hand = mission.kind === "live" ? byHand(give, patch, { done, redraw, path, said }) : undefined;
  const readOnly = context.role === "read-only" && el("p", { class: "why" }, "Read-only: orders need an operator's token.");
  const element = el("section", { class: "panel orders", "aria-labelledby": "orders-title" }, el("h2", { id: "orders-title" }, "Orders"), readOnly,
    el("div", { class: "row" }, run, mission.kind === "simulated" && speed, pause, finish), hand?.element, said);
  const became = (/** @type {MissionJson} */ now) => {
    const { status } = now;
    revision = now.revision;
    const over = status === "finished" || status === "failed", forbidden = context.role === "read-only";
    run.disabled = speed.disabled = forbidden || over || status === "running";
    pause.disabled = forbidden || status !== "running";
    finish.disabled = forbidden || over;
    hand?.became(now, forbidden || over);
    element.classList.toggle("over", over);
  };
  return { element, became, tool: hand?.tool };
}

/**
 * Orders by hand and the route to send, on the map and in the form, which is loaded when it is needed.
 * @param {(what: string, action: () => Promise<any>, then?: (answer: any) => void) => Promise<void>} give
 * @param {(setting: unknown) => Promise<MissionJson>} patch
 * @param {{ done: (mission: MissionJson) => void, redraw: () => void, path: string, said: HTMLElement }} how
 */
function byHand(give, patch, { done, redraw, path, said }) {
  const place = el("div");
  let form = /** @type {import("./order_form.js").OrderForm | undefined} */ (undefined), files = /** @type {import("./no_go_form.js").FileOrders | undefined} */ (undefined), last = /** @type {[MissionJson, boolean] | undefined} */ (undefined), sending = false;
  const change = (/** @type {object} */ setting) => {
    sending = true;
    /** @type {unknown} */
    let refused;
    return give("Orders", () => patch(setting).catch(async (error) => {
      refused = error;
      // Someone was faster: what the mission has now is shown before it is sent again.
      if (error instanceof Refusal && error.problem.status === 412) {
        done(await askJson(path));
        error.message = `the mission was changed meanwhile; what it has now is shown: look, and send again (${error.message.split("; ").at(-1)})`;
      }
      throw error;
    }), (changed) => {
      form?.draft.settle(changed.setting);
      done(changed);
    }).finally(() => { sending = false; }).then(() => { if (refused) throw refused; });
  };
  const became = (/** @type {MissionJson} */ now, /** @type {boolean} */ disabled) => {
    last = [now, disabled];
    files?.became(now, disabled);
    const others = form?.became(now, disabled);
    if (others && !sending) fill(said, others);
  };
  const load = async () => {
    try {
      const [{ OrderForm }, { FileOrders }] = await Promise.all([import("./order_form.js"), import("./no_go_form.js")]);
      [form, files] = [new OrderForm(change, redraw), new FileOrders(give, patch, redraw)];
      fill(place, form.element, files.element);
      if (last) became(...last);
    } catch (error) {
      fill(place, `The form could not be loaded (${error}). `, el("button", { type: "button", onclick: load }, "Try again"));
    }
  };
  load();
  const drawer = () => (files?.draws() ? files : form);
  /** @type {import("./types.js").Tool} */
  const tool = {
    overlay: (picture, frame) => {
      const drawn = form?.overlay(picture, frame) ?? { lines: [], discs: [], marks: [] };
      return files?.over(drawn, picture.origin) ?? drawn;
    },
    press: (at, near) => drawer()?.press(at, near) ?? false, move: (at) => drawer()?.move(at), release: () => drawer()?.release(), aims: () => Boolean(drawer()?.aims()), draws: () => Boolean(drawer()?.draws()),
    tap: (at, near) => drawer()?.tap(at, near), takeFile: (file) => files?.takeFile(file),
  };
  return { element: el("div", { class: "by-hand" }, place), became, tool };
}

/** @param {Refusal} refusal */
export function refusalWords({ problem, message }) {
  // A message about one field has its detail.
  const errors = problem.errors.filter(({ detail }) => !message.includes(detail)).map((error) => `${error.pointer ?? error.parameter ?? ""} ${error.detail}`.trim());
  return [message || problem.title, ...errors].join("; ");
}
