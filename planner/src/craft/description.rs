//! A client's description of its craft, and its checks.

use std::ops::RangeInclusive;

use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize};
use serde_with::skip_serializing_none;
use utoipa::ToSchema;

use crate::craft::closed_loop::{
    Craft, HeadingDynamics, HeadingReference, HeadingResponse, Power, SpeedReference, SurgeResponse,
};
use crate::craft::presets::{PRESETS, Preset};
use crate::facts::field_error::FieldError;
use crate::facts::ranges::{CRAFT, HEADING_LOOP, POWER, Range, SURGE_LOOP};

/// Closed-loop response of the surface craft. Omitted members are the preset's, or learnt.
#[skip_serializing_none]
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema, JsonSchema)]
#[serde(
    deny_unknown_fields,
    bound(serialize = "N: Serialize + Default + PartialEq", deserialize = "N: Deserialize<'de> + Default")
)]
#[schema(as = Craft)]
#[schemars(rename = "Craft", bound = "N: JsonSchema + Default + PartialEq")]
pub struct CraftDescription<N = f64> {
    /// Name of a known craft (from `GET /v1/crafts`) for omitted members; none if left out.
    #[schema(example = "medusa")]
    pub preset: Option<String>,
    /// Response of the heading loop; the preset's if left out.
    #[serde(default, deserialize_with = "default_for_null", skip_serializing_if = "is_default")]
    #[schema(value_type = Option<HeadingLoop>)]
    pub heading_loop: HeadingLoop<N>,
    /// Response of the speed loop; the preset's if left out.
    #[serde(default, deserialize_with = "default_for_null", skip_serializing_if = "is_default")]
    #[schema(value_type = Option<SurgeLoop>)]
    pub surge_loop: SurgeLoop<N>,
    /// Sway per surge and yaw rate k_β, s, positive if the craft drifts outwards in a turn: sway =
    /// −`sway_per_yaw_rate_s` · surge · yaw rate; the preset's if left out.
    #[doc(alias = "k_beta")]
    #[schema(value_type = Option<f64>, example = 0.9)]
    pub sway_per_yaw_rate_s: Option<N>,
    /// Propulsion power at a steady speed through the water; the preset's if left out.
    #[schema(value_type = Option<Power>)]
    pub power: Option<Power<N>>,
    /// Kind of speed reference; the preset's if left out.
    pub speed_held: Option<SpeedReference>,
    /// Kind of heading reference; the preset's if left out.
    pub heading_held: Option<HeadingReference>,
    /// Relative standard deviation of the given numbers; 0 if exact; 0.15 if left out.
    #[schema(value_type = Option<f64>, example = 0.1)]
    pub relative_uncertainty: Option<N>,
}

/// Response of a heading loop: a time constant, or a natural frequency and a damping ratio.
#[skip_serializing_none]
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "HeadingLoop")]
pub struct HeadingLoop<N = f64> {
    /// Time constant of a first-order response, s. Excludes `natural_frequency_radps` and
    /// `damping`; the preset's if left out.
    #[schema(value_type = Option<f64>)]
    pub time_constant_s: Option<N>,
    /// Natural frequency of a second-order response, rad/s, with `damping`; the preset's if left
    /// out.
    #[schema(value_type = Option<f64>, example = 1.6)]
    pub natural_frequency_radps: Option<N>,
    /// Damping ratio; needs `natural_frequency_radps`; the preset's if left out.
    #[schema(value_type = Option<f64>, example = 0.8)]
    pub damping: Option<N>,
    /// Delay of a reference, s; the preset's if left out.
    #[schema(value_type = Option<f64>, example = 0.1)]
    pub delay_s: Option<N>,
    /// Largest yaw rate of the loop, rad/s; the preset's if left out.
    #[schema(value_type = Option<f64>, example = 0.3)]
    pub rate_max_radps: Option<N>,
}

/// Response of a speed loop.
#[skip_serializing_none]
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "SurgeLoop")]
pub struct SurgeLoop<N = f64> {
    /// Time constant of the response to a small step, s; the preset's if left out.
    #[schema(value_type = Option<f64>, example = 2.5)]
    pub time_constant_s: Option<N>,
    /// Delay of a reference, s; the preset's if left out.
    #[schema(value_type = Option<f64>, example = 0.0)]
    pub delay_s: Option<N>,
    /// Largest acceleration ahead, m/s²; the preset's if left out.
    #[schema(value_type = Option<f64>, example = 0.09)]
    pub acceleration_max_mps2: Option<N>,
    /// Largest deceleration, m/s², positive; the preset's if left out.
    #[schema(value_type = Option<f64>, example = 0.09)]
    pub deceleration_max_mps2: Option<N>,
    /// `false`: no integrator winds up noticeably (`integral_time_s` declares one); the preset's or
    /// learnt if left out. `null` means omitted.
    pub integrates: Option<bool>,
    /// Integral time of the loop k_p/k_i, s; the preset's if left out.
    #[schema(value_type = Option<f64>, example = 8.7)]
    pub integral_time_s: Option<N>,
}

/// Accepts `null` for an omitted object.
fn default_for_null<'de, D: Deserializer<'de>, T: Deserialize<'de> + Default>(
    from: D,
) -> Result<T, D::Error> {
    Ok(Option::deserialize(from)?.unwrap_or_default())
}

fn is_default<T: Default + PartialEq>(object: &T) -> bool {
    *object == T::default()
}

impl From<&Craft> for CraftDescription {
    /// Declares all members, without an uncertainty.
    fn from(craft: &Craft) -> Self {
        let (heading, surge) = (&craft.heading, &craft.surge);
        let (time_constant_s, natural_frequency_radps, damping) = match heading.dynamics {
            HeadingDynamics::FirstOrder { time_constant } => (Some(time_constant), None, None),
            HeadingDynamics::SecondOrder { natural_frequency, damping } => {
                (None, Some(natural_frequency), Some(damping))
            }
        };
        Self {
            preset: None,
            heading_loop: HeadingLoop {
                time_constant_s,
                natural_frequency_radps,
                damping,
                delay_s: Some(heading.delay),
                rate_max_radps: Some(heading.rate_max),
            },
            surge_loop: SurgeLoop {
                time_constant_s: Some(surge.time_constant),
                delay_s: Some(surge.delay),
                acceleration_max_mps2: Some(surge.acceleration_max),
                deceleration_max_mps2: Some(surge.deceleration_max),
                integrates: surge.integral_time.is_none().then_some(false),
                integral_time_s: surge.integral_time,
            },
            sway_per_yaw_rate_s: Some(craft.sway_per_yaw_rate),
            power: Some(craft.power),
            speed_held: Some(craft.speed_held),
            heading_held: Some(craft.heading_held),
            relative_uncertainty: None,
        }
    }
}

impl HeadingLoop {
    /// The declared dynamics, if any.
    pub fn dynamics(&self) -> Option<HeadingDynamics> {
        match (self.time_constant_s, self.natural_frequency_radps, self.damping) {
            (Some(time_constant), ..) => Some(HeadingDynamics::FirstOrder { time_constant }),
            (None, Some(natural_frequency), Some(damping)) => {
                Some(HeadingDynamics::SecondOrder { natural_frequency, damping })
            }
            (None, _, _) => None,
        }
    }
}

impl CraftDescription {
    /// The known craft of that name, without other members.
    pub fn of_preset(name: &str) -> Self {
        Self { preset: Some(name.to_owned()), ..Self::default() }
    }

    pub(crate) fn preset(&self) -> Option<&'static Preset> {
        self.preset.as_deref().and_then(Preset::named)
    }

    /// The described craft; omitted members are the preset's, or the generic craft's.
    pub fn craft(&self) -> Craft {
        let base = self.preset().map_or(Craft::GENERIC, |preset| preset.craft);
        let (heading, surge) = (&self.heading_loop, &self.surge_loop);
        Craft {
            heading: HeadingResponse {
                dynamics: heading.dynamics().unwrap_or(base.heading.dynamics),
                delay: heading.delay_s.unwrap_or(base.heading.delay),
                rate_max: heading.rate_max_radps.unwrap_or(base.heading.rate_max),
            },
            surge: SurgeResponse {
                time_constant: surge.time_constant_s.unwrap_or(base.surge.time_constant),
                delay: surge.delay_s.unwrap_or(base.surge.delay),
                acceleration_max: surge.acceleration_max_mps2.unwrap_or(base.surge.acceleration_max),
                deceleration_max: surge.deceleration_max_mps2.unwrap_or(base.surge.deceleration_max),
                integral_time: match surge.integrates {
                    Some(false) => None,
                    Some(true) | None => surge.integral_time_s.or(base.surge.integral_time),
                },
            },
            sway_per_yaw_rate: self.sway_per_yaw_rate_s.unwrap_or(base.sway_per_yaw_rate),
            power: self.power.unwrap_or(base.power),
            speed_held: self.speed_held.unwrap_or(base.speed_held),
            heading_held: self.heading_held.unwrap_or(base.heading_held),
        }
    }

    /// All faults, by their JSON names: `/craft/heading_loop/delay_s`.
    pub fn faults(&self) -> Vec<FieldError> {
        let mut faults = Vec::new();
        if let Some(given) = self.preset.as_deref().filter(|_| self.preset().is_none()) {
            let known: Vec<_> = PRESETS.iter().map(|preset| preset.name).collect();
            let detail = format!("the known craft are {}", known.join(", "));
            let fault = FieldError::new("/craft/preset", "unknown_preset", detail);
            faults.push(fault.given(given).limit(known));
        }
        let mut fail = |member: &str, code: &str, detail: &str| {
            faults.push(FieldError::new(format_args!("/craft/{member}"), code, detail));
        };
        let heading = &self.heading_loop;
        let second_order = (heading.natural_frequency_radps, heading.damping);
        let together = "give both `natural_frequency_radps` and `damping`, or neither";
        match (heading.time_constant_s, second_order) {
            (None, (Some(_), None)) => fail("heading_loop/damping", "missing", together),
            (None, (None, Some(_))) => fail("heading_loop/natural_frequency_radps", "missing", together),
            (Some(_), (Some(_), _) | (_, Some(_))) => {
                let detail = "either a time constant, or a natural frequency and a damping ratio";
                fail("heading_loop/time_constant_s", "unexpected", detail);
            }
            (None, (None, None) | (Some(_), Some(_))) | (Some(_), (None, None)) => {}
        }
        match (self.surge_loop.integrates, self.surge_loop.integral_time_s) {
            (Some(true), None) => {
                let detail = "declare an integrator by `integral_time_s`, or leave `integrates` out to have it estimated";
                fail("surge_loop/integral_time_s", "missing", detail);
            }
            (Some(false), Some(_)) => {
                let detail = "`integral_time_s` contradicts `integrates`: false";
                fail("surge_loop/integral_time_s", "unexpected", detail);
            }
            (None | Some(true), Some(_)) | (None | Some(false), None) => {}
        }
        self.map(|member, range, given| {
            let outside = |given: &f64| FieldError::outside(format_args!("/craft/{member}"), *given, range);
            faults.extend(given.and_then(outside));
            given.copied()
        });
        faults
    }
}

impl<N> CraftDescription<N> {
    /// The same description with other numbers: `number` maps each one's name
    /// (`heading_loop/delay_s`), range and value, in this order; skips an omitted `power`.
    pub fn map<M: Default>(
        &self,
        mut number: impl FnMut(&str, &RangeInclusive<f64>, Option<&N>) -> Option<M>,
    ) -> CraftDescription<M> {
        let mut of = |object: &str, (member, range): &Range, given: Option<&N>| {
            number(&format!("{object}{member}"), range, given)
        };
        let [sway_per_yaw_rate, relative_uncertainty] = &CRAFT;
        let [linear, cubic] = &POWER;
        CraftDescription {
            preset: self.preset.clone(),
            heading_loop: self.heading_loop.map(|range, given| of("heading_loop/", range, given)),
            surge_loop: self.surge_loop.map(|range, given| of("surge_loop/", range, given)),
            sway_per_yaw_rate_s: of("", sway_per_yaw_rate, self.sway_per_yaw_rate_s.as_ref()),
            power: self.power.as_ref().map(|given| Power {
                linear_w_per_mps: of("power/", linear, Some(&given.linear_w_per_mps)).unwrap_or_default(),
                cubic_w_per_mps3: of("power/", cubic, Some(&given.cubic_w_per_mps3)).unwrap_or_default(),
            }),
            speed_held: self.speed_held,
            heading_held: self.heading_held,
            relative_uncertainty: of("", relative_uncertainty, self.relative_uncertainty.as_ref()),
        }
    }
}

impl<N> HeadingLoop<N> {
    fn map<M>(&self, mut number: impl FnMut(&Range, Option<&N>) -> Option<M>) -> HeadingLoop<M> {
        let [time_constant, natural_frequency, damping, delay, rate_max] = &HEADING_LOOP;
        HeadingLoop {
            time_constant_s: number(time_constant, self.time_constant_s.as_ref()),
            natural_frequency_radps: number(natural_frequency, self.natural_frequency_radps.as_ref()),
            damping: number(damping, self.damping.as_ref()),
            delay_s: number(delay, self.delay_s.as_ref()),
            rate_max_radps: number(rate_max, self.rate_max_radps.as_ref()),
        }
    }
}

impl<N> SurgeLoop<N> {
    fn map<M>(&self, mut number: impl FnMut(&Range, Option<&N>) -> Option<M>) -> SurgeLoop<M> {
        let [time_constant, delay, acceleration_max, deceleration_max, integral_time] = &SURGE_LOOP;
        SurgeLoop {
            time_constant_s: number(time_constant, self.time_constant_s.as_ref()),
            delay_s: number(delay, self.delay_s.as_ref()),
            acceleration_max_mps2: number(acceleration_max, self.acceleration_max_mps2.as_ref()),
            deceleration_max_mps2: number(deceleration_max, self.deceleration_max_mps2.as_ref()),
            integrates: self.integrates,
            integral_time_s: number(integral_time, self.integral_time_s.as_ref()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn faults(craft: &CraftDescription) -> Vec<String> {
        craft.faults().into_iter().map(|fault| fault.pointer).collect()
    }

    #[test]
    fn every_preset_is_a_valid_description() {
        for preset in PRESETS {
            let described = CraftDescription::from(&preset.craft);
            assert_eq!(described.faults(), [], "{}", preset.name);
            assert_eq!(described.craft(), preset.craft);
            assert_eq!(CraftDescription::of_preset(preset.name).craft(), preset.craft);
        }
    }

    #[test]
    fn integrates_false_differs_from_an_omitted_member() {
        let said = |integrates, integral_time_s| CraftDescription {
            surge_loop: SurgeLoop { integrates, integral_time_s, ..SurgeLoop::default() },
            ..CraftDescription::of_preset("medusa")
        };
        let time = |craft: &CraftDescription| craft.craft().surge.integral_time;
        assert_eq!(time(&said(Some(false), None)), None);
        assert_eq!(time(&said(None, None)), Craft::MEDUSA.surge.integral_time);
        assert_eq!(time(&said(Some(true), Some(9.0))), Some(9.0));
        for contradiction in [said(Some(false), Some(9.0)), said(Some(true), None)] {
            assert_eq!(faults(&contradiction)[0], "/craft/surge_loop/integral_time_s");
        }
    }

    #[test]
    fn a_number_that_is_not_finite_is_named() {
        let mut craft = CraftDescription::default();
        craft.surge_loop.time_constant_s = Some(f64::NAN);
        assert_eq!(faults(&craft)[0], "/craft/surge_loop/time_constant_s");
    }
}
