//! Reads a plan from the service's answer.

use nalgebra::Vector2;
use serde_json::Value;

use crate::reference::{PlannedReference, Reference, Stage};

/// A plan of the mission.
#[derive(Clone, Debug)]
pub(crate) struct Plan {
    /// The reference and the planned motion, on the bridge's clock.
    pub(crate) planned: PlannedReference,
    /// Time of its first arrival, s of the bridge's clock.
    pub(crate) arrived_s: f64,
    /// The reference of line of sight for the same craft.
    pub(crate) line_of_sight: Reference,
    /// Method and outcome, such as `mpc ok`.
    pub(crate) method: String,
    /// The reason that the outcome is `degraded`.
    pub(crate) reason: Option<String>,
    /// From the craft to the goal, m.
    pub(crate) distance_m: f64,
    /// Estimated lags of the craft, as text.
    pub(crate) lags: String,
    /// The current, as text.
    pub(crate) current: String,
    /// The vehicles that the mission waits for.
    pub(crate) waits_for: Vec<String>,
    /// Warnings of the plan: code, and detail for people.
    pub(crate) warnings: Vec<[String; 2]>,
}

impl Plan {
    /// The plan in an answer of `now_s`, which first arrived at `arrived_s`, both s of the bridge's
    /// clock; `None` if it is incomplete.
    #[must_use]
    pub(crate) fn from_answer(answer: &Value, arrived_s: f64, now_s: f64) -> Option<Self> {
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
        let distance_m = (position(&plan["trajectory"][0])? - goal).norm();
        Some(Self {
            arrived_s,
            planned: PlannedReference {
                planned_s: planned_at + shift,
                first: reference(&plan["reference"])?,
                lags: [lag("heading_lag_s"), lag("surge_lag_s")],
                current: if is_over_ground { current } else { Vector2::zeros() },
                valid_until_s: plan["reference"]["valid_until_s"].as_f64()? + shift,
                stages: stages?,
            },
            line_of_sight: reference(&plan["baseline"])?,
            method: format!(
                "{} {}",
                plan["method"].as_str().unwrap_or("?"),
                plan["outcome"].as_str().unwrap_or("?")
            ),
            reason: plan["reason"].as_str().map(str::to_owned),
            distance_m,
            lags: lags(craft),
            current: current_words(&current),
            waits_for: items(&answer["waits_for"], |name| Some(name.as_str()?.to_owned())),
            warnings: items(&plan["warnings"], |warning| {
                let [code, detail] = ["code", "detail"].map(|name| warning[name].as_str().map(str::to_owned));
                Some([code?, detail.unwrap_or_default()])
            }),
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

fn items<T>(list: &Value, item: impl Fn(&Value) -> Option<T>) -> Vec<T> {
    let items = list.as_array().into_iter().flatten();
    items.filter_map(item).collect()
}

/// The planner's estimate of the craft's lags.
fn lags(craft: &Value) -> String {
    let value = |name: &str| {
        let [value, sigma] = ["value", "sigma"].map(|part| craft[name][part].as_f64().unwrap_or(0.0));
        format!("{value:.1}±{sigma:.1} s")
    };
    format!(
        "heading lag {}, speed lag {}",
        value("heading_lag_s"),
        value("surge_lag_s")
    )
}

fn current_words(current: &Vector2<f64>) -> String {
    let towards = current.y.atan2(current.x).to_degrees().rem_euclid(360.0);
    format!("current {:.2} m/s to {towards:03.0}°", current.norm())
}
