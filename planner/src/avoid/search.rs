//! The manoeuvres that are tried: changes of the present one, single turns, and two turns where one
//! alone does not keep clear of all vessels on the right sides.

use std::f64::consts::PI;

use crate::avoid::scene::Scene;
use crate::avoid::trial::{Leg, Outcome, Trial};
use crate::facts::angle::wrap;
use crate::facts::traffic::EncounterKind;

/// Turns that are tried, from the course to the goal, rad: the least is one that others see.
const TURNS: [f64; 8] = [0.26, 0.52, 0.79, 1.05, 1.57, 2.09, 2.62, PI];

/// Times for which a manoeuvre is held, as shares of the time until the last vessel is past.
const HOLDS: [f64; 5] = [0.35, 0.6, 0.85, 1.1, 1.4];

/// Changes of the present manoeuvre, rad and s: vessels then pass on the sides that they had.
const NEAR_TURNS: [f64; 7] = [0.0, 0.17, -0.17, 0.35, -0.35, 0.7, -0.7];
const NEAR_HOLDS: [f64; 3] = [-40.0, 0.0, 40.0];

/// Least time for which it is held, s.
const HOLD_LEAST: f64 = 20.0;

/// Speeds, as shares of the largest.
const SPEEDS: [f64; 3] = [1.0, 0.5, 0.0];

/// Turns of manoeuvres of two legs, rad; ends of the first leg, as the same shares, and of the
/// second, as shares of the time until the last vessel that could come too near is past.
const LEG_TURNS: [f64; 4] = [0.52, 1.05, 1.57, 2.36];
const FIRST_HOLDS: [f64; 2] = [0.4, 0.9];
const SECOND_HOLDS: [f64; 2] = [0.8, 1.2];

/// A search for the cheapest manoeuvre.
pub(crate) struct Search<'a> {
    scene: &'a Scene<'a>,
    due: &'a dyn Fn() -> bool,
    /// Speed and direction, from the bow, that the goal wants, m/s and rad.
    wanted: f64,
    to_goal: f64,
    /// Price of a turn to port.
    to_port: f64,
    /// Times until the last vessel for which the craft acts is past, and until all are, s.
    past: f64,
    all: f64,
    best: Option<(Trial, Outcome, f64)>,
}

impl<'a> Search<'a> {
    /// A search in `scene` for the craft that `acts` for some vessels; `straight` is the outcome of
    /// going straight for the goal.
    pub(crate) fn new(
        scene: &'a Scene<'a>,
        due: &'a dyn Fn() -> bool,
        acts: &[bool],
        straight: &Outcome,
    ) -> Self {
        let goal = &scene.goal[0];
        let wanted = goal.velocity + goal.position * scene.tuned.pursuit_rate - scene.current;
        // Who stands on does not turn to port for a vessel on its own port side (rule 17 c).
        let stands_on = |i: usize| acts[i] && scene.others[i].kind == Some(EncounterKind::CrossingStandOn);
        let is_to_starboard = (0..acts.len()).any(stands_on);
        let last = |is: &dyn Fn(usize) -> bool| {
            let those = straight.passings.iter().enumerate().filter(|(i, _)| is(*i));
            those.map(|(_, passing)| passing.time).fold(0.0, f64::max)
        };
        Self {
            scene,
            due,
            wanted: wanted.norm().min(scene.craft.limits.speed_max),
            to_goal: wanted.y.atan2(wanted.x),
            to_port: if is_to_starboard { scene.tuned.side_price } else { 0.0 },
            past: last(&|i| acts[i]),
            all: last(&|i| scene.others[i].kind.is_some()),
            best: None,
        }
    }

    /// The cheapest trial, with the present leg `kept`; none if that is straight for the goal.
    pub(crate) fn best(mut self, kept: Option<Leg>) -> Option<(Trial, Outcome)> {
        let kept = kept.map(|leg| Trial { leg, then: None, doubt: self.scene.tuned.kept_doubt });
        if let Some(kept) = kept {
            self.near(kept);
        }
        self.one_leg();
        if self.is_faulty()
            && let Some(kept) = kept
        {
            for then in self.second_legs(kept.leg.until) {
                self.consider(Trial { then: Some(then), ..kept }, 0.0);
            }
        }
        if self.is_faulty() {
            self.two_legs();
        }
        self.best.filter(|(trial, ..)| 0.0 < trial.leg.until).map(|(trial, outcome, _)| (trial, outcome))
    }

    fn is_faulty(&self) -> bool {
        self.best.as_ref().is_none_or(|(_, outcome, _)| 0.0 < outcome.faults)
    }

    fn consider(&mut self, trial: Trial, price: f64) {
        let least = self.best.as_ref().map_or(f64::INFINITY, |(_, _, least)| *least);
        if let Some(outcome) = self.scene.sail(&trial, least - price, |_| {}) {
            let cost = outcome.cost + price;
            self.best = Some((trial, outcome, cost));
        }
    }

    /// Another manoeuvre than the present one.
    fn change(&mut self, leg: Leg, then: Option<Leg>, price: f64) {
        self.consider(Trial { leg, then, doubt: 1.0 }, self.scene.tuned.change_price + price);
    }

    fn near(&mut self, kept: Trial) {
        self.consider(kept, 0.0);
        let kept = kept.leg;
        for until in NEAR_HOLDS.map(|more| (kept.until + more).max(HOLD_LEAST)) {
            for turn in NEAR_TURNS {
                for speed in [kept.speed, self.scene.craft.limits.speed_max] {
                    let heading = kept.heading.map(|heading| wrap(heading + turn));
                    self.change(Leg { heading, speed, until }, None, 0.0);
                }
            }
        }
    }

    fn one_leg(&mut self) {
        let limits = &self.scene.craft.limits;
        self.change(Leg { heading: None, speed: limits.speed_max, until: 0.0 }, None, 0.0);
        for until in HOLDS.map(|share| self.hold(share * self.past)) {
            for share in SPEEDS {
                let speed = (share * limits.speed_max).max(limits.speed_min);
                if share < 1.0 {
                    let slower = (share * self.wanted).max(limits.speed_min);
                    self.change(Leg { heading: None, speed: slower, until }, None, 0.0);
                }
                for (leg, price) in self.turned(&TURNS, speed, until).filter(|_| 0.0 < share) {
                    if (self.due)() {
                        return;
                    }
                    self.change(leg, None, price);
                }
            }
        }
    }

    fn two_legs(&mut self) {
        let limits = &self.scene.craft.limits;
        for until in FIRST_HOLDS.map(|share| self.hold(share * self.past)) {
            let on = Leg { heading: Some(self.to_goal), speed: self.wanted, until };
            let stop = Leg { heading: None, speed: limits.speed_min.max(0.0), until };
            let others = [(on, 0.0), (stop, 0.0)];
            for (leg, price) in self.turned(&LEG_TURNS, limits.speed_max, until).chain(others) {
                for then in self.second_legs(until) {
                    if (self.due)() {
                        return;
                    }
                    self.change(leg, Some(then), price);
                }
            }
        }
    }

    /// Legs after one that ends at a time.
    fn second_legs(&self, after: f64) -> impl Iterator<Item = Leg> + use<> {
        let limits = &self.scene.craft.limits;
        let (fast, slow) = (limits.speed_max, limits.speed_min.max(0.0));
        let ends = SECOND_HOLDS.map(|share| self.hold(share * self.all));
        let legs = ends.map(|until| {
            let others = [fast, slow].map(|speed| Leg { heading: None, speed, until });
            self.turned(&LEG_TURNS, fast, until).map(|(leg, _)| leg).chain(others)
        });
        legs.into_iter().flatten().filter(move |leg| after < leg.until)
    }

    /// Legs that turn to either side, with their prices.
    fn turned(
        &self,
        turns: &'static [f64],
        speed: f64,
        until: f64,
    ) -> impl Iterator<Item = (Leg, f64)> + use<> {
        let (to_goal, to_port) = (self.to_goal, self.to_port);
        turns.iter().flat_map(move |turn| {
            let sides = [(*turn, 0.0), (-*turn, to_port)];
            sides.map(|(turn, price)| (Leg { heading: Some(wrap(to_goal + turn)), speed, until }, price))
        })
    }

    fn hold(&self, time: f64) -> f64 {
        time.clamp(HOLD_LEAST, self.scene.tuned.look_ahead)
    }
}
