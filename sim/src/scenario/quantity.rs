//! Numbers of a scenario file: each has a range, and is fixed or drawn for every seed.

use std::{fmt, marker::PhantomData, ops::RangeInclusive};

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{Error, MapAccess, Visitor};
use serde::{Deserialize, Deserializer};

mod kind;

pub use kind::*;

/// A number that is fixed, or a distribution from which every seed draws.
#[derive(Clone, Debug, PartialEq)]
pub enum Distribution {
    /// Always this value.
    Fixed(f64),
    /// Evenly between two limits.
    Uniform(f64, f64),
    /// Mean and standard deviation; a draw outside the range is clamped.
    Normal(f64, f64),
    /// One of these, with equal probability.
    Choice(Vec<f64>),
}

/// A number of the kind `K`, checked against its limits on reading.
#[derive(Clone, Debug, PartialEq)]
pub struct Quantity<K> {
    distribution: Distribution,
    kind: PhantomData<K>,
}

impl From<f64> for Distribution {
    fn from(value: f64) -> Self {
        Self::Fixed(value)
    }
}

impl Default for Distribution {
    fn default() -> Self {
        Self::Fixed(0.0)
    }
}

impl Distribution {
    /// A value for one seed, inside `range`. A fixed number draws nothing from `rng`.
    pub(super) fn draw(&self, range: &RangeInclusive<f64>, rng: &mut ChaCha8Rng) -> f64 {
        match self {
            Self::Fixed(value) => *value,
            Self::Uniform(least, most) => rng.random_range(*least..=*most),
            Self::Normal(mean, sigma) => {
                let deviate: f64 = StandardNormal.sample(rng);
                (mean + sigma * deviate).clamp(*range.start(), *range.end())
            }
            Self::Choice(values) => values[rng.random_range(0..values.len())],
        }
    }

    /// Fails with its first number outside `range`, in `unit`.
    pub(super) fn check(&self, range: &RangeInclusive<f64>, unit: &str) -> Result<(), String> {
        let each = |value: &f64| within("", *value, range, unit);
        match self {
            Self::Fixed(value) => each(value),
            Self::Uniform(least, most) => each(least).and(each(most)),
            Self::Normal(mean, sigma) => {
                let sigmas = 0.0..=range.end() - range.start();
                each(mean).and(within("a standard deviation of ", *sigma, &sigmas, unit))
            }
            Self::Choice(values) => values.iter().try_for_each(each),
        }
    }
}

fn within(what: &str, value: f64, range: &RangeInclusive<f64>, unit: &str) -> Result<(), String> {
    if range.contains(&value) {
        Ok(())
    } else {
        Err(format!("{what}{value} is outside {}", limits(range, unit)))
    }
}

/// The unit at the end of a member's name.
pub(super) fn unit_of(member: &str) -> &'static str {
    let units = [
        ("_w_per_mps", "W/(m/s)"),
        ("_w_per_mps3", "W/(m/s)³"),
        ("_radps", "rad/s"),
        ("_mps2", "m/s²"),
        ("_m2ps", "m²/s"),
        ("_kbps", "kbit/s"),
        ("_mps", "m/s"),
        ("_rad", "rad"),
        ("_m", "m"),
        ("_s", "s"),
    ];
    let known = units.iter().find(|(end, _)| member.ends_with(end));
    known.map_or("", |(_, unit)| unit)
}

/// A range with its unit, for messages.
fn limits(range: &RangeInclusive<f64>, unit: &str) -> String {
    let text = format!("{} to {} {unit}", range.start(), range.end());
    text.trim_end().to_owned()
}

impl<K: Kind> Quantity<K> {
    /// Always `value`, which must be inside the kind's limits.
    pub fn fixed(value: f64) -> Self {
        debug_assert!(K::RANGE.contains(&value), "{} {value}", K::NAME);
        Self::of(Distribution::Fixed(value))
    }

    /// A value for one seed, in SI. A fixed number draws nothing from `rng`.
    pub fn draw(&self, rng: &mut ChaCha8Rng) -> f64 {
        self.distribution.draw(&K::RANGE, rng)
    }

    /// The largest possible draw.
    pub fn most(&self) -> f64 {
        match &self.distribution {
            Distribution::Fixed(value) | Distribution::Uniform(_, value) => *value,
            Distribution::Normal(..) => K::MAX,
            Distribution::Choice(values) => values.iter().copied().fold(*K::RANGE.start(), f64::max),
        }
    }

    fn of(distribution: Distribution) -> Self {
        Self { distribution, kind: PhantomData }
    }
}

impl<'de, K: Kind> Deserialize<'de> for Quantity<K> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let distribution = deserializer.deserialize_any(Form { range: K::RANGE, unit: K::UNIT })?;
        Ok(Self::of(distribution))
    }
}

impl<'de> Deserialize<'de> for Distribution {
    /// Its range is unknown here.
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(Form { range: f64::NEG_INFINITY..=f64::INFINITY, unit: "" })
    }
}

/// Reader of all forms: errors of an untagged enum contain neither line nor limit.
struct Form {
    range: RangeInclusive<f64>,
    unit: &'static str,
}

/// The kinds of distributions.
pub(super) const DISTRIBUTIONS: [&str; 3] = ["uniform", "normal", "choice"];

impl<'de> Visitor<'de> for Form {
    type Value = Distribution;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a number")?;
        if self.range.end().is_finite() {
            write!(f, " ({})", limits(&self.range, self.unit))?;
        }
        f.write_str(", or {uniform = [least, most]}, {normal = [mean, sigma]}, {choice = [a, b, …]}")
    }

    fn visit_f64<E: Error>(self, value: f64) -> Result<Self::Value, E> {
        self.checked(Distribution::Fixed(value))
    }

    fn visit_i64<E: Error>(self, value: i64) -> Result<Self::Value, E> {
        self.visit_f64(value as f64)
    }

    fn visit_u64<E: Error>(self, value: u64) -> Result<Self::Value, E> {
        self.visit_f64(value as f64)
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
        let Some(name) = map.next_key::<String>()? else {
            return Err(A::Error::custom("an empty table; expected one of uniform, normal, choice"));
        };
        let distribution = match name.as_str() {
            "uniform" => {
                let [least, most] = two(&map.next_value::<Vec<f64>>()?)?;
                Distribution::Uniform(least, most)
            }
            "normal" => {
                let [mean, sigma] = two(&map.next_value::<Vec<f64>>()?)?;
                Distribution::Normal(mean, sigma)
            }
            "choice" => Distribution::Choice(map.next_value()?),
            other => return Err(A::Error::unknown_field(other, &DISTRIBUTIONS)),
        };
        let distribution = self.checked(distribution)?;
        match map.next_key::<String>()? {
            Some(second) => {
                Err(A::Error::custom(format!("both {name} and {second}; a number has one distribution")))
            }
            None => Ok(distribution),
        }
    }
}

impl Form {
    fn checked<E: Error>(&self, distribution: Distribution) -> Result<Distribution, E> {
        distribution.check(&self.range, self.unit).map_err(E::custom)?;
        match &distribution {
            Distribution::Uniform(least, most) if most < least => {
                Err(E::custom(format!("uniform runs from {least} to {most}: the lower limit comes first")))
            }
            Distribution::Choice(values) if values.is_empty() => {
                Err(E::custom("an empty choice; give at least one value"))
            }
            _ => Ok(distribution),
        }
    }
}

/// Exactly two numbers: an array type would ignore further ones.
fn two<E: Error>(numbers: &[f64]) -> Result<[f64; 2], E> {
    numbers.try_into().map_err(|_| E::custom(format!("{} numbers instead of two", numbers.len())))
}

impl<K: Kind> JsonSchema for Quantity<K> {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        K::NAME.into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        schema_within(&K::RANGE, K::UNIT)
    }
}

impl JsonSchema for Distribution {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Distribution".into()
    }

    /// `schema_within` with its range replaces it.
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({})
    }
}

/// The schema of numbers in `range`, and of distributions of them.
pub(super) fn schema_within(range: &RangeInclusive<f64>, unit: &str) -> Schema {
    let (least, most) = (range.start(), range.end());
    let number = json_schema!({ "type": "number", "minimum": least, "maximum": most });
    let table = |name: &str, value: Schema| {
        json_schema!({
            "type": "object",
            "properties": { name: value },
            "required": [name],
            "additionalProperties": false,
        })
    };
    json_schema!({
        "description": format!("{}; a distribution is drawn for every seed.", limits(range, unit)),
        "oneOf": [
            number,
            table("uniform", json_schema!({ "type": "array", "items": number, "minItems": 2, "maxItems": 2 })),
            table("normal", json_schema!({
                "type": "array",
                "prefixItems": [number, { "type": "number", "minimum": 0, "maximum": most - least }],
                "minItems": 2,
                "maxItems": 2,
            })),
            table("choice", json_schema!({ "type": "array", "items": number, "minItems": 1 })),
        ],
    })
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;

    use super::*;
    use crate::tests::near;

    #[derive(Debug, Deserialize)]
    struct OneSpeed {
        v: Quantity<Speed>,
    }

    fn read(text: &str) -> Result<Quantity<Speed>, String> {
        let read: Result<OneSpeed, _> = toml::from_str(text);
        read.map(|one| one.v).map_err(|error| error.to_string())
    }

    #[test]
    fn every_form_of_a_number_is_read_and_stays_in_its_range() {
        assert_eq!(read("v = 2").expect("whole"), Quantity::fixed(2.0));
        assert_eq!(read("v = 0.25").expect("a number"), Quantity::fixed(0.25));
        let n = 20_000;
        // Standard deviations: 0.2 as written, (1.5 − 0.5)/√12 of a uniform distribution, half the
        // distance of two choices.
        for (text, range, mean_and_sigma) in [
            ("v = {uniform = [0.5, 1.5]}", 0.5..=1.5, Some((1.0, 12_f64.sqrt().recip()))),
            ("v = {normal = [1.0, 0.2]}", 0.0..=5.0, Some((1.0, 0.2))),
            ("v = {normal = [4.9, 0.5]}", 2.0..=5.0, None),
            ("v = {choice = [0.1, 0.2]}", 0.1..=0.2, Some((0.15, 0.05))),
        ] {
            let quantity = read(text).expect("a distribution");
            let mut rng = ChaCha8Rng::seed_from_u64(1);
            let draws: Vec<f64> = (0..n).map(|_| quantity.draw(&mut rng)).collect();
            assert!(draws.iter().all(|draw| range.contains(draw)), "{text}");
            assert!(draws.iter().any(|draw| *draw != draws[0]), "{text}");
            let Some((mean, sigma)) = mean_and_sigma else { continue };
            let mean_of = |f: &dyn Fn(f64) -> f64| draws.iter().map(|x| f(*x)).sum::<f64>() / f64::from(n);
            // Five standard errors of the mean; that of the variance is 1 %.
            let found = mean_of(&|x| x);
            near(found, mean, 5.0 * sigma / f64::from(n).sqrt());
            near(mean_of(&|x| (x - found).powi(2)).sqrt() / sigma, 1.0, 0.05);
        }
    }

    #[test]
    fn a_wrong_number_names_the_value_and_the_limit() {
        for (text, says) in [
            ("-1", "-1 is outside 0 to 5 m/s"),
            ("nan", "NaN is outside 0 to 5 m/s"),
            ("{uniform = [1, 9]}", "9 is outside 0 to 5 m/s"),
            ("{uniform = [2, 1]}", "the lower limit comes first"),
            ("{normal = [1, -1]}", "a standard deviation of -1"),
            ("{choice = []}", "at least one"),
            ("{gamma = [1, 2]}", "unknown field `gamma`"),
            ("{uniform = [1, 2], normal = [1, 2]}", "a number has one distribution"),
            ("{uniform = [0, 1, 2]}", "3 numbers instead of two"),
            ("{}", "one of uniform, normal, choice"),
            ("\"fast\"", "expected a number (0 to 5 m/s)"),
        ] {
            let error = read(&format!("v = {text}")).expect_err(text);
            assert!(error.contains(says), "{text}: {error}");
            assert!(error.contains("line 1"), "{error}");
        }
    }
}
