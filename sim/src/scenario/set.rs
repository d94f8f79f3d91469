//! Sets a number by its key, such as `knowledge.acoustics.latency_s` or `auvs[0].speed_mps`.

use std::collections::BTreeMap;

use planner::{
    craft::{CraftDescription, HeadingLoop, Power, SurgeLoop},
    snapshot::Tuning,
    tuned::Tuned,
};

use super::{
    InvalidScenario,
    file::{
        AcousticsFile, AuvFile, BoundsFile, CurrentFile, DiveFile, FaultFile, FaultKindFile, GaussMarkovFile,
        GoalFile, KeepOutFile, KnowledgeFile, LimitsFile, NavigationErrorFile, OffsetFile, OriginFile,
        PathFile, RandomCraftFile, Scenario, SegmentFile, SensorsFile, ShearFile, SpeedKnot,
        SurfaceClassFile, SurfaceCraftFile, VisitCostFile, WaterFile, WavesFile,
    },
    quantity::{Distribution, Kind, Quantity},
};

impl Scenario {
    /// Replaces the number at `key` by the fixed `value`. An omitted optional table is created if
    /// it has no required members, else it must be in the file. [`Self::start`] shows whether the
    /// numbers still fit together.
    pub fn set(&mut self, key: &str, value: f64) -> Result<(), InvalidScenario> {
        let steps: Vec<&str> = key.split(['.', '[']).collect();
        Part::set(self, &steps, value).map_err(|reason| InvalidScenario {
            field: key.to_owned(),
            reason,
        })
    }
}

/// A part of a scenario file.
trait Part: Sized {
    /// The part that [`Self::set`] creates if the file omits it; none if it has required members.
    fn created() -> Option<Self> {
        None
    }

    /// Sets the number at the end of `key`, which starts at this part.
    fn set(&mut self, _key: &[&str], _value: f64) -> Result<(), String> {
        no_number()
    }
}

fn no_number() -> Result<(), String> {
    Err("the scenario has no number with this key".to_owned())
}

impl<K: Kind> Part for Quantity<K> {
    fn created() -> Option<Self> {
        Some(Self::fixed(K::MIN))
    }

    fn set(&mut self, key: &[&str], value: f64) -> Result<(), String> {
        if !key.is_empty() {
            return no_number();
        }
        *self = Self::checked(value)?;
        Ok(())
    }
}

/// Its range shows at [`Scenario::start`].
impl Part for Distribution {
    fn created() -> Option<Self> {
        Some(Self::default())
    }

    fn set(&mut self, key: &[&str], value: f64) -> Result<(), String> {
        if !key.is_empty() {
            return no_number();
        }
        *self = Self::Fixed(value);
        Ok(())
    }
}

/// Its range shows at [`Scenario::start`].
impl Part for f64 {
    fn created() -> Option<Self> {
        Some(0.0)
    }

    fn set(&mut self, key: &[&str], value: f64) -> Result<(), String> {
        if !key.is_empty() {
            return no_number();
        }
        *self = value;
        Ok(())
    }
}

/// Its range shows at [`Scenario::start`].
impl Part for u32 {
    fn created() -> Option<Self> {
        Some(0)
    }

    fn set(&mut self, key: &[&str], value: f64) -> Result<(), String> {
        if !key.is_empty() {
            return no_number();
        }
        *self = value
            .to_string()
            .parse()
            .map_err(|_| format!("{value} is not a count"))?;
        Ok(())
    }
}

impl<P: Part> Part for Option<P> {
    fn set(&mut self, key: &[&str], value: f64) -> Result<(), String> {
        if let Some(part) = self {
            return part.set(key, value);
        }
        let Some(mut part) = P::created() else {
            return no_number();
        };
        part.set(key, value)?;
        *self = Some(part);
        Ok(())
    }
}

impl<P: Part> Part for Vec<P> {
    fn set(&mut self, key: &[&str], value: f64) -> Result<(), String> {
        let n = self.len();
        match key {
            [index, rest @ ..] => match index
                .strip_suffix(']')
                .and_then(|index| index.parse::<usize>().ok())
            {
                Some(index) if index < n => self[index].set(rest, value),
                Some(index) => Err(format!("the list has {n} items; there is no item {index}")),
                None => no_number(),
            },
            [] => no_number(),
        }
    }
}

impl<P: Part> Part for BTreeMap<String, P> {
    fn set(&mut self, key: &[&str], value: f64) -> Result<(), String> {
        match key {
            [name, rest @ ..] => {
                let mut part = self.remove(*name);
                let set = part.set(rest, value);
                self.extend(part.map(|part| ((*name).to_owned(), part)));
                set
            }
            [] => no_number(),
        }
    }
}

impl Part for Tuned {
    fn set(&mut self, key: &[&str], value: f64) -> Result<(), String> {
        match key {
            [table, name] => self.set(table, name, value),
            _ => no_number(),
        }
    }
}

/// Parts with the names of their members; after `=`, the result of [`Part::created`].
macro_rules! tables {
    ($($part:ty $(= $created:expr;)? { $($member:ident),* })*) => {$(
        impl Part for $part {
            $(fn created() -> Option<Self> {
                $created
            })?

            fn set(&mut self, key: &[&str], value: f64) -> Result<(), String> {
                match key {
                    $([name, rest @ ..] if *name == stringify!($member) => self.$member.set(rest, value),)*
                    _ => no_number(),
                }
            }
        }
    )*};
}

tables! {
    Scenario {
        duration_s, settled_after_s, origin, surface_craft, auvs, water, knowledge, bounds, faults
    }
    OriginFile { lat_deg, lon_deg }
    BoundsFile { keep_outs, range_max_m, energy_max_j }
    KeepOutFile { north_m, east_m, radius_m }
    FaultFile { from_s, until_s, what }
    SurfaceCraftFile {
        class, north_m, east_m, heading_rad, speed_mps, goal, goal_offset, contact_range_m, limits, craft, tuning,
        parameters
    }
    RandomCraftFile { mass_kg, heading_lag_s, surge_lag_s, acceleration_mps2, delay_s }
    LimitsFile {
        speed_min_mps, speed_max_mps, turn_rate_max_radps, acceleration_max_mps2, deceleration_max_mps2, surge_lag_s
    }
    CraftDescription<Distribution> = Some(Self::default()); {
        heading_loop, surge_loop, sway_per_yaw_rate_s, power, relative_uncertainty
    }
    HeadingLoop<Distribution> { time_constant_s, natural_frequency_radps, damping, delay_s, rate_max_radps }
    SurgeLoop<Distribution> { time_constant_s, delay_s, acceleration_max_mps2, deceleration_max_mps2, integral_time_s }
    Power<Distribution> = Some(Self::default()); { linear_w_per_mps, cubic_w_per_mps3 }
    Tuning = Some(Self::default()); {
        position_weight_per_m2, velocity_weight_per_m2ps2, acceleration_weight_per_m2ps4, terminal_position_weight_per_m2,
        terminal_velocity_weight_per_m2ps2, energy_weight_per_j, scp_iterations, steps_s
    }
    AuvFile {
        north_of_path_m, east_of_path_m, heading_off_path_rad, depth_m, speed_mps, speed_profile, dive, navigation_error,
        path
    }
    NavigationErrorFile = Some(Self::default()); { north_m, east_m, drift_share, drift_heading_rad }
    SpeedKnot { along_m, speed_mps }
    DiveFile { depth_min_m, depth_max_m, pitch_rad }
    WaterFile { current, gauss_markov, shear, waves }
    GaussMarkovFile { sigma_mps, correlation_s }
    ShearFile { depth_m, factor, turn_rad }
    WavesFile { heading_sigma_rad, surge_sigma_mps, peak_period_s, damping }
    KnowledgeFile { sensors, acoustics }
    SensorsFile {
        position_sigma_m, position_correlation_s, velocity_sigma_mps, heading_sigma_rad, heading_bias_rad,
        yaw_rate_sigma_radps, speed_sigma_mps
    }
    AcousticsFile {
        frame_s, slot_length_s, slots_s, latency_s, position_sigma_m, depth_sigma_m, course_sigma_rad, speed_sigma_mps,
        range_max_m, loss, loss_at_range_max, outlier_share, outlier_sigma_m, sound_speed_mps
    }
}

/// Parts of several kinds, each with the name of its kind as its only key.
macro_rules! kinds_of {
    ($($part:ident { $($name:literal: $kind:ident { $($member:ident),* })* })*) => {$(
        impl Part for $part {
            fn set(&mut self, key: &[&str], value: f64) -> Result<(), String> {
                match (self, key) {
                    $($((Self::$kind { $member, .. }, [$name, name, rest @ ..]) if *name == stringify!($member) => {
                        $member.set(rest, value)
                    })*)*
                    _ => no_number(),
                }
            }
        }
    )*};
}

kinds_of! {
    FaultKindFile { "thruster": Thruster { share }
        "clock_offset": ClockOffset { offset_s }
        "auv_leaves_path": AuvLeavesPath { heading_rad }
    }
    CurrentFile { "constant": Constant { north_mps, east_mps } }
    GoalFile {
        "intermittent": Intermittent { dwell_s, epoch_s }
        "weighted": Weighted { weights }
        "range": Range { range_m }
        "visit": Visit { cost, weights, within_m, dwell_min_s, serve_by_s }
    }
    VisitCostFile {
        "uncertainty": Uncertainty { growth_m2ps, sigma_m, sigma_rad, interval_s }
        "data": Data { growth_kbps, upload_kbps, range_max_m }
    }
    OffsetFile {
        "ned": Ned { north_m, east_m }
        "target": Target { ahead_m, starboard_m }
        "path": Path { ahead_m, starboard_m }
    }
    PathFile {
        "lawn_mower": LawnMower { heading_rad, lane_length_m, lane_spacing_m }
        "waypoints": Waypoints { fillet_m, turn_radius_m }
        "circle": Circle { radius_m, bearing_rad }
        "segments": Segments { segments }
        "geojson": Geojson { fillet_m }
        "random_survey": RandomSurvey { heading_rad, leg_m, spacing_m, turn_radius_m }
    }
    SegmentFile { "arc": Arc { angle_rad } }
}

impl Part for SurfaceClassFile {
    fn set(&mut self, key: &[&str], value: f64) -> Result<(), String> {
        match (self, key) {
            (Self::Random(random), ["random", rest @ ..]) => random.set(rest, value),
            _ => no_number(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
        let craft = scenario.surface_craft.expect("has one");
        assert_eq!(craft.limits.surge_lag_s, Some(Quantity::fixed(0.5)));
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
            (
                "auvs[2].speed_mps",
                0.1,
                "the list has 2 items; there is no item 2",
            ),
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
