// Predictions of stored plans, fetched when a view needs them.

import { ask, lines, Refusal } from "./service.js";

/** Predictions in one request: for a moment, and for a replay. */
const AHEAD = 4, AHEAD_PLAYING = 60;
/** Time between two attempts, ms. */
const PAUSE_MS = 1000;

/** Fills a recording with the predictions of its plans. */
export class Predictions {
  /**
   * @param {import("./recording.js").Recording} recording
   * @param {{ signal: AbortSignal, fetched: () => void, lost?: () => void }} how `fetched` is called when there is more to draw
   */
  constructor(recording, { signal, fetched, lost }) {
    this.recording = recording;
    this.signal = signal;
    this.fetched = fetched;
    this.lost = lost;
    this.busy = false;
    this.refused = false;
  }

  /**
   * Fetches missing predictions of the plans near `t`.
   * @param {number} t
   * @param {boolean} playing
   */
  async need(t, playing) {
    const { recording, signal } = this, i = recording.plans.indexAt(t);
    if (this.busy || this.refused || signal.aborted || i < 0) return;
    const time = recording.plans.column("t")[i];
    if (recording.without.has(time) || recording.predictions.has(time)) return;
    this.busy = true;
    try {
      const after = recording.plans.column("sequence")[i] - 1;
      const path = `/v1/missions/${encodeURIComponent(recording.mission.id)}/record?format=events_ndjson&kinds=planned&after=${after}&max_events=${recording.craftCount * (playing ? AHEAD_PLAYING : AHEAD)}`;
      for await (const some of lines(await ask(path, { signal }))) {
        for (const line of some) {
          if (!line) continue;
          const event = JSON.parse(line);
          if (event.prediction) recording.keepPrediction(event.t_s, event.prediction, event.craft);
          else recording.without.add(event.t_s);
        }
      }
    } catch (error) {
      if (signal.aborted) return;
      // A deleted or forbidden mission is not asked for again.
      if (error instanceof Refusal && error.problem.status < 429) this.refused = true;
      else this.lost?.();
      await new Promise((resume) => setTimeout(resume, PAUSE_MS));
    } finally {
      this.busy = false;
    }
    if (!signal.aborted) this.fetched();
  }
}
