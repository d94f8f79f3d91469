//! Completes the body of a new mission from the autopilot's parameters and the craft's position.

use serde_json::{Map, Value, json};

use crate::{Geographic, mavlink::Parameters, recent_positions::moved};

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
    !has(live, &["origin", "path", "keep_outs", "area"]) && !auvs.iter().any(|auv| has(auv, &["path"]))
}

/// Finds the origin of a mission: not the first position of a receiver that is starting.
#[derive(Debug, Default)]
pub(crate) struct Settling {
    /// The beginning of agreement, s, and its first position.
    since: Option<(f64, Geographic)>,
}

impl Settling {
    /// The `position` at `now_s`, s, if positions have agreed for long enough.
    pub(crate) fn settled(&mut self, now_s: f64, position: Option<Geographic>) -> Option<Geographic> {
        let agrees = |first: &Geographic| position.is_some_and(|now| moved(first, &now).norm() <= SETTLED_M);
        self.since = self
            .since
            .filter(|(_, first)| agrees(first))
            .or(position.map(|position| (now_s, position)));
        position.filter(|_| self.since.is_some_and(|(since, _)| now_s - since >= SETTLED_S))
    }
}

/// Adds craft and limits that the body does not state, from the autopilot and its parameters.
pub(crate) fn complete(setup: &mut Value, parameters: &Parameters, is_autopilot: bool) {
    let live = &mut setup["live"];
    let at_most = |value: Option<f64>, most: f64| value.map(|value| value.min(most));
    let turn_rate = at_most(parameters.turn_rate_max(), TURN_RATE_MAX);
    let acceleration = at_most(parameters.acceleration_max(), ACCELERATION_MAX);
    let deceleration = at_most(parameters.deceleration_max(), ACCELERATION_MAX);
    if is_autopilot && live["craft"].is_null() {
        live["craft"] = json!({
            "speed_held": "over_ground",
            "heading_held": "heading",
            // Without this, the planner assumes a slow craft.
            "heading_loop": { "rate_max_radps": turn_rate },
            "surge_loop": { "acceleration_max_mps2": acceleration, "deceleration_max_mps2": deceleration },
        });
    }
    let body_max = live["limits"]["speed_max_mps"].as_f64().unwrap_or(f64::INFINITY);
    let steerage_way = parameters
        .steerage_way()
        .filter(|_| is_autopilot)
        .map(|least| least.min(0.5 * body_max));
    let known = [
        ("speed_min_mps", steerage_way),
        ("speed_max_mps", parameters.speed_max()),
        ("turn_rate_max_radps", turn_rate),
        ("acceleration_max_mps2", acceleration),
        ("deceleration_max_mps2", deceleration),
    ];
    if live["limits"].is_null() {
        live["limits"] = Map::new().into();
    }
    for (name, value) in known {
        if let (Some(value), true) = (value, live["limits"][name].is_null()) {
            live["limits"][name] = value.into();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_operator_sets_the_origin_of_positions_in_metres() {
        let auvs = json!([{ "id": "a" }]);
        assert!(needs_origin(&json!({ "auvs": auvs })));
        for live in [
            json!({ "auvs": auvs, "origin": { "lat_deg": 1.0, "lon_deg": 2.0 } }),
            json!({ "auvs": auvs, "keep_outs": [] }),
            json!({ "auvs": [{ "id": "a", "path": {} }] }),
        ] {
            assert!(!needs_origin(&live), "{live}");
        }
    }

    #[test]
    fn the_first_positions_of_a_starting_receiver_are_no_origin() {
        let at = |lat_deg| {
            Some(Geographic {
                lat_deg,
                lon_deg: -9.0,
            })
        };
        let mut settling = Settling::default();
        // Last week's place, nothing, two kilometres off, then the craft's own, under way at 2 m/s.
        let starting = [at(12.0), at(12.0), None, at(38.02), at(38.01)];
        for (second, position) in (0_u8..).zip(starting) {
            assert_eq!(settling.settled(f64::from(second), position), None);
        }
        let under_way = |second: f64| at(38.0 + second * 1.8e-5);
        let settled: Vec<_> = (5_u8..10)
            .filter_map(|second| settling.settled(f64::from(second), under_way(f64::from(second))))
            .collect();
        assert_eq!(settled.first().copied(), under_way(8.0));
    }
}
