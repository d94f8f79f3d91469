//! The craft of the service's live missions, as each other sees them.
//!
//! Two of them give way by the order of their missions: the later one keeps clear of the earlier
//! one, whose plan it knows, and the earlier one does not see it, so that only one of them ever
//! dodges. A later craft that cannot give way, such as a silent one, is a vessel like others to the
//! earlier one.

use std::collections::BTreeMap;
use std::sync::Arc;

use parking_lot::Mutex;
use planner::nalgebra::Vector2;
use planner::snapshot::ID_LENGTH_MAX;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::edge::access::Tokens;
use wire::mission::Mission;
use wire::{DatumChange, Origin, VehicleId, Vessel};

/// Distance from which craft look at each other, m: two at 8 m/s for the 300 s of a manoeuvre.
const RANGE: f64 = 5_000.0;

/// Most own craft in a plan.
const OWN_MAX: usize = 8;

/// Time without an orderly plan after which a craft does not give way, s, beside three periods.
const GRACE: f64 = 5.0;

/// Time of orderly plans after which it gives way again, s.
const AGAIN: f64 = 30.0;

/// Time for which a craft without a fresh plan is taken to go straight on, s: a program's horizon.
const STRAIGHT: f64 = 60.0;

/// Distance, m, and difference of velocities, m/s, below which a small vessel is an echo of a
/// craft: of a new echo, and of one that was.
const ECHO: [(f64, f64); 2] = [(20.0, 1.0), (60.0, 2.0)];

/// Age of a craft's state until which AIS says nothing that its mission does not know, s.
const HEARD: f64 = 10.0;

/// Distance within which the craft's name makes a vessel an echo, m: AIS is late and inexact, and
/// others bear the same name.
const NAMED_WITHIN: f64 = 500.0;

/// Largest length of a vessel that is an echo without the craft's name, m.
const ECHO_LENGTH: f64 = 12.0;

/// Other craft of the service, as a plan saw them.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct OwnCraft {
    /// The craft as vessels, at most 8; `id` is that of their mission.
    pub vessels: Vec<Vessel>,
    /// Identities of reported vessels that are craft of the service, at most 64. The plan left them
    /// out.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schema(value_type = Vec<String>)]
    pub echoes: Vec<VehicleId>,
}

impl OwnCraft {
    /// `true` if the plan saw none.
    pub(super) fn is_none(&self) -> bool {
        self.vessels.is_empty() && self.echoes.is_empty()
    }
}

/// A craft as its mission knows it. Times are Unix times, s; positions count from `origin`.
#[derive(Clone, Debug)]
pub(super) struct Craft {
    pub(super) mission: Arc<Mission>,
    /// Its name in a fleet.
    pub(super) id: Option<String>,
    pub(super) origin: Origin,
    /// Its place on Earth.
    pub(super) place: Origin,
    /// Time of its state.
    pub(super) t_s: f64,
    pub(super) position: Vector2<f64>,
    /// Velocity over ground, m/s.
    pub(super) velocity: Vector2<f64>,
    /// Its planned positions: time, north and east, m.
    pub(super) plan: Vec<[f64; 3]>,
    /// Time between its plans, s, and `true` if it follows the last one.
    pub(super) period: f64,
    pub(super) is_orderly: bool,
}

/// The craft with a place on Earth whose missions are active, by the missions' numbers and their
/// order there.
#[derive(Clone, Debug)]
pub(super) struct Fleet {
    craft: Arc<Mutex<BTreeMap<(u64, usize), Member>>>,
    tokens: Option<Tokens>,
}

#[derive(Clone, Debug)]
struct Member {
    craft: Craft,
    /// Orderly since and until, s.
    since: f64,
    until: f64,
}

impl Member {
    fn is_orderly(&self, now: f64) -> bool {
        self.since + AGAIN <= now && now <= self.until
    }
}

impl Fleet {
    pub(super) fn new(tokens: Option<Tokens>) -> Self {
        Self { craft: Arc::default(), tokens }
    }

    /// The place of the mission with that number, which is empty at first.
    pub(super) fn place(&self, number: u64) -> Berth {
        Berth { fleet: self.clone(), number }
    }

    /// `true` if every caller that may see one mission may see the other.
    fn have_the_same_callers(&self, one: &Mission, other: &Mission) -> bool {
        self.tokens.as_ref().is_none_or(|tokens| tokens.permit_alike([one, other]))
    }
}

/// A mission's place in the fleet. It is left when this is dropped.
#[derive(Debug)]
pub(super) struct Berth {
    fleet: Fleet,
    number: u64,
}

impl Drop for Berth {
    fn drop(&mut self) {
        self.leave();
    }
}

impl Berth {
    /// Leaves the place empty.
    pub(super) fn leave(&self) {
        self.fleet.craft.lock().retain(|(number, _), _| *number != self.number);
    }

    /// Shows the mission's craft, each with its order there, to the others at `now`, Unix time, s.
    pub(super) fn show(&self, craft: Vec<(usize, Craft)>, now: f64) {
        let mut members = self.fleet.craft.lock();
        let known = |key: &(u64, usize), known: &Member| {
            key.0 != self.number || craft.iter().any(|(order, of)| *order == key.1 && of.id == known.craft.id)
        };
        members.retain(|key, member| known(key, member));
        for (order, craft) in craft {
            self.show_one(&mut members, order, craft, now);
        }
    }

    fn show_one(&self, members: &mut BTreeMap<(u64, usize), Member>, order: usize, craft: Craft, now: f64) {
        let key = (self.number, order);
        let before = members.get(&key).map(|before| (before.since, before.until));
        // A craft that was never orderly does not have to become so again.
        let (since, until) = match before {
            Some((since, until)) if !craft.is_orderly || now <= until => (since, until),
            Some((_, until)) if f64::NEG_INFINITY < until => (now, until),
            _ => (f64::NEG_INFINITY, f64::NEG_INFINITY),
        };
        let until = if craft.is_orderly { now + GRACE + 3.0 * craft.period } else { until };
        members.insert(key, Member { craft, since, until });
    }

    /// What the mission sees of the others at `now`, Unix time, s, with the vessels that were
    /// `reported` to it. `before` is what it saw last.
    pub(super) fn look<'a>(
        &self,
        now: f64,
        reported: impl Iterator<Item = &'a Vessel>,
        before: &OwnCraft,
    ) -> OwnCraft {
        let members = self.fleet.craft.lock();
        let own = members.range((self.number, 0)..(self.number + 1, 0)).map(|(_, own)| own);
        let Some(first) = own.clone().next() else {
            return OwnCraft::default();
        };
        let near = members.iter().filter(|((number, _), other)| {
            *number != self.number
                && !are_of_one_bridge(&first.craft.mission, &other.craft.mission)
                && own.clone().any(|own| are_near(&own.craft.place, &other.craft.place))
                && self.fleet.have_the_same_callers(&first.craft.mission, &other.craft.mission)
        });
        // AIS also reports the craft of the same fleet.
        let fleet =
            members.iter().filter(|((number, _), own)| *number == self.number && own.craft.id.is_some());
        let near: Vec<_> = near.chain(fleet).map(|(key, member)| (*key, member.clone())).collect();
        let origin = first.craft.origin;
        let here: Vec<_> = own.map(|own| own.craft.position).collect();
        drop(members);
        let mut seen: Vec<_> = near
            .into_iter()
            .filter_map(|((number, order), member)| {
                let is_orderly = member.is_orderly(now);
                let vessel =
                    member.craft.seen_from((origin, order), number < self.number, is_orderly, now)?;
                let is_own = number == self.number;
                let is_hidden = is_own || self.number < number && is_orderly;
                let distances = here.iter().map(|here| (vessel.position() - here).norm());
                Some((distances.fold(f64::INFINITY, f64::min), is_hidden, is_own, vessel))
            })
            .collect();
        seen.sort_by(|(one, ..), (other, ..)| one.total_cmp(other));
        let echoes = reported.filter(|vessel| {
            let was = before.echoes.contains(&vessel.id);
            // A small boat beside a craft of the same fleet is another one, unless it has its name.
            seen.iter().any(|(.., is_own, craft)| match is_own {
                true => has_name_of(vessel, craft, was, now),
                false => is_echo(vessel, craft, was, now),
            })
        });
        let echoes = echoes.map(|vessel| vessel.id.clone()).collect();
        let vessels = seen.into_iter().filter(|(_, is_hidden, ..)| !is_hidden).map(|(.., vessel)| vessel);
        OwnCraft { vessels: vessels.take(OWN_MAX).collect(), echoes }
    }
}

impl Craft {
    /// The craft, by its order in its mission, as a vessel with positions from `origin`. One that
    /// `leads` has a plan.
    fn seen_from(
        self,
        (origin, order): (Origin, usize),
        leads: bool,
        is_orderly: bool,
        now: f64,
    ) -> Option<Vessel> {
        let straight = || {
            let end = now.max(self.t_s) + STRAIGHT;
            let [north, east] = (self.position + self.velocity * (end - self.t_s)).into();
            vec![[end, north, east]]
        };
        let plan = match leads {
            true if is_orderly && !self.plan.is_empty() => self.plan,
            true => straight(),
            false => vec![],
        };
        let name = self.mission.metadata.get("bridge").and_then(|name| name.as_str());
        let name = self.id.as_deref().or(name).unwrap_or(&self.mission.title);
        let id = match self.id {
            None => self.mission.id.clone(),
            Some(_) => format!("{}/{order}", self.mission.id),
        };
        let id = VehicleId(id);
        let mut vessel = Vessel {
            name: Some(name.to_owned()).filter(|name| is_name(name)),
            ..Vessel::of_craft(id, self.t_s, self.position, self.velocity, plan)
        };
        if self.origin != origin {
            let change = DatumChange::new(self.origin, origin)?;
            vessel.positions_mut().for_each(|(north, east)| change.position(north, east));
        }
        vessel.faults("").is_empty().then_some(vessel)
    }
}

/// `true` for what a vessel may be called.
fn is_name(name: &str) -> bool {
    (1..=ID_LENGTH_MAX).contains(&name.len()) && !name.contains(char::is_control)
}

fn are_of_one_bridge(one: &Mission, other: &Mission) -> bool {
    let [one, other] = [one, other].map(|mission| mission.metadata.get("bridge"));
    one.is_some() && one == other
}

/// `true` for places within the range of each other, and some beyond it.
fn are_near(one: &Origin, other: &Origin) -> bool {
    const METRES_PER_DEGREE: f64 = 111_000.0;
    let east = (one.lon_deg - other.lon_deg + 180.0).rem_euclid(360.0) - 180.0;
    let north = one.lat_deg - other.lat_deg;
    let range = RANGE / METRES_PER_DEGREE;
    north.abs() <= range && east.abs() * one.lat_deg.to_radians().cos() <= range
}

/// `true` if a reported `vessel` is the `craft`, as its name or else its motion says. One that
/// `was` an echo stays so for longer.
fn is_echo(vessel: &Vessel, craft: &Vessel, was: bool, now: f64) -> bool {
    let ((place, velocity), (there, their_velocity)) = (at(vessel, now), at(craft, now));
    let (distance, difference) = ECHO[usize::from(was)];
    let is_near = (place - there).norm() < distance && (velocity - their_velocity).norm() < difference;
    let is_small = vessel.length_m.is_none_or(|length| length <= ECHO_LENGTH);
    let is_named = has_name_of(vessel, craft, was, now);
    // What AIS says of a craft that is silent is newer than what its mission knows.
    let is_heard = now - craft.t_s.unwrap_or(now) <= HEARD;
    vessel.id == craft.id || is_heard && (is_named || is_near && is_small)
}

/// The position and velocity of a vessel at `now`, s.
fn at(vessel: &Vessel, now: f64) -> (Vector2<f64>, Vector2<f64>) {
    let velocity = vessel.velocity().unwrap_or_else(Vector2::zeros);
    (vessel.position() + velocity * (now - vessel.t_s.unwrap_or(now)), velocity)
}

/// `true` if `vessel` has the name of `craft`, and is near it, or `was` an echo of it before: an old
/// position of it is far off by now.
fn has_name_of(vessel: &Vessel, craft: &Vessel, was: bool, now: f64) -> bool {
    let name = |of: &Vessel| of.name.as_ref().map(|name| name.to_lowercase());
    let is_near = was || (at(vessel, now).0 - at(craft, now).0).norm() < NAMED_WITHIN;
    is_near && name(vessel).is_some_and(|name_of| !name_of.is_empty() && Some(name_of) == name(craft))
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    const ORIGIN: Origin = Origin { lat_deg: 38.41, lon_deg: -9.12 };

    fn mission(craft: &str) -> Arc<Mission> {
        let mission = json!({ "id": format!("m-{craft}"), "title": craft, "kind": "live", "status": "running",
            "created_s": 0.0, "t_s": 0.0, "sequence": 1, "metadata": { "bridge": craft } });
        Arc::new(serde_json::from_value(mission).expect("has the shape"))
    }

    /// A craft that goes north at 1 m/s, 30 m north of its origin at 100 s.
    fn craft(name: &str, t_s: f64, is_orderly: bool) -> Craft {
        Craft {
            mission: mission(name),
            id: None,
            origin: ORIGIN,
            place: ORIGIN,
            t_s,
            position: Vector2::new(t_s - 70.0, 0.0),
            velocity: Vector2::new(1.0, 0.0),
            plan: vec![[t_s + 5.0, 50.0, 9.0]],
            period: 1.0,
            is_orderly,
        }
    }

    fn seen(berth: &Berth, now: f64) -> Vec<(String, usize)> {
        let seen = berth.look(now, [].into_iter(), &OwnCraft::default()).vessels;
        seen.into_iter().map(|vessel| (vessel.id.0, vessel.plan.len())).collect()
    }

    #[test]
    fn the_later_mission_sees_the_earlier_plan_and_the_earlier_one_only_a_craft_that_cannot_give_way() {
        let fleet = Fleet::new(None);
        let [earlier, later] = [fleet.place(3), fleet.place(7)];
        earlier.show(vec![(0, craft("one", 100.0, true))], 100.0);
        later.show(vec![(0, craft("two", 100.0, false))], 100.0);
        assert_eq!(seen(&earlier, 100.0), [("m-two".to_owned(), 0)]);
        assert_eq!(seen(&later, 100.0), [("m-one".to_owned(), 1)]);
        later.show(vec![(0, craft("two", 101.0, true))], 101.0);
        assert_eq!(seen(&earlier, 101.0), []);
        // Reports alone are no orderly plans.
        later.show(vec![(0, craft("two", 108.0, false))], 108.0);
        assert_eq!((seen(&earlier, 109.0).len(), seen(&earlier, 109.1).len()), (0, 1));
        // Orderly again, but not for long.
        for t in 110..=139 {
            later.show(vec![(0, craft("two", f64::from(t), true))], f64::from(t));
            assert_eq!(seen(&earlier, f64::from(t)).len(), 1, "{t}");
        }
        later.show(vec![(0, craft("two", 140.0, true))], 140.0);
        assert_eq!(seen(&earlier, 140.0), []);
        // The earlier one has not planned any more: it is taken to go straight on.
        let straight = &later.look(140.0, [].into_iter(), &OwnCraft::default()).vessels[0];
        assert_eq!(straight.plan, [[200.0, 130.0, 0.0]]);
        // Another mission of the same bridge has the same craft.
        earlier.show(vec![(0, craft("two", 140.0, true))], 140.0);
        assert_eq!(seen(&later, 140.0), []);
        earlier.show(vec![(0, craft("one", 140.0, true))], 140.0);
        assert_eq!(seen(&later, 140.0).len(), 1);
        earlier.leave();
        assert_eq!(seen(&later, 140.0), []);
    }

    #[test]
    fn a_craft_that_ais_tells_of_too_counts_once_and_is_seen_from_the_other_origin() {
        let fleet = Fleet::new(None);
        let [earlier, later] = [fleet.place(3), fleet.place(7)];
        earlier.show(vec![(0, craft("one", 100.0, true))], 100.0);
        let north = Origin { lat_deg: 38.411, ..ORIGIN };
        later.show(vec![(0, Craft { origin: north, ..craft("two", 100.0, true) })], 100.0);
        let here = later.look(100.0, [].into_iter(), &OwnCraft::default()).vessels.remove(0);
        // A thousandth of a degree of latitude is 111 m here.
        assert!((here.north_m + 81.0).abs() < 0.1 && here.east_m.abs() < 0.1, "{here:?}");
        let vessel = |id: &str, ahead: f64| Vessel {
            id: VehicleId(id.to_owned()),
            name: None,
            north_m: here.north_m + ahead,
            length_m: None,
            ..here.clone()
        };
        let large = Vessel { length_m: Some(60.0), ..vessel("ferry", 5.0) };
        let called = |id: &str, ahead: f64| Vessel { name: Some("ONE".to_owned()), ..vessel(id, ahead) };
        let (named, namesake) = (called("named", 400.0), called("namesake", 900.0));
        let reported = [vessel("near", 15.0), vessel("far", 40.0), large, named, namesake];
        let first = later.look(100.0, reported.iter(), &OwnCraft::default());
        let ids = |seen: &OwnCraft| seen.echoes.iter().map(|id| id.0.clone()).collect::<Vec<_>>();
        assert_eq!(ids(&first), ["near", "named"]);
        // One that was an echo stays so for longer.
        let before = OwnCraft { echoes: vec![VehicleId("far".to_owned())], ..first };
        assert_eq!(ids(&later.look(100.0, reported.iter(), &before)), ["near", "far", "named"]);
        // What AIS says of a craft that its mission does not hear is newer.
        assert_eq!(ids(&later.look(111.0, reported.iter(), &before)), [""; 0]);
    }
}
