//! Tuning of the planner by clients.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::json;
use serde_with::skip_serializing_none;
use utoipa::ToSchema;

use crate::facts::field_error::FieldError;
use crate::facts::ranges::{HORIZON, STEP, STEPS_COUNT, STEPS_TIMES_ITERATIONS_MOST, TUNING};

/// Tolerance of a horizon's limits, s: rounding of 120 steps.
const ROUNDING: f64 = 1e-9;

/// Weights of the planner's cost, its horizon and its iterations.
///
/// Each weight applies to a squared deviation per second unless stated otherwise. Omitted members
/// have the planner's defaults. Prices of limits are not tunable.
#[skip_serializing_none]
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Tuning {
    /// Weight of the distance to the goal, 1/m². Default: 1.
    pub position_weight_per_m2: Option<f64>,
    /// Weight of the velocity over ground relative to the goal's, 1/(m/s)². Default: 15.
    pub velocity_weight_per_m2ps2: Option<f64>,
    /// Weight of the acceleration, 1/(m/s²)². Default: 100.
    pub acceleration_weight_per_m2ps4: Option<f64>,
    /// Terminal weight of the distance, 1/m², not per second. Default: 10.
    pub terminal_position_weight_per_m2: Option<f64>,
    /// Terminal weight of the relative velocity, 1/(m/s)², not per second. Default: 150.
    pub terminal_velocity_weight_per_m2ps2: Option<f64>,
    /// Weight of propulsion energy, 1/J. Default: 0, which leaves energy out.
    pub energy_weight_per_j: Option<f64>,
    /// SCP iterations for each guess; times `steps_s`, at most 300. Default: 2.
    pub scp_iterations: Option<u32>,
    /// Lengths of the horizon's intervals, s, in order: 2 to 120, each from 0.1 to 10, together
    /// from 5 to 600. Default: 6 of 1, 12 of 2 and 12 of 4.
    #[schema(example = json!([1.0, 1.0, 2.0, 2.0, 4.0, 4.0]))]
    pub steps_s: Option<Vec<f64>>,
}

impl Tuning {
    /// All its faults, by member within `field`.
    pub fn faults(&self, field: &str) -> Vec<FieldError> {
        let steps_s = format_args!("{field}/steps_s");
        let n_steps = self.steps_s.as_ref().map(Vec::len);
        // A list that is too long is not checked step by step.
        if let Some(fault) = n_steps.and_then(|n| FieldError::of_length(steps_s, n, &STEPS_COUNT, "items")) {
            return vec![fault];
        }
        let values = [
            self.position_weight_per_m2,
            self.velocity_weight_per_m2ps2,
            self.acceleration_weight_per_m2ps4,
            self.terminal_position_weight_per_m2,
            self.terminal_velocity_weight_per_m2ps2,
            self.energy_weight_per_j,
            self.scp_iterations.map(f64::from),
        ];
        let numbers = TUNING
            .into_iter()
            .zip(values)
            .filter_map(|((name, range), value)| Some((name.to_owned(), range, value?)));
        let steps = self.steps_s.iter().flatten().enumerate();
        let steps = steps.map(|(i, step)| (format!("steps_s/{i}"), STEP, *step));
        let mut faults: Vec<_> = numbers
            .chain(steps)
            .filter_map(|(member, range, given)| {
                FieldError::outside(format_args!("{field}/{member}"), given, &range)
            })
            .collect();
        // A horizon with wrong steps adds no information.
        if let Some(steps) = self.steps_s.as_ref().filter(|_| faults.is_empty()) {
            let (least, most) = HORIZON.into_inner();
            let given: f64 = steps.iter().sum();
            if !(least - ROUNDING..=most + ROUNDING).contains(&given) {
                let detail = format!("the steps add up to {given} s, which is not in [{least}, {most}]");
                let fault = FieldError::new(steps_s, "out_of_range", detail).given(given);
                faults.push(fault.limit(json!({ "least": least, "most": most })));
            }
            // Without `scp_iterations`, every accepted number of steps is within the effort.
            let iterations = self.scp_iterations.map_or(1, |iterations| iterations as usize);
            let (n_steps, most) = (steps.len(), STEPS_TIMES_ITERATIONS_MOST);
            let given = n_steps * iterations;
            if most < given {
                let detail = format!(
                    "{n_steps} steps in {iterations} iterations are {given}, and at most {most} are accepted"
                );
                let place = format_args!("{field}/scp_iterations");
                let fault = FieldError::new(place, "out_of_range", detail).given(given);
                faults.push(fault.limit(json!({ "most": most })));
            }
        }
        faults
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_horizon_has_a_shortest_and_a_longest_length() {
        let of = |steps: &[f64], iterations| Tuning {
            steps_s: Some(steps.to_vec()),
            scp_iterations: iterations,
            ..Tuning::default()
        };
        for (tuning, expected) in [
            (of(&[2.5, 2.5], None), ""),
            // They add up to a little less than 5.
            (of(&[0.1; 50], None), ""),
            (of(&[5.0, f64::NAN], None), "steps_s/1: must be from 0.1 to 10 (given: null)"),
            (
                of(&[1.0, 2.0], None),
                "steps_s: the steps add up to 3 s, which is not in [5, 600] (given: 3.0)",
            ),
            (of(&[5.0; 121], None), "steps_s: must have 2 to 120 items (given: 121)"),
            (
                of(&[5.0; 120], Some(3)),
                "scp_iterations: 120 steps in 3 iterations are 360, and at most 300 are accepted (given: 360)",
            ),
        ] {
            let faults = tuning.faults("/tuning").into_iter();
            let faults: Vec<_> = faults.map(|fault| fault.to_string()).collect();
            let expected = (!expected.is_empty()).then(|| format!("/tuning/{expected}"));
            assert_eq!(faults, Vec::from_iter(expected));
        }
    }
}
