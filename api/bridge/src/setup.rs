//! What the autopilot itself says of the craft, for a mission that is to be made.

use serde_json::{Map, Value, json};

use crate::mavlink::Parameters;

/// Limits beyond these matter to no craft that is planned for once or twice a second, rad/s, m/s².
const TURN_RATE_MAX: f64 = 2.0;
const ACCELERATION_MAX: f64 = 4.0;

/// Completes the body of a new mission by what an autopilot's references mean, and by what its parameters allow, where the body
/// does not say it.
pub(crate) fn complete(setup: &mut Value, parameters: &Parameters, is_autopilot: bool) {
    let live = &mut setup["live"];
    let turn_rate = parameters.turn_rate_max().map(|rate| rate.min(TURN_RATE_MAX));
    let acceleration = parameters
        .acceleration_max()
        .map(|most| most.min(ACCELERATION_MAX));
    let deceleration = parameters
        .deceleration_max()
        .map(|most| most.min(ACCELERATION_MAX));
    if is_autopilot && live["craft"].is_null() {
        live["craft"] = json!({
            "speed_held": "over_ground",
            "heading_held": "heading",
            // A craft of which this is not said is taken for a slow one.
            "heading_loop": { "rate_max_radps": turn_rate },
            "surge_loop": { "acceleration_max_mps2": acceleration, "deceleration_max_mps2": deceleration },
        });
    }
    let told_max = live["limits"]["speed_max_mps"].as_f64().unwrap_or(f64::INFINITY);
    let steerage_way = parameters
        .steerage_way()
        .filter(|_| is_autopilot)
        .map(|least| least.min(0.5 * told_max));
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
