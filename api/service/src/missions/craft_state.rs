//! What a live mission knows of a surface craft, and whether that can serve the AUVs of its fleet.

use std::mem;

use planner::nalgebra::Vector2;
use planner::snapshot::{RANGE_FROM_WITHIN, REPORTS_MAX};
use serde::{Deserialize, Serialize};

use super::clock::is_ahead;
use wire::mission::{AscReport, Away, Reports, Steering, SteeringState};
use wire::{Asc, CraftFrame, Current, DatumChange, Origin, PreviousPlan, VehicleId, Vessel};

/// Longest extrapolation of the surface craft's last state by its velocity, s. After that its
/// position is unknown, and no plan is made.
const STATE_AGE_MAX: f64 = 10.0;

/// Greatest age of a surface craft's state from which the planner learns, s. An extrapolated state
/// keeps heading and speed despite references, as if rudder or thruster had no effect.
const LEARNT_AGE_MAX: f64 = 2.0;

/// Time after a hand-back for which the planner learns nothing from the craft, s: the helm still
/// takes over, and a rudder has no effect without way.
const HANDED_BACK: f64 = 10.0;

/// Time for which a craft that falls silent goes on, s: a bridge stops it after 2 to 3 s without a
/// service, and it loses way.
const STOPS_IN: f64 = 3.0;

/// Share of its energy below which a craft of a fleet serves nobody, if its mission states none:
/// ArduPilot's boats warn there. Assumption for other craft. An empty battery recovers a little
/// without load, by less than the second.
const BATTERY_MIN: f64 = 0.2;
const BATTERY_RECOVERS: f64 = 0.05;

/// Time for which a craft of a fleet has to be well before it serves again, s: at first, and at
/// most. It doubles if the craft has not served for [`STEADY`] since it was away last.
const REST: f64 = 30.0;
const REST_MAX: f64 = 960.0;
const STEADY: f64 = 600.0;

/// A surface craft of a mission.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct CraftState {
    pub(super) asc: Option<AscReport>,
    /// Newest positions: time, s, north and east, m. They place its ranges.
    #[serde(default)]
    craft_track: Vec<[f64; 3]>,
    /// Time of its first state after it was not steered, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    handed_back: Option<f64>,
    /// The last report of whether it is steered. No plan of a mission with one craft depends on it.
    #[serde(default)]
    pub(super) steering: Option<Steering>,
    /// Share of its energy that is left, after the time of the newest report of it, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    battery: Option<(f64, f64)>,
    pub(super) previous_plan: Option<PreviousPlan>,
    /// In a fleet, `true` if it does not follow by its last plan.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    strays: bool,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) absence: Option<Absence>,
}

/// What a plan leaves for the next one.
#[derive(Clone, Debug, Default)]
pub(super) struct Left {
    pub(super) previous_plan: Option<PreviousPlan>,
    /// In a fleet, `true` if the craft does not follow by the plan.
    pub(super) strays: bool,
}

/// A craft's last absence from its fleet.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Absence {
    /// The time, s, from which it serves again if it stays well.
    until_s: f64,
    /// Time for which it has to be well, s.
    rest_s: f64,
    /// `true` if too little energy was a reason.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    was_low: bool,
}

/// A craft of a fleet, for clients.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct CraftView {
    pub(super) id: String,
    pub(super) auvs: Vec<String>,
    pub(super) away: Option<Away>,
    pub(super) steering: Option<Steering>,
    pub(super) battery: Option<f64>,
}

/// A craft at the time of a plan.
pub(super) struct CraftNow {
    pub(super) asc: Asc,
    pub(super) previous_plan: Option<PreviousPlan>,
    /// Current of its observer.
    pub(super) current: Option<Current>,
}

impl CraftState {
    /// Replaces the memory of the last plan by that of the newest one, and returns it.
    pub(super) fn replace_left(&mut self, left: Left) -> Left {
        Left {
            previous_plan: mem::replace(&mut self.previous_plan, left.previous_plan),
            strays: mem::replace(&mut self.strays, left.strays),
        }
    }

    /// Drops reports from before the clock was set back to `now`, s.
    pub(super) fn forget_after(&mut self, now: f64) {
        self.asc.take_if(|asc| is_ahead(asc.t_s, now));
        self.craft_track.retain(|[then, ..]| !is_ahead(*then, now));
        self.handed_back.take_if(|then| is_ahead(*then, now));
        self.steering.take_if(|said| is_ahead(said.t_s, now));
        self.battery.take_if(|(then, _)| is_ahead(*then, now));
    }

    /// Takes its newest state and state of steering.
    pub(super) fn take(&mut self, heard: &Reports) {
        self.craft_track = self.track_with(heard);
        let newest = heard.asc.iter().max_by(|a, b| a.t_s.total_cmp(&b.t_s));
        if let Some(newest) = newest
            && self.asc.as_ref().is_none_or(|known| known.t_s < newest.t_s)
        {
            if newest.steered && self.asc.as_ref().is_some_and(|known| !known.steered) {
                self.handed_back = Some(newest.t_s);
            }
            self.asc = Some(newest.clone());
        }
        let batteries = heard.asc.iter().filter_map(|asc| Some((asc.t_s, asc.battery?)));
        self.battery = self.battery.into_iter().chain(batteries).max_by(|a, b| a.0.total_cmp(&b.0));
        let said = self.steering.iter().chain(&heard.steering);
        self.steering = said.max_by(|a, b| a.t_s.total_cmp(&b.t_s)).cloned();
    }

    /// Its newest positions with those in `heard`, in order of time.
    pub(super) fn track_with(&self, heard: &Reports) -> Vec<[f64; 3]> {
        let states = heard.asc.iter().map(|asc| [asc.t_s, asc.state.north_m, asc.state.east_m]);
        let mut track: Vec<_> = self.craft_track.iter().copied().chain(states).collect();
        track.sort_by(|a, b| a[0].total_cmp(&b[0]));
        track.dedup_by(|later, earlier| later[0] == earlier[0]);
        track.drain(..track.len().saturating_sub(REPORTS_MAX));
        track
    }

    /// Counts positions from another datum, the `origin`. A state that is then not near is dropped.
    pub(super) fn count_from(
        &mut self,
        origin: Origin,
        change: &DatumChange,
        is_near: impl Fn(f64, f64) -> bool,
    ) {
        for [_, north, east] in &mut self.craft_track {
            change.position(north, east);
        }
        self.craft_track.retain(|[_, north, east]| is_near(*north, *east));
        if let Some(AscReport { state, .. }) = &mut self.asc {
            change.position(&mut state.north_m, &mut state.east_m);
        }
        if self.asc.take_if(|asc| !is_near(asc.state.north_m, asc.state.east_m)).is_some() {
            self.previous_plan = None;
        }
        if let Some(plan) = &mut self.previous_plan {
            plan.origin = plan.origin.and(Some(origin));
            plan.move_positions(|position| change.moved(&position));
        }
    }

    /// `true` if its place at `now`, s, is known.
    pub(super) fn is_heard(&self, now: f64) -> bool {
        let is_new = |asc: &AscReport| now - asc.t_s <= STATE_AGE_MAX && !is_ahead(asc.t_s, now);
        self.asc.as_ref().is_some_and(is_new)
    }

    /// `true` if it was handed back just before `now`, s.
    fn is_handed_back(&self, now: f64) -> bool {
        self.handed_back.is_some_and(|then| now - then < HANDED_BACK)
    }

    /// Velocity over ground (north, east), m/s.
    pub(super) fn velocity(&self) -> Option<Vector2<f64>> {
        let plan = self.previous_plan.as_ref();
        self.asc.as_ref().map(|asc| over_ground(&asc.state, plan))
    }

    /// Share of its energy that is left, if it was ever reported.
    pub(super) fn battery(&self) -> Option<f64> {
        self.battery.map(|(_, share)| share)
    }

    /// Time of its last plan, s.
    pub(super) fn planned_at(&self) -> Option<f64> {
        Some(self.previous_plan.as_ref()?.trajectory.first()?.t_s)
    }

    /// The craft at `now`, s, with its last plan as the planner may learn from it; `None` if it was
    /// never heard.
    pub(super) fn at(&self, now: f64, origin: Option<Origin>) -> Option<CraftNow> {
        let asc = self.asc.as_ref()?;
        let mut previous_plan = self.previous_plan.clone();
        if let Some(plan) = &mut previous_plan {
            if !asc.steered {
                take_motion_for_reference(plan, &asc.state);
            } else if LEARNT_AGE_MAX < now - asc.t_s || self.is_handed_back(now) {
                learn_nothing(plan, &asc.state);
            }
        }
        let craft = carried(&asc.state, now - asc.t_s, self.previous_plan.as_ref(), origin);
        Some(CraftNow { asc: craft, previous_plan, current: asc.current })
    }

    /// It as a vessel that nobody hears, under its name: without references it soon stops.
    pub(super) fn as_silent_vessel(&self, id: VehicleId) -> Option<Vessel> {
        let (asc, velocity) = (self.asc.as_ref()?, self.velocity()?);
        let place = asc.state.position() + velocity * STOPS_IN;
        let vessel = Vessel::of_craft(id, asc.t_s, place, Vector2::zeros(), vec![]);
        vessel.faults("").is_empty().then_some(vessel)
    }

    /// Returns the reason that the craft can serve nobody at `now`, s, and its absence after that. A
    /// craft needs the share `battery_min` of its energy.
    pub(super) fn away(&self, now: f64, battery_min: Option<f64>) -> (Option<Away>, Option<Absence>) {
        // A clock that was set back makes no absence longer.
        let before = self.absence.filter(|before| before.until_s <= now + before.rest_s);
        let rests = before.is_some_and(|before| now < before.until_s);
        let was_low = rests && before.is_some_and(|before| before.was_low);
        let needed = battery_min.unwrap_or(BATTERY_MIN) + if was_low { BATTERY_RECOVERS } else { 0.0 };
        let needed = needed.min(1.0);
        let Some(why) = self.unable(now, needed) else {
            return (rests.then_some(Away::Returning), before);
        };
        // One whose state was never heard, or that nobody asked to do anything, need not rest.
        if self.asc.is_none() || why == Away::Waiting {
            return (Some(why), before);
        }
        let rest_s = match before {
            Some(before) if now < before.until_s => before.rest_s,
            Some(before) if now < before.until_s + STEADY => (2.0 * before.rest_s).min(REST_MAX),
            _ => REST,
        };
        let was_low = was_low || why == Away::BatteryLow;
        (Some(why), Some(Absence { until_s: now + rest_s, rest_s, was_low }))
    }

    fn unable(&self, now: f64, battery_min: f64) -> Option<Away> {
        if !self.is_heard(now) {
            return Some(Away::Silent);
        }
        let said = self.steering.as_ref().filter(|said| now - said.t_s <= STATE_AGE_MAX);
        match said.map(|said| said.state) {
            Some(SteeringState::Person) => Some(Away::Person),
            Some(SteeringState::NotSteering) => Some(Away::NotSteering),
            Some(SteeringState::Waiting) => Some(Away::Waiting),
            None if self.asc.as_ref().is_some_and(|asc| !asc.steered) => Some(Away::Waiting),
            _ if self.battery().is_some_and(|share| share < battery_min) => Some(Away::BatteryLow),
            _ => self.strays.then_some(Away::DoesNotFollow),
        }
    }
}

/// Replaces the reference of `plan` by the motion of a craft that a person steers: the planner
/// learns nothing of its response, and the next reference turns from the bow.
fn take_motion_for_reference(plan: &mut PreviousPlan, asc: &Asc) {
    let over_ground = asc.ground_north_mps.zip(asc.ground_east_mps);
    let (sin, cos) = (asc.heading_rad.sin(), asc.heading_rad.cos());
    let over_ground = over_ground.map(|(north, east)| north * cos + east * sin);
    learn_nothing(plan, asc);
    if let Some(reference) = &mut plan.reference {
        reference.speed_mps = over_ground.unwrap_or(asc.speed_mps).max(0.0);
        reference.heading_rad = Some(asc.heading_rad);
    }
}

/// Takes the craft's motion as requested, so that the planner learns nothing of its response.
fn learn_nothing(plan: &mut PreviousPlan, asc: &Asc) {
    if let Some(craft) = &mut plan.craft_estimate {
        craft.asked_speed_mps = asc.speed_mps.max(0.0);
        craft.asked_heading_rad = asc.heading_rad;
    }
}

/// Interpolates a `track` at `time`, s: position (north, east), m. At an end, the nearest position
/// within the accepted time.
pub(super) fn position_at(track: &[[f64; 3]], time: f64) -> Option<[f64; 2]> {
    let after = track.partition_point(|[then, ..]| *then < time);
    let is_near = |[then, ..]: &&[f64; 3]| (then - time).abs() <= RANGE_FROM_WITHIN;
    let before = after.checked_sub(1).and_then(|place| track.get(place)).filter(is_near);
    match (before, track.get(after).filter(is_near)) {
        (Some([from, north, east]), Some([to, later_north, later_east])) => {
            let share = (time - from) / (to - from);
            Some([north + share * (later_north - north), east + share * (later_east - east)])
        }
        (Some([_, north, east]), None) | (None, Some([_, north, east])) => Some([*north, *east]),
        (None, None) => None,
    }
}

/// The surface craft `age` seconds after its state, moved over ground, with its heading and speed.
fn carried(asc: &Asc, age: f64, previous: Option<&PreviousPlan>, origin: Option<Origin>) -> Asc {
    let (place, way) = (asc.position(), over_ground(asc, previous) * age.max(0.0));
    let frame = origin.and_then(|origin| CraftFrame::new(origin, place));
    let place = frame.map_or(place + way, |frame| frame.leave(&way));
    Asc { north_m: place.x, east_m: place.y, lat_deg: None, lon_deg: None, ..*asc }
}

/// Velocity of the surface craft over ground (north, east), m/s: as reported, else by its speeds
/// through the water and the current of the previous plan.
fn over_ground(asc: &Asc, previous: Option<&PreviousPlan>) -> Vector2<f64> {
    let (sin, cos) = asc.heading_rad.sin_cos();
    let through_water = (asc.speed_mps * cos - asc.sway_mps * sin, asc.speed_mps * sin + asc.sway_mps * cos);
    let current = previous.and_then(|plan| plan.current);
    let current = current.map_or((0.0, 0.0), |current| (current.north_mps, current.east_mps));
    let north = asc.ground_north_mps.unwrap_or(through_water.0 + current.0);
    let east = asc.ground_east_mps.unwrap_or(through_water.1 + current.1);
    Vector2::new(north, east)
}
