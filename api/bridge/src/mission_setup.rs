//! Completes the body of a new mission from the autopilot's parameters and the craft's position.
//!
//! The body stays the operator's JSON, whose faults the service names. Only `limits` and `craft`
//! are read, if they have the API's shape.

use ::wire::{CraftDescription, DeclaredLimits, HeadingLoop, HeadingReference, SpeedReference, SurgeLoop};
use serde::de::DeserializeOwned;
use serde_json::{Value, json};

use crate::{Origin, mavlink::Parameters, recent_positions::moved};

/// Larger limits make no difference with one or two plans per second, rad/s, m/s².
const TURN_RATE_MAX: f64 = 2.0;
const ACCELERATION_MAX: f64 = 4.0;
/// Time, s, and distance, m, of agreeing positions after a receiver has started.
const SETTLED_S: f64 = 3.0;
const SETTLED_M: f64 = 15.0;

/// `true` for a mission without origin and positions in metres, whose origin only operators know.
pub(crate) fn needs_origin(live: &Value) -> bool {
    let has = |of: &Value, members: &[&str]| members.iter().any(|member| !of[*member].is_null());
    let auvs = live["auvs"].as_array().map_or(&[][..], Vec::as_slice);
    // Areas from a file are in degrees.
    let in_metres = |area: &Value| {
        area["polygon"][0].is_array()
            || area["holes"].as_array().into_iter().flatten().any(|hole| hole[0].is_array())
    };
    !has(live, &["origin", "path", "keep_outs", "area"])
        && !live["no_go"].as_array().into_iter().flatten().any(in_metres)
        && !auvs.iter().any(|auv| has(auv, &["path"]))
}

/// Finds the origin of a mission: not the first position of a receiver that is starting.
#[derive(Debug, Default)]
pub(crate) struct Settling {
    /// The beginning of agreement, s, and its first position.
    since: Option<(f64, Origin)>,
}

impl Settling {
    /// The `position` at `now_s`, s, if positions have agreed for long enough.
    pub(crate) fn settled(&mut self, now_s: f64, position: Option<Origin>) -> Option<Origin> {
        let agrees = |first: &Origin| position.is_some_and(|now| moved(first, &now).norm() <= SETTLED_M);
        let since = self.since.filter(|(_, first)| agrees(first));
        self.since = since.or(position.map(|position| (now_s, position)));
        position.filter(|_| self.since.is_some_and(|(since, _)| now_s - since >= SETTLED_S))
    }
}

/// A member of `live`, the default if it is left out; `None` if the service will reject it.
pub(crate) fn declared<T: DeserializeOwned + Default>(live: &Value, member: &str) -> Option<T> {
    match &live[member] {
        Value::Null => Some(T::default()),
        given => T::deserialize(given).ok(),
    }
}

/// The part of `live` that describes the craft of that name in a fleet, or the only one.
pub(crate) fn own_part<'a>(live: &'a mut Value, craft: Option<&str>) -> &'a mut Value {
    let fleet = live["surface_craft"].as_array();
    let place = fleet.and_then(|fleet| fleet.iter().position(|own| own["id"].as_str() == craft));
    match place {
        Some(place) => &mut live["surface_craft"][place],
        None => live,
    }
}

/// Adds craft and limits that `live` does not state, from the autopilot, if its wire tells what its
/// heading loop holds, and its parameters. A speed limit beyond the autopilot's is lowered to it.
pub(crate) fn complete(live: &mut Value, parameters: &Parameters, heading_held: Option<HeadingReference>) {
    let at_most = |value: Option<f64>, most: f64| value.map(|value| value.min(most));
    let turn_rate = at_most(parameters.turn_rate_max(), TURN_RATE_MAX);
    let acceleration = at_most(parameters.acceleration_max(), ACCELERATION_MAX);
    let deceleration = at_most(parameters.deceleration_max(), ACCELERATION_MAX);
    if heading_held.is_some() && live["craft"].is_null() {
        live["craft"] = json!(CraftDescription::<f64> {
            speed_held: Some(SpeedReference::OverGround),
            heading_held,
            // Without this, the planner assumes a slow craft.
            heading_loop: HeadingLoop { rate_max_radps: turn_rate, ..HeadingLoop::default() },
            surge_loop: SurgeLoop {
                acceleration_max_mps2: acceleration,
                deceleration_max_mps2: deceleration,
                ..SurgeLoop::default()
            },
            ..CraftDescription::default()
        });
    }
    if let Some(mut limits) = declared::<DeclaredLimits>(live, "limits") {
        let steerage_way = parameters.steerage_way().filter(|_| heading_held.is_some());
        // A plan of more would find that the craft does not follow.
        let fastest = [limits.speed_max_mps, parameters.speed_max()].into_iter().flatten().reduce(f64::min);
        let is_above = |fastest: &f64| limits.speed_min_mps.is_none_or(|slowest| slowest < 0.9 * fastest);
        limits.speed_max_mps = fastest.filter(is_above).or(limits.speed_max_mps);
        let half = 0.5 * limits.speed_max_mps.unwrap_or(f64::INFINITY);
        limits.speed_min_mps = limits.speed_min_mps.or(at_most(steerage_way, half));
        limits.turn_rate_max_radps = limits.turn_rate_max_radps.or(turn_rate);
        limits.acceleration_max_mps2 = limits.acceleration_max_mps2.or(acceleration);
        limits.deceleration_max_mps2 = limits.deceleration_max_mps2.or(deceleration);
        live["limits"] = json!(limits);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::on_earth;

    #[test]
    fn only_the_operator_sets_the_origin_of_positions_in_metres() {
        let auvs = json!([{ "id": "a" }]);
        for (live, needs) in [
            (json!({ "auvs": auvs }), true),
            (json!({ "auvs": auvs, "origin": { "lat_deg": 1.0, "lon_deg": 2.0 } }), false),
            (json!({ "auvs": auvs, "keep_outs": [] }), false),
            (json!({ "auvs": [{ "id": "a", "path": {} }] }), false),
            (json!({ "auvs": auvs, "no_go": [{ "polygon": [[1, 2], [3, 4], [5, 0]] }] }), false),
            (json!({ "auvs": auvs, "no_go": [{ "polygon": [{ "lat_deg": 1, "lon_deg": 2 }] }] }), true),
        ] {
            assert_eq!(needs_origin(&live), needs, "{live}");
        }
    }

    #[test]
    fn the_first_positions_of_a_starting_receiver_are_no_origin() {
        let at = |lat_deg| on_earth(lat_deg, -9.0);
        let mut settling = Settling::default();
        // Last week's place, nothing, two kilometres off, then the craft's own, under way at 2 m/s.
        let starting = [at(12.0), at(12.0), None, at(38.02), at(38.01)];
        for (second, position) in (0_u8..).zip(starting) {
            assert_eq!(settling.settled(f64::from(second), position), None);
        }
        let under_way = |second: f64| at(38.0 + second * 1.8e-5);
        let settled =
            (5_u8..10).map(f64::from).find_map(|second| settling.settled(second, under_way(second)));
        assert_eq!(settled, under_way(8.0));
    }

    #[test]
    fn parameters_complete_what_the_operator_leaves_out() {
        let mut parameters = Parameters::default();
        for (name, value) in [("WP_SPEED", 1.0), ("ATC_STR_RAT_MAX", 720.0), ("SERVO1_FUNCTION", 26.0)] {
            parameters.note(name, value);
        }
        let mut live = json!({ "limits": { "speed_max_mps": 0.25 } });
        complete(&mut live, &parameters, Some(HeadingReference::Heading));
        let limits = json!({ "speed_min_mps": 0.125, "speed_max_mps": 0.25, "turn_rate_max_radps": 2.0 });
        assert_eq!(live["limits"], limits);
        assert_eq!(live["craft"]["heading_loop"], json!({ "rate_max_radps": 2.0 }));
        // A plan is no faster than the autopilot.
        let mut live = json!({ "limits": { "speed_max_mps": 3.0 } });
        complete(&mut live, &parameters, Some(HeadingReference::Heading));
        assert_eq!(live["limits"]["speed_max_mps"], 1.0);
        // A wrong member is for the service to name.
        let mut wrong = json!({ "limits": { "sped": 1 }, "craft": {} });
        complete(&mut wrong, &parameters, Some(HeadingReference::Heading));
        assert_eq!(wrong, json!({ "limits": { "sped": 1 }, "craft": {} }));
    }
}
