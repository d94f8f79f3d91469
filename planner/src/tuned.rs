//! Numbers that were chosen by flights, for the folders `craft`, `estimate`, `predict`,
//! `localise`, `visit`, `avoid` and `fleet`.
//!
//! The line of a number has its unit, on what it was chosen, and how sensitive it is;
//! `docs/rationale.md` has the measurements. Numbers whose lines say nothing of a choice are
//! assumptions and were not varied. Physical and numerical constants stand where they are used;
//! numbers of the program are [`Parameters`](crate::Parameters).
//!
//! A scenario and the planner of a campaign set numbers by table and name; requests cannot.

use std::collections::BTreeMap;

use serde::Deserialize;

/// A table of numbers: a struct with their values, each of which can be set by its name.
macro_rules! numbers {
    ($(#[$doc:meta])* $table:ident { $($(#[$line:meta])* $name:ident = $value:expr,)* }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub struct $table {
            $($(#[$line])* pub $name: f64,)*
        }

        impl $table {
            /// The chosen numbers.
            pub const DEFAULT: Self = Self { $($name: $value,)* };

            pub(super) fn by_name(&mut self, name: &str) -> Option<&mut f64> {
                match name {
                    $(stringify!($name) => Some(&mut self.$name),)*
                    _ => None,
                }
            }
        }

        impl Default for $table {
            fn default() -> Self {
                Self::DEFAULT
            }
        }

        impl Default for &$table {
            fn default() -> Self {
                &$table::DEFAULT
            }
        }
    };
}

mod avoid;
mod craft;
mod estimate;
mod fleet;
mod forecast;
mod localise;
mod visit;

pub use avoid::AvoidNumbers;
pub use craft::CraftNumbers;
pub use estimate::EstimateNumbers;
pub use fleet::FleetNumbers;
pub use forecast::ForecastNumbers;
pub use localise::LocaliseNumbers;
pub use visit::VisitNumbers;

/// All tables.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
#[serde(try_from = "BTreeMap<String, BTreeMap<String, f64>>")]
pub struct Tuned {
    /// Keeping clear of other vessels.
    pub avoid: AvoidNumbers,
    /// Learning the craft, and its faults.
    pub craft: CraftNumbers,
    /// Estimates of AUVs.
    pub estimate: EstimateNumbers,
    /// Sharing AUVs out among several craft.
    pub fleet: FleetNumbers,
    /// Forecasts of AUVs.
    pub forecast: ForecastNumbers,
    /// Figures that localise AUVs.
    pub localise: LocaliseNumbers,
    /// Visits.
    pub visit: VisitNumbers,
}

impl Tuned {
    /// The chosen numbers.
    pub const DEFAULT: Self = Self {
        avoid: AvoidNumbers::DEFAULT,
        craft: CraftNumbers::DEFAULT,
        estimate: EstimateNumbers::DEFAULT,
        fleet: FleetNumbers::DEFAULT,
        forecast: ForecastNumbers::DEFAULT,
        localise: LocaliseNumbers::DEFAULT,
        visit: VisitNumbers::DEFAULT,
    };

    /// Sets the number `name` of a `table`, such as `gate` of `estimate`, to a `value` above 0.
    fn set(&mut self, table: &str, name: &str, value: f64) -> Result<(), String> {
        let number = match table {
            "avoid" => self.avoid.by_name(name),
            "craft" => self.craft.by_name(name),
            "estimate" => self.estimate.by_name(name),
            "fleet" => self.fleet.by_name(name),
            "forecast" => self.forecast.by_name(name),
            "localise" => self.localise.by_name(name),
            "visit" => self.visit.by_name(name),
            _ => None,
        };
        let number = number.ok_or_else(|| format!("there is no tuned number {table}.{name}"))?;
        if !(value.is_finite() && 0.0 < value) {
            return Err(format!("{table}.{name} = {value} is not above 0"));
        }
        *number = value;
        Ok(())
    }
}

impl TryFrom<BTreeMap<String, BTreeMap<String, f64>>> for Tuned {
    type Error = String;

    fn try_from(tables: BTreeMap<String, BTreeMap<String, f64>>) -> Result<Self, String> {
        let mut tuned = Self::default();
        for (table, numbers) in &tables {
            for (name, value) in numbers {
                tuned.set(table, name, *value)?;
            }
        }
        Ok(tuned)
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector2;
    use serde_json::json;

    use super::*;
    use crate::{
        Asc, Auv, AuvState, Goal, PlanRequest, Snapshot,
        angle::{Course, Heading},
        goal::GoalForecast,
        snapshot::{ForecastModel, Report},
    };

    #[test]
    fn numbers_are_set_by_table_and_name() {
        let tree = json!({ "estimate": { "gate": 9.2 }, "craft": { "alarm": 5.0 } });
        let tuned: Tuned = serde_json::from_value(tree).expect("are numbers of the tables");
        let mut expected = Tuned::DEFAULT;
        (expected.estimate.gate, expected.craft.alarm) = (9.2, 5.0);
        assert_eq!(tuned, expected);
        for (table, name, value) in [
            ("estimate", "gates", 1.0),
            ("solver", "gate", 1.0),
            ("estimate", "gate", 0.0),
            ("estimate", "gate", f64::NAN),
        ] {
            assert!(expected.set(table, name, value).is_err(), "{table}.{name} = {value}");
        }
        assert_eq!(tuned, expected);
    }

    #[test]
    fn a_snapshot_is_estimated_and_forecast_by_its_numbers() {
        let report = |k: u32| {
            let t_s = 10.0 * f64::from(k);
            Report::new(t_s, Vector2::new(0.5 * t_s, f64::from(k % 2)), 1.0)
        };
        let turning =
            AuvState { turn_rate_radps: 0.02, ..AuvState::new(Vector2::zeros(), 5.0, Course::new(0.0), 0.5) };
        let auvs = vec![Auv::reported("reports", (0..6).map(report).collect()), Auv::new("state", turning)];
        let asc = Asc::new(Vector2::zeros(), Heading::new(0.0), 0.5);
        let goal = Goal::Track { auv: "state".into() };
        let request = PlanRequest::new(50.0, asc, auvs, goal);
        let seen = |tuned: &Tuned| {
            let snapshot = Snapshot::with(request.clone(), tuned, &|| false).expect("is valid");
            let rejected = snapshot.estimates()[0].rejected.len();
            (rejected, GoalForecast::new(&snapshot).auvs()[1].model)
        };
        let mut tuned = Tuned::DEFAULT;
        assert_eq!(seen(&tuned), (0, ForecastModel::ConstantTurn));
        (tuned.estimate.gate, tuned.forecast.turn_rate_straight) = (1.0e-6, 0.1);
        let (rejected, model) = seen(&tuned);
        assert!(0 < rejected && model == ForecastModel::ConstantVelocity, "{rejected}");
    }
}
