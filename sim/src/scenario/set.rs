//! Sets a number by its key, such as `knowledge.acoustics.latency_s` or `auvs[0].speed_mps`.

use std::mem;

use serde_json::{Map, Value, json};

use super::{InvalidScenario, file::Scenario, quantity::DISTRIBUTIONS, source::Source};

const NO_NUMBER: &str = "the scenario has no number with this key";

impl Scenario {
    /// Replaces the number at `key` by the fixed `value`. An omitted optional table is created if
    /// it has no required members, else it must be in the file. [`Self::start`] shows whether the
    /// numbers still fit together. Changes since the file was read are lost.
    pub fn set(&mut self, key: &str, value: f64) -> Result<(), InvalidScenario> {
        let field = key.to_owned();
        let mut tree = self.source.tree.clone();
        if let Err(reason) = put(&mut tree, key, value) {
            return Err(InvalidScenario { field, reason });
        }
        let read = Self::of_tree(&tree).map_err(|wrong| {
            let reason = if wrong.field == key && !wrong.reason.starts_with("unknown field") {
                wrong.reason
            } else {
                format!("{NO_NUMBER}: {wrong}")
            };
            InvalidScenario { field, reason }
        })?;
        let source = mem::take(&mut self.source);
        *self = Self { files: mem::take(&mut self.files), source: Source { tree, ..source }, ..read };
        Ok(())
    }
}

fn put(tree: &mut Value, key: &str, value: f64) -> Result<(), String> {
    let place = key.split(['.', '[']).try_fold(tree, step)?;
    let is_number = match place {
        Value::Null | Value::Number(_) => true,
        Value::Object(table) => DISTRIBUTIONS.iter().any(|name| table.contains_key(*name)),
        _ => false,
    };
    if !is_number {
        return Err(NO_NUMBER.to_owned());
    }
    if !value.is_finite() {
        return Err(format!("{value} is not a finite number"));
    }
    // Counts are whole numbers, and numbers that may be fractions are read from both.
    let whole = value.to_string().parse::<i64>().ok().filter(|_| !place.is_f64());
    *place = whole.map_or_else(|| json!(value), Value::from);
    Ok(())
}

/// The item or member of `here`, null if it is a member that the file omits.
fn step<'a>(here: &'a mut Value, name: &str) -> Result<&'a mut Value, String> {
    if here.is_null() {
        *here = Value::Object(Map::new());
    }
    let index = name.strip_suffix(']').map(str::parse::<usize>);
    match (here, index) {
        (Value::Object(table), None) => Ok(table.entry(name).or_insert(Value::Null)),
        (Value::Array(items), Some(Ok(index))) => {
            let n = items.len();
            let missing = || format!("the list has {n} items; there is no item {index}");
            items.get_mut(index).ok_or_else(missing)
        }
        _ => Err(NO_NUMBER.to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use planner::craft::SurgeLoop;

    use super::*;
    use crate::scenario::quantity::Distribution;

    fn named(name: &str) -> Scenario {
        Scenario::named(name).expect("exists")
    }

    /// Every number that `value` has outside of points, with its key.
    fn numbers(key: &str, value: &toml::Value, found: &mut Vec<(String, f64)>) {
        match value {
            toml::Value::Float(number) => found.push((key.to_owned(), *number)),
            toml::Value::Integer(number) if !key.ends_with("lanes") => {
                let number = i32::try_from(*number).expect("is small");
                found.push((key.to_owned(), number.into()));
            }
            toml::Value::Array(items) if items.iter().all(toml::Value::is_table) => {
                for (i, item) in items.iter().enumerate() {
                    numbers(&format!("{key}[{i}]"), item, found);
                }
            }
            toml::Value::Table(table) => {
                for (name, value) in table {
                    let separator = if key.is_empty() { "" } else { "." };
                    numbers(&format!("{key}{separator}{name}"), value, found);
                }
            }
            _ => {}
        }
    }

    #[test]
    fn setting_a_number_to_its_value_in_the_file_changes_nothing() {
        for name in Scenario::names() {
            let text = Scenario::text(name).expect("exists");
            let mut found = vec![];
            numbers("", &toml::from_str(text).expect("is TOML"), &mut found);
            let mut same = named(name);
            for (key, number) in found {
                same.set(&key, number).expect("is a number");
            }
            assert_eq!(same, named(name), "{name}");
        }
    }

    #[test]
    fn setting_an_omitted_number_adds_its_optional_table() {
        let mut scenario = named("noisy-fixes");
        let table = scenario.set("water.shear.factor", 0.5);
        table.expect_err("shear requires a depth");
        for key in [
            "surface_craft.craft.heading_loop.time_constant_s",
            "surface_craft.limits.surge_lag_s",
            "surface_craft.tuning.energy_weight_per_j",
            "surface_craft.parameters.estimate.gate",
        ] {
            scenario.set(key, 0.5).expect("is a number");
        }
        let start = scenario.start(1).expect("starts");
        let briefing = start.observer.expect("has a craft").briefing;
        assert_eq!(briefing.tuned.estimate.gate, 0.5);
        let unknown = scenario.set("surface_craft.parameters.estimate.gates", 0.5);
        unknown.expect_err("there is no such number");
        let craft = scenario.surface_craft.remove(0);
        assert_eq!(craft.limits.surge_lag_s, Some(Distribution::Fixed(0.5)));
        let response = craft.craft.expect("is created");
        let found = response.heading_loop.time_constant_s;
        assert_eq!(found, Some(Distribution::Fixed(0.5)));
        assert_eq!(response.surge_loop, SurgeLoop::default());
        assert_eq!(craft.tuning.expect("is created").energy_weight_per_j, Some(0.5));
        let mut visits = named("visit-five");
        for (auv, is_one) in [("auv-1", true), ("auv-9", false)] {
            let weight = format!("surface_craft.goal.visit.weights.{auv}");
            visits.set(&weight, 3.0).expect("is a number");
            assert_eq!(visits.start(0).is_ok(), is_one);
        }
    }

    #[test]
    fn a_key_without_a_number_and_a_value_out_of_range_are_refused() {
        let mut scenario = named("switching");
        let none = "no number with this key";
        for (key, value, says) in [
            ("surface_craft.sped_mps", 0.1, none),
            ("name", 0.1, none),
            ("auvs[0]", 0.1, none),
            ("auvs.0.speed_mps", 0.1, none),
            ("auvs[2].speed_mps", 0.1, "the list has 2 items; there is no item 2"),
            ("duration_s", 1e9, "1000000000 is outside 1 to 86400 s"),
            ("surface_craft.goal.range.range_m", 9.0, none),
        ] {
            let refused = scenario.set(key, value).expect_err(key);
            assert_eq!(refused.field, key);
            assert!(refused.reason.contains(says), "{refused}");
        }
        assert_eq!(scenario, named("switching"));
    }
}
