// Calls the user to an alarm, if they asked for it: a sound, and a notification of the browser.

import { el, fill } from "./dom.js";

const KEPT = "alarm-sound";
/** An alarm is called after so long, again after so long, and is another one after so long without it, ms. */
const LASTS_MS = 3_000, AGAIN_MS = 10_000, CALM_MS = 10_000;
/** Two tones that carry over an engine: of a frequency, Hz, and from when on, s. */
const TONES = [[880, 0], [660, 0.25]], TONE_S = 0.22, LOUDNESS = 0.3;

/** The bell of a view. It tells by `hear` what the view last said. */
export class Bell {
  /** @param {AbortSignal} signal ends the view */
  constructor(signal) {
    this.on = isKept();
    /** The alarm that was heard last, since when, when it was called last, and whether it was acknowledged. */
    this.alarm = { key: "", since: 0, heard: -Infinity, called: -Infinity, acknowledged: false };
    this.sound = /** @type {AudioContext | null} */ (null);
    this.button = el("button", { type: "button", class: "alarm", onclick: () => this.turn(!this.on) });
    this.acknowledge = el("button", { type: "button", class: "danger", hidden: true, onclick: () => this.silence() }, "Acknowledge");
    this.note = el("span", { class: "said", role: "status" });
    this.element = el("div", { class: "row bell" }, this.button, this.acknowledge, this.note);
    // A browser lets a page sound only after the user has touched it.
    addEventListener("pointerdown", () => this.on && this.wake(), { signal });
    addEventListener("keydown", () => this.on && this.wake(), { signal });
    signal.addEventListener("abort", () => this.sound?.close());
    if (this.on && navigator.userActivation?.hasBeenActive) this.wake();
    this.show();
  }

  /** @param {boolean} on */
  turn(on) {
    this.on = on;
    try {
      localStorage.setItem(KEPT, on ? "on" : "off");
    } catch {
      // Without storage it is off after a reload.
    }
    if (on) {
      this.wake();
      if ("Notification" in window && Notification.permission === "default") Notification.requestPermission().then(() => this.show()).catch(() => {});
    }
    this.show();
  }

  /** Quiet until another alarm, or until this one comes again. */
  silence() {
    this.alarm.acknowledged = true;
    this.show();
  }

  /**
   * @param {string} key of the alarm that there is now; empty without one
   * @param {string} [words] what the notification says
   */
  hear(key, words = "") {
    const { alarm } = this, now = performance.now();
    if (!key) {
      if (alarm.key && now - alarm.heard > CALM_MS) this.alarm = { ...alarm, key: "", acknowledged: false };
      return this.show();
    }
    if (key !== alarm.key) Object.assign(alarm, { key, since: now, called: -Infinity, acknowledged: false });
    alarm.heard = now;
    if (this.on && !alarm.acknowledged && now - alarm.since >= LASTS_MS && now - alarm.called >= AGAIN_MS) {
      if (alarm.called === -Infinity) notify(words);
      alarm.called = now;
      this.ring();
    }
    this.show();
  }

  wake() {
    this.sound ??= new AudioContext();
    if (this.sound.state !== "running") this.sound.resume().then(() => this.show()).catch(() => {});
  }

  ring() {
    const { sound } = this;
    if (sound?.state !== "running") return;
    for (const [frequency, from] of TONES) {
      const tone = sound.createOscillator(), loudness = sound.createGain(), at = sound.currentTime + from;
      tone.frequency.value = frequency;
      loudness.gain.setValueAtTime(LOUDNESS, at);
      loudness.gain.exponentialRampToValueAtTime(0.001, at + TONE_S);
      tone.connect(loudness).connect(sound.destination);
      tone.start(at);
      tone.stop(at + TONE_S);
    }
  }

  show() {
    const { alarm, on } = this, text = `Alarm sound: ${on ? "on" : "off"}`;
    if (this.button.textContent !== text) fill(this.button, text);
    this.button.setAttribute("aria-pressed", String(on));
    const calls = on && alarm.key !== "";
    this.acknowledge.hidden = !calls || alarm.acknowledged;
    const mute = on && this.sound?.state !== "running" ? "silent until you click or press a key" : "";
    const denied = on && !("Notification" in window && Notification.permission === "granted") ? "the browser allows no notifications" : "";
    const said = calls && alarm.acknowledged ? "acknowledged: quiet until the state changes" : [mute, denied].filter(Boolean).join("; ");
    if (said !== this.note.textContent) fill(this.note, said);
  }
}

/** @param {string} words */
function notify(words) {
  if (!("Notification" in window) || Notification.permission !== "granted") return;
  try {
    new Notification(words, { tag: "pilotfish", icon: "/icon.svg" });
  } catch {
    // Some browsers of phones have no notifications of pages.
  }
}

function isKept() {
  try {
    return localStorage.getItem(KEPT) === "on";
  } catch {
    return false;
  }
}
