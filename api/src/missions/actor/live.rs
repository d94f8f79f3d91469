//! A mission of real vehicles: plans every period of what was heard until then, whether anything was or not.

use std::{
    sync::Arc,
    time::{Duration, Instant},
};

use super::{Actor, Desk, Key, LiveMission, Order, Plan, Snapshot, Stored, json, work};
use crate::{
    deadline::Arrival,
    missions::{
        clock::{Clock, unix_now},
        event::{Event, planned},
        known::Known,
    },
    planning::answer,
    problem::Problem,
    wire::{PreviousPlan, mission::Status},
};
use planner::snapshot::Snapshot as Facts;

/// Events that a start has to take up one by one.
const FOLD_MAX: u32 = 64;

pub(in crate::missions) struct Live {
    desk: Desk,
    known: Known,
    made: Arc<LiveMission>,
    /// Between two plans, s of everybody's clock.
    period: Duration,
    due: Instant,
    /// Events since the last snapshot.
    unfolded: u32,
}

impl Live {
    /// The mission that came to `known`.
    pub(in crate::missions) fn new(desk: Desk, made: Arc<LiveMission>, known: Known) -> Self {
        let LiveMission { config, clock } = &*made;
        let this = Self {
            due: next_due(clock, config.period_s),
            period: Duration::from_secs_f64(config.period_s / config.clock_rate),
            desk,
            known,
            made,
            unfolded: 0,
        };
        this.show_whom_it_waits_for();
        this
    }

    pub(in crate::missions) async fn run(self) {
        work(self).await;
    }
}

impl Actor for Live {
    fn desk(&mut self) -> &mut Desk {
        &mut self.desk
    }

    fn due(&self) -> Instant {
        self.due
    }

    async fn carry_out(&mut self, order: Order, key: Option<Key>) -> Result<Vec<u8>, Problem> {
        let at_s = unix_now();
        let running = self.desk.book.mission.status == Status::Running;
        let event = match order {
            Order::Step(_) => {
                let why = "a live mission goes on by itself; only simulated ones take steps";
                return Err(Problem::conflict(why));
            }
            Order::Run(Some(_)) => {
                let why = "a live mission is as fast as life; only simulated ones take a speed_factor";
                return Err(Problem::conflict(why));
            }
            Order::Run(None) if running => {
                return self.desk.book.unchanged(key).await;
            }
            Order::Hear(heard) => Event::Reported { at_s, heard },
            Order::Run(None) => {
                self.due = next_due(&self.made.clock, self.made.config.period_s);
                Event::Ran {
                    at_s,
                    speed_factor: None,
                }
            }
            Order::Pause => Event::Paused { at_s },
            Order::Finish => Event::Finished { at_s },
        };
        let mut known = None;
        if let Event::Reported { heard, .. } = &event {
            let now = self.made.clock.at(at_s);
            known.insert(self.known.clone()).hear(heard, now);
        }
        // Plans leave a snapshot each; where there are none, reports do now and then.
        let snapshot = known.as_ref().filter(|_| FOLD_MAX <= self.unfolded);
        let snapshot = snapshot.map(|known| {
            json(&Snapshot {
                known: Some(known.clone()),
                plan: self.desk.book.seen.borrow().plan.clone(),
            })
        });
        let folded = snapshot.is_some();
        let stored = self.desk.book.store(vec![event], key, snapshot).await?;
        if let Stored::Now(_) = stored {
            self.unfolded = if folded { 0 } else { self.unfolded + 1 };
            if let Some(known) = known {
                self.known = known;
                self.show_whom_it_waits_for();
            }
        }
        Ok(stored.answer())
    }

    async fn go_on(&mut self) {
        let due = self.due;
        self.set_the_next_due();
        let now = self.made.clock.now();
        let Some(snapshot) = self.known.snapshot(now) else {
            self.show_whom_it_waits_for();
            return;
        };
        let planned = match snapshot {
            Ok(facts) => self.plan_for(facts, now, due).await,
            Err(wrong) => Err(Problem::Invalid(wrong)),
        };
        if let Err(problem) = planned {
            tracing::warn!(mission = self.desk.book.mission.id, ?problem, "no plan");
            self.miss(1);
        }
    }
}

impl Live {
    async fn plan_for(&mut self, facts: Facts, now: f64, due: Instant) -> Result<(), Problem> {
        // The other half is for the disk, and for neighbours.
        let made = self
            .desk
            .planners
            .plan_in_turn(facts, Arrival(due), self.period / 2)
            .await?;
        let metadata = serde_json::Map::new();
        let answer = answer(&made, &metadata).planned();
        let previous = PreviousPlan::from(&answer);
        let late = due.elapsed();
        let event = planned(now, late, &made, &answer, &previous);
        let mut known = self.known.clone();
        known.answered(previous);
        let plan = Some(Arc::new(Plan {
            sequence: self.desk.book.mission.sequence + 1,
            time: now,
            late: late.as_secs_f64(),
            answer,
            heard: known.heard(),
        }));
        let kept = Snapshot {
            known: Some(known),
            plan,
        };
        let snapshot = Some(json(&kept));
        self.desk
            .book
            .store(vec![Event::Planned(Box::new(event))], None, snapshot)
            .await?;
        self.desk.book.show(kept.plan);
        self.known = kept.known.expect("was put there");
        self.unfolded = 0;
        Ok(())
    }

    /// The next plan is due a period after this one was; those that are past are missed.
    fn set_the_next_due(&mut self) {
        let now = Instant::now();
        self.due += self.period;
        let mut missed = 0;
        while self.due < now {
            self.due += self.period;
            missed += 1;
        }
        if 0 < missed {
            self.miss(missed);
        }
    }

    fn miss(&self, plans: u64) {
        self.desk.book.seen.send_modify(|seen| seen.missed += plans);
    }

    fn show_whom_it_waits_for(&self) {
        let waits_for = self.known.waits_for(self.made.clock.now());
        self.desk.book.seen.send_if_modified(|seen| {
            let changed = seen.waits_for != waits_for;
            seen.waits_for = waits_for;
            changed
        });
    }
}

/// When the mission's clock next shows a whole number of periods since it was made: a restart moves no mission's plans
/// onto its neighbours'.
fn next_due(clock: &Clock, period: f64) -> Instant {
    let since = (clock.now() - clock.created) / period;
    let left = (since.ceil() - since).clamp(0.0, 1.0) * period / clock.rate;
    Instant::now() + Duration::from_secs_f64(left)
}
