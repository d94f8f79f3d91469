//! Numbers of a scenario file: each inside its range, each fixed or drawn anew for every seed.

use std::{fmt, marker::PhantomData};

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{
    Deserialize, Deserializer,
    de::{Error, MapAccess, Visitor},
};

mod kind;

pub use kind::*;

/// A number of a scenario: fixed, or a distribution that every seed draws from.
#[derive(Clone, Debug, PartialEq)]
pub struct Quantity<K> {
    distribution: Distribution,
    kind: PhantomData<K>,
}

#[derive(Clone, Debug, PartialEq)]
enum Distribution {
    Fixed(f64),
    /// Evenly between two limits.
    Uniform(f64, f64),
    /// Mean and standard deviation; draws outside the kind's limits become the limit.
    Normal(f64, f64),
    /// One of these, each as likely.
    Choice(Vec<f64>),
}

impl<K: Kind> Quantity<K> {
    /// Always `value`, which must lie inside the kind's limits.
    #[must_use]
    pub fn fixed(value: f64) -> Self {
        debug_assert!((K::MIN..=K::MAX).contains(&value), "{} {value}", K::NAME);
        Self::of(Distribution::Fixed(value))
    }

    /// A value for one seed, in SI. A fixed one takes nothing from `rng`.
    pub fn draw(&self, rng: &mut ChaCha8Rng) -> f64 {
        match &self.distribution {
            Distribution::Fixed(value) => *value,
            Distribution::Uniform(least, most) => rng.random_range(*least..=*most),
            Distribution::Normal(mean, sigma) => {
                let deviate: f64 = StandardNormal.sample(rng);
                (mean + sigma * deviate).clamp(K::MIN, K::MAX)
            }
            Distribution::Choice(values) => values[rng.random_range(0..values.len())],
        }
    }

    /// The largest value it may draw.
    #[must_use]
    pub fn most(&self) -> f64 {
        match &self.distribution {
            Distribution::Fixed(value) | Distribution::Uniform(_, value) => *value,
            Distribution::Normal(..) => K::MAX,
            Distribution::Choice(values) => values.iter().copied().fold(K::MIN, f64::max),
        }
    }

    fn of(distribution: Distribution) -> Self {
        Self {
            distribution,
            kind: PhantomData,
        }
    }
}

impl<'de, K: Kind> Deserialize<'de> for Quantity<K> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(QuantityVisitor(PhantomData))
    }
}

/// Reads numbers itself rather than through an untagged enum, whose errors forget line and limit.
struct QuantityVisitor<K>(PhantomData<K>);

const DISTRIBUTIONS: [&str; 3] = ["uniform", "normal", "choice"];

impl<'de, K: Kind> Visitor<'de> for QuantityVisitor<K> {
    type Value = Quantity<K>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "a number ({} to {} {}), or {{uniform = [least, most]}}, {{normal = [mean, sigma]}}, \
             {{choice = [a, b, …]}}",
            K::MIN,
            K::MAX,
            K::UNIT
        )
    }

    fn visit_f64<E: Error>(self, value: f64) -> Result<Self::Value, E> {
        Ok(Quantity::of(Distribution::Fixed(within::<K, E>(value)?)))
    }

    #[expect(
        clippy::cast_precision_loss,
        reason = "no limit here is anywhere near 2⁵³, so what is rounded is refused"
    )]
    fn visit_i64<E: Error>(self, value: i64) -> Result<Self::Value, E> {
        self.visit_f64(value as f64)
    }

    #[expect(clippy::cast_precision_loss, reason = "as above")]
    fn visit_u64<E: Error>(self, value: u64) -> Result<Self::Value, E> {
        self.visit_f64(value as f64)
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
        let Some(name) = map.next_key::<String>()? else {
            return Err(A::Error::custom(
                "an empty table; expected one of uniform, normal, choice",
            ));
        };
        let distribution = match name.as_str() {
            "uniform" => {
                let [least, most] = two(&map.next_value::<Vec<f64>>()?)?;
                within::<K, _>(least)?;
                within::<K, _>(most)?;
                if most < least {
                    return Err(A::Error::custom(format!(
                        "uniform runs from {least} to {most}: the least comes first"
                    )));
                }
                Distribution::Uniform(least, most)
            }
            "normal" => {
                let [mean, sigma] = two(&map.next_value::<Vec<f64>>()?)?;
                within::<K, _>(mean)?;
                if !(0.0..=K::MAX - K::MIN).contains(&sigma) {
                    return Err(A::Error::custom(format!(
                        "a standard deviation of {sigma} is outside 0 to {} {}",
                        K::MAX - K::MIN,
                        K::UNIT
                    )));
                }
                Distribution::Normal(mean, sigma)
            }
            "choice" => {
                let values = map.next_value::<Vec<f64>>()?;
                if values.is_empty() {
                    return Err(A::Error::custom("a choice of nothing; give at least one value"));
                }
                for value in &values {
                    within::<K, _>(*value)?;
                }
                Distribution::Choice(values)
            }
            other => return Err(A::Error::unknown_field(other, &DISTRIBUTIONS)),
        };
        match map.next_key::<String>()? {
            Some(second) => Err(A::Error::custom(format!(
                "both {name} and {second}; a number has one distribution"
            ))),
            None => Ok(Quantity::of(distribution)),
        }
    }
}

/// Two numbers and no third: an array of two would let more pass unseen.
fn two<E: Error>(numbers: &[f64]) -> Result<[f64; 2], E> {
    numbers
        .try_into()
        .map_err(|_| E::custom(format!("{} numbers, and two are wanted", numbers.len())))
}

fn within<K: Kind, E: Error>(value: f64) -> Result<f64, E> {
    if (K::MIN..=K::MAX).contains(&value) {
        Ok(value)
    } else {
        Err(E::custom(format!(
            "{value} is outside {} to {} {}",
            K::MIN,
            K::MAX,
            K::UNIT
        )))
    }
}

impl<K: Kind> JsonSchema for Quantity<K> {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        K::NAME.into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let number = json_schema!({ "type": "number", "minimum": K::MIN, "maximum": K::MAX });
        let table = |name: &str, value: Schema| {
            json_schema!({
                "type": "object",
                "properties": { name: value },
                "required": [name],
                "additionalProperties": false,
            })
        };
        json_schema!({
            "description": format!("{} to {} {}; drawn anew for every seed if a distribution.", K::MIN, K::MAX, K::UNIT),
            "oneOf": [
                number,
                table("uniform", json_schema!({ "type": "array", "items": number, "minItems": 2, "maxItems": 2 })),
                table("normal", json_schema!({
                    "type": "array",
                    "prefixItems": [number, { "type": "number", "minimum": 0, "maximum": K::MAX - K::MIN }],
                    "minItems": 2,
                    "maxItems": 2,
                })),
                table("choice", json_schema!({ "type": "array", "items": number, "minItems": 1 })),
            ],
        })
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;

    use super::*;

    #[derive(Debug, Deserialize)]
    struct OneSpeed {
        v: Quantity<Speed>,
    }

    fn read(text: &str) -> Result<Quantity<Speed>, String> {
        let read: Result<OneSpeed, _> = toml::from_str(text);
        read.map(|one| one.v).map_err(|error| error.to_string())
    }

    #[test]
    fn every_form_of_a_number_is_read_and_none_leaves_its_range() {
        assert_eq!(read("v = 2").expect("whole"), Quantity::fixed(2.0));
        assert_eq!(read("v = 0.25").expect("a number"), Quantity::fixed(0.25));
        for (text, least, most) in [
            ("v = {uniform = [0.5, 1.5]}", 0.5, 1.5),
            ("v = {normal = [4.9, 0.5]}", 3.0, 5.0),
            ("v = {choice = [0.1, 0.2]}", 0.1, 0.2),
        ] {
            let quantity = read(text).expect("a distribution");
            let mut rng = ChaCha8Rng::seed_from_u64(1);
            let draws: Vec<f64> = (0..2000).map(|_| quantity.draw(&mut rng)).collect();
            assert!(draws.iter().all(|draw| (least..=most).contains(draw)), "{text}");
            assert!(draws.iter().any(|draw| *draw != draws[0]), "{text}");
        }
    }

    #[test]
    fn draws_have_the_mean_and_the_spread_asked_for() {
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        let n = 20_000;
        // Standard deviations: 0.2 as written; (1.5 − 0.5)/√12 of an even spread.
        for (text, sigma) in [
            ("v = {normal = [1.0, 0.2]}", 0.2),
            ("v = {uniform = [0.5, 1.5]}", 12_f64.sqrt().recip()),
        ] {
            let quantity = read(text).expect("a distribution");
            let draws: Vec<f64> = (0..n).map(|_| quantity.draw(&mut rng)).collect();
            let mean = draws.iter().sum::<f64>() / f64::from(n);
            let variance = draws.iter().map(|draw| (draw - mean).powi(2)).sum::<f64>() / f64::from(n);
            // Five standard errors of the mean; the variance's are 1 % here.
            assert!(
                (mean - 1.0).abs() < 5.0 * sigma / f64::from(n).sqrt(),
                "{text}: {mean}"
            );
            assert!((variance.sqrt() / sigma - 1.0).abs() < 0.05, "{text}: {variance}");
        }
    }

    #[test]
    fn a_wrong_number_names_the_value_and_the_limit() {
        for (text, says) in [
            ("v = -1", "-1 is outside 0 to 5 m/s"),
            ("v = nan", "NaN is outside 0 to 5 m/s"),
            ("v = {uniform = [1, 9]}", "9 is outside 0 to 5 m/s"),
            ("v = {uniform = [2, 1]}", "the least comes first"),
            ("v = {normal = [1, -1]}", "a standard deviation of -1"),
            ("v = {choice = []}", "at least one"),
            ("v = {gamma = [1, 2]}", "unknown field `gamma`"),
            (
                "v = {uniform = [1, 2], normal = [1, 2]}",
                "a number has one distribution",
            ),
            ("v = {uniform = [0, 1, 2]}", "3 numbers, and two are wanted"),
            ("v = {}", "one of uniform, normal, choice"),
            ("v = \"fast\"", "expected a number (0 to 5 m/s)"),
        ] {
            let error = read(text).expect_err(text);
            assert!(error.contains(says), "{text}: {error}");
            assert!(error.contains("line 1"), "{error}");
        }
    }
}
