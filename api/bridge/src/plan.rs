//! A plan of the mission, as its JSON tells it and as the bridge follows it.

use nalgebra::Vector2;
use serde_json::Value;

use crate::{
    Geographic,
    reference::{PlannedReference, Reference, Stage},
};

/// A plan as it came.
#[derive(Clone, Debug)]
pub struct PlanNow {
    /// What to follow, on the bridge's clock.
    pub planned: PlannedReference,
    /// What line of sight would do, for the same craft.
    pub line_of_sight: Reference,
    /// What answered, and whether it is what was asked for, such as `mpc ok`.
    pub method: String,
    /// From the craft to the goal, m.
    pub distance_m: f64,
    /// What is known of the craft and the water, in words.
    pub learnt: String,
    /// The vehicles that the mission waits for.
    pub waits_for: Vec<String>,
    /// Warnings of the plan, by code.
    pub warnings: Vec<String>,
}

impl PlanNow {
    /// The plan in the service's answer, which came at `now_s` of the bridge's clock; none where it lacks what a plan has.
    #[must_use]
    pub(crate) fn of(answer: &Value, now_s: f64) -> Option<Self> {
        let plan = &answer["plan"];
        let planned_at = answer["t_s"].as_f64()?;
        // From the mission's clock to the bridge's.
        let shift = now_s - answer["age_s"].as_f64()? - planned_at;
        let stages: Option<Vec<Stage>> = plan["trajectory"]
            .as_array()?
            .iter()
            .map(|point| {
                Some(Stage {
                    t_s: point["t_s"].as_f64()? + shift,
                    position: position(point)?,
                    geographic: point["lat_deg"]
                        .as_f64()
                        .zip(point["lon_deg"].as_f64())
                        .and_then(|(lat, lon)| Geographic::new(lat, lon)),
                    reference: reference(point)?,
                })
            })
            .collect();
        let craft = &plan["craft_estimate"];
        let lag = |name: &str| craft[name]["value"].as_f64().unwrap_or(0.0).max(0.0);
        let current = Vector2::new(
            plan["current"]["north_mps"].as_f64().unwrap_or(0.0),
            plan["current"]["east_mps"].as_f64().unwrap_or(0.0),
        );
        let is_over_ground = craft["speed_held"] == "over_ground";
        let goal = position(&plan["goal"]["trajectory"][0])?;
        let stages = stages?;
        let distance_m = (stages.first()?.position - goal).norm();
        Some(Self {
            planned: PlannedReference {
                planned_s: planned_at + shift,
                first: reference(&plan["reference"])?,
                lags: [lag("heading_lag_s"), lag("surge_lag_s")],
                current: if is_over_ground { current } else { Vector2::zeros() },
                valid_until_s: plan["reference"]["valid_until_s"].as_f64()? + shift,
                stages,
            },
            line_of_sight: reference(&plan["baseline"])?,
            method: format!(
                "{} {}",
                plan["method"].as_str().unwrap_or("?"),
                plan["outcome"].as_str().unwrap_or("?")
            ),
            distance_m,
            learnt: learnt(craft, &current),
            waits_for: names(&answer["waits_for"]),
            warnings: plan["warnings"]
                .as_array()
                .into_iter()
                .flatten()
                .filter_map(|warning| warning["code"].as_str().map(str::to_owned))
                .collect(),
        })
    }
}

fn position(point: &Value) -> Option<Vector2<f64>> {
    Some(Vector2::new(
        point["north_m"].as_f64()?,
        point["east_m"].as_f64()?,
    ))
}

fn reference(point: &Value) -> Option<Reference> {
    Some(Reference {
        speed: point["speed_mps"].as_f64()?,
        heading: point["heading_rad"].as_f64()?,
    })
}

fn names(list: &Value) -> Vec<String> {
    list.as_array()
        .into_iter()
        .flatten()
        .filter_map(|name| name.as_str().map(str::to_owned))
        .collect()
}

/// What the planner has found out, for people.
fn learnt(craft: &Value, current: &Vector2<f64>) -> String {
    let value = |name: &str| {
        let [value, sigma] = ["value", "sigma"].map(|part| craft[name][part].as_f64().unwrap_or(0.0));
        format!("{value:.1}±{sigma:.1} s")
    };
    format!(
        "heading lag {}, speed lag {}, current {:.2} m/s to {:03.0}°",
        value("heading_lag_s"),
        value("surge_lag_s"),
        current.norm(),
        current.y.atan2(current.x).to_degrees().rem_euclid(360.0)
    )
}
