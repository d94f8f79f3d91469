//! Planner and laws beside each other, without an alarm: each has a craft, of which one is the real
//! one and the others are simulated. All are compared with where the goal turned out to be.
//!
//! ```text
//! p_i ← p + q_i(Δ) − q(Δ)                    q: response since the last plan; p: measured
//! d_i = |p_i(t − w) − p_d(t − w)|            once reports are younger than w
//! E_i ← max(0, E_i + w (m d² − d_i²)/J)      evidence; J: long mean of the larger square
//! ```
//! The difference of two responses moves the simulated crafts, so that waves, water and errors of
//! the model carry all alike. While a law steers, the program plans for the planner's craft.

use std::{array, iter};

use nalgebra::Vector2;

use crate::{
    craft::{
        monitor::{DISTANCE_MAX, LAWS, SINCE_MAX, Trial, TrialCraft},
        response::{Response, Surge},
    },
    facts::{
        angle::{Heading, wrap},
        asc::{Asc, AscNow},
        reference::Reference,
    },
    los::{law::LosGains, saturated::saturated_los},
    problem::horizon::Horizon,
    snapshot::build::Snapshot,
};

/// Longest time between two plans that are compared, s.
const INTERVAL_MAX: f64 = 5.0;

/// Look-ahead of the laws as time at the goal's speed, s, and along-track gains, 1/s.
const GAINS: [(f64, f64); LAWS] = [(3.0, 0.2), (5.0, 0.1), (5.0, 0.4), (10.0, 0.4)];

/// Least look-ahead, m.
const LOOK_AHEAD_MIN: f64 = 2.0;

/// The gains of law `k` behind the goal of `horizon`.
pub(crate) fn gains(k: usize, horizon: &Horizon<'_>) -> LosGains {
    let (time, along_track_gain) = GAINS[k];
    let speed = horizon.forecast.at(0.0).velocity.norm();
    LosGains { look_ahead: (time * speed).max(LOOK_AHEAD_MIN), along_track_gain }
}

/// The crafts at the time of `horizon`, and the one that is real from now on.
pub(crate) fn resumed(horizon: &Horizon<'_>) -> Trial {
    let (snapshot, estimate) = (horizon.snapshot, horizon.snapshot.craft_estimate());
    // Distances alone are compared: of one goal for all crafts, without a price of energy.
    let is_fair = horizon.forecast.is_mean() && horizon.weights.energy == 0.0 && !estimate.monitor.alarm;
    let first = snapshot.previous_plan.as_ref().and_then(|previous| previous.trajectory.first());
    let before = first.map(|first| (snapshot.t_s - first.t_s, snapshot.asc.position() - first.position()));
    let Some((elapsed, sailed)) =
        before.filter(|(elapsed, _)| is_fair && 0.0 < *elapsed && *elapsed <= INTERVAL_MAX)
    else {
        return Trial::new(estimate.heading.x, estimate.surge.x);
    };
    let mut trial = estimate.trial;
    advance(&mut trial, horizon, elapsed, &sailed);
    compare(&mut trial, horizon);
    choose(&mut trial, horizon);
    trial
}

/// All crafts `elapsed` later, s, in which the real one `sailed` (north, east), m.
fn advance(trial: &mut Trial, horizon: &Horizon<'_>, elapsed: f64, sailed: &Vector2<f64>) {
    let snapshot = horizon.snapshot;
    let response = Response { craft: &horizon.craft, current: snapshot.current(), heading_reference: None };
    for craft in &mut trial.crafts {
        let (now, surge) = (craft.now(snapshot, Vector2::zeros()), Surge { speed: craft.speed, bias: 0.0 });
        let reference = Reference { heading: Heading::new(craft.asked.x), speed: craft.asked.y };
        let (now, surge) = response.after(elapsed, &now, surge, &reference);
        (craft.offset, craft.heading, craft.speed) = (now.position, wrap(now.heading.radians()), surge.speed);
    }
    let foreseen = trial.crafts[trial.real()].offset;
    for craft in &mut trial.crafts {
        craft.offset = (craft.offset - foreseen).map(within);
    }
    trial.crafts[trial.real()].becomes_real(snapshot);
    trial.place = (trial.place - sailed).map(within);
    trial.waiting = (trial.waiting + elapsed).min(SINCE_MAX);
    trial.since = (trial.since + elapsed).min(SINCE_MAX);
}

/// Compares the crafts, once the goal's AUVs were heard after the moment that waits for it.
fn compare(trial: &mut Trial, horizon: &Horizon<'_>) {
    let (snapshot, tuned) = (horizon.snapshot, &horizon.snapshot.tuned().craft);
    let heard = horizon.forecast.needs_now().map(|auv| snapshot.estimates()[auv].state.age_s);
    let is_heard = heard.fold(0.0, f64::max) <= trial.waiting;
    if is_heard && trial.waiting < tuned.trial_time {
        let goal = horizon.forecast.at(-trial.waiting).position - snapshot.asc.position();
        let square = |craft: &TrialCraft| (trial.place + craft.then - goal).norm().min(DISTANCE_MAX).powi(2);
        let squares = trial.crafts.each_ref().map(square);
        let share = 1.0 - (-trial.waiting / tuned.beside_time).exp();
        for (craft, square) in trial.crafts.iter_mut().zip(squares) {
            craft.square += share * (square - craft.square);
        }
        let real = trial.real();
        let least = trial.crafts[real].square.max(tuned.beside_error * tuned.beside_error);
        for (craft, square) in trial.crafts.iter_mut().zip(squares) {
            let gain = (tuned.beside_margin * squares[real] - square) / craft.square.max(least);
            let evidence = craft.evidence + trial.waiting * gain.min(tuned.beside_gain);
            craft.evidence = evidence.clamp(0.0, 2.0 * tuned.beside_evidence);
        }
    }
    if is_heard || tuned.trial_time < trial.waiting {
        (trial.place, trial.waiting) = (Vector2::zeros(), 0.0);
        trial.crafts.iter_mut().for_each(|craft| craft.then = craft.offset);
    }
}

/// Lets the one of the most evidence steer, if that is enough. Every change doubles the least time
/// to the next one: where simulated crafts do better than real ones, they do not take turns.
fn choose(trial: &mut Trial, horizon: &Horizon<'_>) {
    let tuned = &horizon.snapshot.tuned().craft;
    let evidence = |i: &usize| trial.crafts[*i].evidence;
    let best = (0..=LAWS).max_by(|a, b| evidence(a).total_cmp(&evidence(b))).unwrap_or(0);
    let hold = trial.hold.max(tuned.trial_time);
    if tuned.beside_evidence < evidence(&best) && hold < trial.since {
        trial.crafts[trial.real()].steers = false;
        trial.crafts[best].steers = 0 < best;
        trial.crafts[best].becomes_real(horizon.snapshot);
        (trial.since, trial.hold) = (0.0, (2.0 * hold).min(tuned.trial_memory));
        trial.crafts.iter_mut().for_each(|craft| craft.evidence = 0.0);
    }
}

/// The same with what is asked of all crafts: by the laws, of the planner's and of the real one.
pub(crate) fn asked(mut trial: Trial, horizon: &Horizon<'_>, planner: Reference, real: Reference) -> Trial {
    let (snapshot, goal) = (horizon.snapshot, horizon.forecast.at(0.0));
    let by_law: [Reference; LAWS] = array::from_fn(|k| {
        let asc = trial.crafts[k + 1].now(snapshot, snapshot.asc.position());
        saturated_los(&asc, &goal, horizon.goal_course, gains(k, horizon), snapshot.limits())
    });
    let steering = trial.real();
    let all = iter::once(planner).chain(by_law).enumerate();
    for (craft, (i, reference)) in trial.crafts.iter_mut().zip(all) {
        let reference = if i == steering { real } else { reference };
        craft.asked = Vector2::new(wrap(reference.heading.radians()), reference.speed);
    }
    trial
}

/// The moment of `snapshot` for the planner's craft.
pub(crate) fn of_planner(trial: &Trial, snapshot: &Snapshot) -> Snapshot {
    let craft = &trial.crafts[0];
    let now = craft.now(snapshot, snapshot.asc.position());
    snapshot.of_craft(Asc::new(now.position, now.heading, craft.speed), craft.asked.x)
}

impl TrialCraft {
    fn now(&self, snapshot: &Snapshot, real: Vector2<f64>) -> AscNow {
        AscNow {
            position: real + self.offset,
            heading: Heading::new(self.heading),
            current: snapshot.current(),
        }
    }

    fn becomes_real(&mut self, snapshot: &Snapshot) {
        self.offset = Vector2::zeros();
        (self.heading, self.speed) = (snapshot.asc.heading().radians(), snapshot.craft_estimate().surge.x);
    }
}

fn within(along: f64) -> f64 {
    along.clamp(-DISTANCE_MAX, DISTANCE_MAX)
}
