//! How a surface craft answers its references, in a client's JSON, and back.
//!
//! One shape wherever a craft is described: in a snapshot, a mission, a scenario, a craft file.

use planner::craft::{
    self as domain, CraftDescription, HeadingDynamics, Integrator, PRESETS, Preset, PropulsionPower,
};
use serde::{Deserialize, Serialize};
use serde_json::json;
use utoipa::ToSchema;

use crate::FieldError;

/// How the surface craft answers its references, its own loops closed. All members may be left out: what is not stated
/// is taken from the `preset` and, without one, learnt.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Craft {
    /// Name of a known craft of which everything is taken that is not stated here: see `GET /v1/crafts`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(example = "medusa")]
    pub preset: Option<String>,
    /// How the heading loop answers.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub heading_loop: Option<HeadingLoop>,
    /// How the speed loop answers.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub surge_loop: Option<SurgeLoop>,
    /// Sway per surge and yaw rate, s, from −5 to 20: positive where the craft drifts outwards in a turn. Sway is
    /// −`sway_per_yaw_rate_s` times surge times yaw rate.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(example = 0.9)]
    pub sway_per_yaw_rate_s: Option<f64>,
    /// Power that propulsion draws at a steady speed through the water.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub power: Option<Power>,
    /// What the speed reference is held against.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub speed_held: Option<SpeedHeld>,
    /// What the heading reference is held against.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub heading_held: Option<HeadingHeld>,
    /// Standard deviation of the stated numbers, as a part of each, from 0 (certain) to 2.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(example = 0.1)]
    pub relative_uncertainty: Option<f64>,
}

/// How a heading loop answers: with a time constant, or with a natural frequency and a damping ratio.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct HeadingLoop {
    /// Time constant of a first-order answer, s, from 0 (at once) to 60. Either this, or `natural_frequency_radps`
    /// and `damping`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub time_constant_s: Option<f64>,
    /// Natural frequency of a second-order answer, rad/s, from 0.02 to 20; together with `damping`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(example = 1.6)]
    pub natural_frequency_radps: Option<f64>,
    /// Damping ratio of a second-order answer, from 0.1 to 5; together with `natural_frequency_radps`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(example = 0.8)]
    pub damping: Option<f64>,
    /// Time until a reference begins to act, s, from 0 to 10.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(example = 0.1)]
    pub delay_s: Option<f64>,
    /// Fastest turn that the loop makes, rad/s, from 0.001 to 3.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(example = 0.3)]
    pub rate_max_radps: Option<f64>,
}

/// How a speed loop answers.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct SurgeLoop {
    /// Time constant of the answer to a small step, s, from 0 (at once) to 60.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(example = 2.5)]
    pub time_constant_s: Option<f64>,
    /// Time until a reference begins to act, s, from 0 to 10.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(example = 0.0)]
    pub delay_s: Option<f64>,
    /// Largest acceleration ahead, m/s², from 0.001 to 10.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(example = 0.09)]
    pub acceleration_max_mps2: Option<f64>,
    /// Largest deceleration, m/s², positive, from 0.001 to 10.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(example = 0.09)]
    pub deceleration_max_mps2: Option<f64>,
    /// Whether the loop has an integrator that winds up noticeably. `false` says that it has none; `integral_time_s`
    /// says that it has one. With neither, that is learnt. Not `null`, which many programs write for what they do not
    /// know.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub integrates: Option<bool>,
    /// Time in which the integrator gathers what the proportional part asks for, k_p/k_i, s, from 0.5 to 600.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(example = 8.7)]
    pub integral_time_s: Option<f64>,
}

/// Power that propulsion draws at a steady speed through the water: linear · u + cubic · u³.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Power {
    /// Linear coefficient, W/(m/s), from 0 to 10⁶. Default: 0.
    #[serde(default)]
    pub linear_w_per_mps: f64,
    /// Cubic coefficient, W/(m/s)³, from 0 to 10⁶. Default: 0.
    #[serde(default)]
    #[schema(example = 27.5)]
    pub cubic_w_per_mps3: f64,
}

/// What a speed loop measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum SpeedHeld {
    /// Surge speed through the water.
    ThroughWater,
    /// Velocity over ground along the bow.
    OverGround,
}

/// What a heading loop measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum HeadingHeld {
    /// Where the bow points.
    Heading,
    /// The direction of the velocity over ground.
    Course,
}

impl TryFrom<&Craft> for CraftDescription {
    type Error = Vec<FieldError>;

    /// Fails with everything that is wrong, pointers from `/craft` on.
    fn try_from(craft: &Craft) -> Result<Self, Vec<FieldError>> {
        let mut invalid = Vec::new();
        let description = read_craft(craft, &mut invalid);
        invalid.extend(description.faults().iter().map(FieldError::from));
        if invalid.is_empty() {
            Ok(description)
        } else {
            Err(invalid)
        }
    }
}

/// What `craft` says. Unknown names and members that contradict each other go into `invalid`; ranges are
/// [`CraftDescription::faults`]' affair.
pub(super) fn read_craft(craft: &Craft, invalid: &mut Vec<FieldError>) -> CraftDescription {
    let preset = craft.preset.as_ref().and_then(|name| {
        let preset = Preset::named(name);
        if preset.is_none() {
            let known: Vec<_> = PRESETS.iter().map(|preset| preset.name).collect();
            let detail = format!("the known craft are {}", known.join(", "));
            invalid.push(
                FieldError::new("/craft/preset", "unknown_preset", detail)
                    .given(name.as_str())
                    .limit(json!(known)),
            );
        }
        preset
    });
    let heading = craft.heading_loop.clone().unwrap_or_default();
    let surge = craft.surge_loop.clone().unwrap_or_default();
    CraftDescription {
        preset,
        heading_dynamics: heading_dynamics(&heading, invalid),
        heading_delay: heading.delay_s,
        heading_rate_max: heading.rate_max_radps,
        surge_time_constant: surge.time_constant_s,
        surge_delay: surge.delay_s,
        acceleration_max: surge.acceleration_max_mps2,
        deceleration_max: surge.deceleration_max_mps2,
        integrator: integrator(&surge, invalid),
        sway_per_yaw_rate: craft.sway_per_yaw_rate_s,
        power: craft.power.map(|power| PropulsionPower {
            linear: power.linear_w_per_mps,
            cubic: power.cubic_w_per_mps3,
        }),
        speed_held: craft.speed_held.map(domain::SpeedHeld::from),
        heading_held: craft.heading_held.map(domain::HeadingHeld::from),
        relative_uncertainty: craft.relative_uncertainty,
    }
}

fn heading_dynamics(heading: &HeadingLoop, invalid: &mut Vec<FieldError>) -> Option<HeadingDynamics> {
    let mut fault = |member: &str, code: &str, detail: &str| {
        let pointer = format!("/craft/heading_loop/{member}");
        invalid.push(FieldError::new(pointer, code, detail));
        None
    };
    let together = "`natural_frequency_radps` and `damping` come together or not at all";
    match (
        heading.time_constant_s,
        heading.natural_frequency_radps,
        heading.damping,
    ) {
        (None, None, None) => None,
        (Some(time_constant), None, None) => Some(HeadingDynamics::FirstOrder { time_constant }),
        (None, Some(natural_frequency), Some(damping)) => Some(HeadingDynamics::SecondOrder {
            natural_frequency,
            damping,
        }),
        (None, Some(_), None) => fault("damping", "missing", together),
        (None, None, Some(_)) => fault("natural_frequency_radps", "missing", together),
        (Some(_), Some(_), _) | (Some(_), _, Some(_)) => fault(
            "time_constant_s",
            "unexpected",
            "either a time constant, or a natural frequency and a damping ratio",
        ),
    }
}

fn integrator(surge: &SurgeLoop, invalid: &mut Vec<FieldError>) -> Option<Integrator> {
    let mut fault = |member: &str, code: &str, detail: &str| {
        let pointer = format!("/craft/surge_loop/{member}");
        invalid.push(FieldError::new(pointer, code, detail));
        None
    };
    match (surge.integrates, surge.integral_time_s) {
        (None, None) => None,
        (Some(false), None) => Some(Integrator::Absent),
        (None | Some(true), Some(time)) => Some(Integrator::Gathers { time }),
        (Some(true), None) => fault(
            "integral_time_s",
            "missing",
            "an integrator is stated by its time; leave `integrates` out to have it learnt",
        ),
        (Some(false), Some(_)) => fault(
            "integral_time_s",
            "unexpected",
            "a loop that does not integrate has no integral time",
        ),
    }
}

impl From<&domain::Craft> for Craft {
    /// Everything stated, and nothing of how surely.
    fn from(craft: &domain::Craft) -> Self {
        Self::from(&CraftDescription::from(craft))
    }
}

impl From<&CraftDescription> for Craft {
    fn from(description: &CraftDescription) -> Self {
        let (time_constant_s, natural_frequency_radps, damping) = match description.heading_dynamics {
            Some(HeadingDynamics::FirstOrder { time_constant }) => (Some(time_constant), None, None),
            Some(HeadingDynamics::SecondOrder {
                natural_frequency,
                damping,
            }) => (None, Some(natural_frequency), Some(damping)),
            None => (None, None, None),
        };
        let heading_loop = HeadingLoop {
            time_constant_s,
            natural_frequency_radps,
            damping,
            delay_s: description.heading_delay,
            rate_max_radps: description.heading_rate_max,
        };
        let surge_loop = SurgeLoop {
            time_constant_s: description.surge_time_constant,
            delay_s: description.surge_delay,
            acceleration_max_mps2: description.acceleration_max,
            deceleration_max_mps2: description.deceleration_max,
            integrates: match description.integrator {
                Some(Integrator::Absent) => Some(false),
                Some(Integrator::Gathers { .. }) | None => None,
            },
            integral_time_s: description.integrator.and_then(Integrator::time),
        };
        Self {
            preset: description.preset.map(|preset| preset.name.to_owned()),
            heading_loop: Some(heading_loop).filter(|stated| *stated != HeadingLoop::default()),
            surge_loop: Some(surge_loop).filter(|stated| *stated != SurgeLoop::default()),
            sway_per_yaw_rate_s: description.sway_per_yaw_rate,
            power: description.power.map(|power| Power {
                linear_w_per_mps: power.linear,
                cubic_w_per_mps3: power.cubic,
            }),
            speed_held: description.speed_held.map(SpeedHeld::from),
            heading_held: description.heading_held.map(HeadingHeld::from),
            relative_uncertainty: description.relative_uncertainty,
        }
    }
}

#[cfg(test)]
mod tests {
    use serde_json::Value;

    use super::*;

    fn read(craft: Value) -> Result<CraftDescription, Vec<FieldError>> {
        let craft: Craft = serde_json::from_value(craft).expect("of the shape");
        CraftDescription::try_from(&craft)
    }

    fn faults(craft: Value) -> Vec<(String, String)> {
        let faults = read(craft).expect_err("wrong");
        faults
            .into_iter()
            .map(|fault| (fault.pointer, fault.code))
            .collect()
    }

    #[test]
    fn a_craft_stated_whole_is_read_as_stated_and_written_as_read() {
        let stated = json!({
            "heading_loop": {
                "natural_frequency_radps": 1.6, "damping": 0.8, "delay_s": 0.1, "rate_max_radps": 0.3
            },
            "surge_loop": {
                "time_constant_s": 2.5, "delay_s": 0.0, "acceleration_max_mps2": 0.09,
                "deceleration_max_mps2": 0.08, "integral_time_s": 8.7
            },
            "sway_per_yaw_rate_s": 0.9,
            "power": { "linear_w_per_mps": 0.0, "cubic_w_per_mps3": 27.5 },
            "speed_held": "over_ground",
            "heading_held": "course",
            "relative_uncertainty": 0.1
        });
        let description = read(stated.clone()).expect("right");
        assert_eq!(
            description.heading_dynamics,
            Some(HeadingDynamics::SecondOrder {
                natural_frequency: 1.6,
                damping: 0.8
            })
        );
        assert_eq!(description.deceleration_max, Some(0.08));
        assert_eq!(description.integrator, Some(Integrator::Gathers { time: 8.7 }));
        assert_eq!(description.speed_held, Some(domain::SpeedHeld::OverGround));
        assert_eq!(description.heading_held, Some(domain::HeadingHeld::Course));
        let written = serde_json::to_value(Craft::from(&description)).expect("JSON");
        assert_eq!(written, stated);
    }

    #[test]
    fn a_craft_of_which_nothing_is_stated_leaves_everything_to_be_learnt() {
        assert_eq!(read(json!({})).expect("right"), CraftDescription::default());
        let written = serde_json::to_value(Craft::from(&CraftDescription::default())).expect("JSON");
        assert_eq!(written, json!({}));
    }

    #[test]
    fn a_preset_is_known_by_its_name_and_an_unknown_one_is_answered_with_the_names_there_are() {
        let description = read(json!({ "preset": "medusa" })).expect("right");
        assert_eq!(description.preset.map(|preset| preset.name), Some("medusa"));
        let faults = read(json!({ "preset": "titanic" })).expect_err("no such craft");
        assert_eq!(faults[0].pointer, "/craft/preset");
        assert_eq!(faults[0].code, "unknown_preset");
        assert_eq!(faults[0].given, Some(json!("titanic")));
        assert!(faults[0].detail.contains("medusa"), "{}", faults[0].detail);
    }

    #[test]
    fn a_heading_loop_has_a_time_constant_or_a_natural_frequency_with_its_damping() {
        let fault = |heading: Value| faults(json!({ "heading_loop": heading }));
        let expected =
            |member: &str, code: &str| vec![(format!("/craft/heading_loop/{member}"), code.to_owned())];
        assert_eq!(
            fault(json!({ "time_constant_s": 1.0, "natural_frequency_radps": 1.0, "damping": 1.0 })),
            expected("time_constant_s", "unexpected")
        );
        assert_eq!(
            fault(json!({ "time_constant_s": 1.0, "damping": 1.0 })),
            expected("time_constant_s", "unexpected")
        );
        assert_eq!(
            fault(json!({ "damping": 1.0 })),
            expected("natural_frequency_radps", "missing")
        );
        assert_eq!(
            fault(json!({ "natural_frequency_radps": 1.0 })),
            expected("damping", "missing")
        );
    }

    #[test]
    fn that_a_loop_does_not_integrate_is_said_and_not_left_out() {
        let said = |surge: Value| read(json!({ "surge_loop": surge })).expect("right").integrator;
        assert_eq!(said(json!({ "integrates": false })), Some(Integrator::Absent));
        assert_eq!(said(json!({})), None);
        assert_eq!(
            said(json!({ "integrates": true, "integral_time_s": 9.0 })),
            Some(Integrator::Gathers { time: 9.0 })
        );
        for contradiction in [
            json!({ "integrates": false, "integral_time_s": 9.0 }),
            json!({ "integrates": true }),
        ] {
            assert_eq!(
                faults(json!({ "surge_loop": contradiction }))[0].0,
                "/craft/surge_loop/integral_time_s"
            );
        }
    }

    #[test]
    fn a_number_beyond_its_range_is_named_with_the_value_and_the_limit() {
        let faults = read(json!({ "heading_loop": { "time_constant_s": 61.0 } })).expect_err("too slow");
        assert_eq!(faults.len(), 1);
        assert_eq!(faults[0].pointer, "/craft/heading_loop/time_constant_s");
        assert_eq!(faults[0].code, "out_of_range");
        assert_eq!(faults[0].given, Some(json!(61.0)));
        assert_eq!(faults[0].limit, Some(json!({ "least": 0.0, "most": 60.0 })));
        assert!(read(json!({ "heading_loop": { "time_constant_s": 0.0 } })).is_ok());
    }

    #[test]
    fn a_member_that_no_craft_has_is_refused() {
        let typo = serde_json::from_value::<Craft>(json!({ "surge_loop": { "time_constant": 2.0 } }));
        assert!(typo.is_err());
    }

    #[test]
    fn every_preset_survives_being_written_and_read() {
        for preset in PRESETS {
            let written = serde_json::to_value(Craft::from(&preset.craft)).expect("JSON");
            let expected = CraftDescription::from(&preset.craft);
            assert_eq!(read(written).expect("right"), expected, "{}", preset.name);
        }
    }
}
