//! Numbers of a scenario file: each inside its range, each fixed or drawn anew for every seed.

use std::{fmt, marker::PhantomData};

use planner::craft::description;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{
    Deserialize, Deserializer,
    de::{Error, MapAccess, Visitor},
};

/// What a number counts, and between which limits.
pub trait Kind {
    /// Its name in the schema.
    const NAME: &'static str;
    /// Its unit, for people.
    const UNIT: &'static str;
    /// Least value.
    const LEAST: f64;
    /// Largest value.
    const MOST: f64;
}

/// A number of a scenario: fixed, or a distribution that every seed draws from.
#[derive(Clone, Debug, PartialEq)]
pub struct Quantity<K> {
    law: Law,
    kind: PhantomData<K>,
}

#[derive(Clone, Debug, PartialEq)]
enum Law {
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
        debug_assert!((K::LEAST..=K::MOST).contains(&value), "{} {value}", K::NAME);
        Self::of(Law::Fixed(value))
    }

    /// A value for one seed, in SI. A fixed one takes nothing from `rng`.
    pub fn draw(&self, rng: &mut ChaCha8Rng) -> f64 {
        match &self.law {
            Law::Fixed(value) => *value,
            Law::Uniform(least, most) => rng.random_range(*least..=*most),
            Law::Normal(mean, sigma) => {
                let deviate: f64 = StandardNormal.sample(rng);
                (mean + sigma * deviate).clamp(K::LEAST, K::MOST)
            }
            Law::Choice(values) => values[rng.random_range(0..values.len())],
        }
    }

    /// The largest value it may draw.
    #[must_use]
    pub fn most(&self) -> f64 {
        match &self.law {
            Law::Fixed(value) | Law::Uniform(_, value) => *value,
            Law::Normal(..) => K::MOST,
            Law::Choice(values) => values.iter().copied().fold(K::LEAST, f64::max),
        }
    }

    fn of(law: Law) -> Self {
        Self {
            law,
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
            K::LEAST,
            K::MOST,
            K::UNIT
        )
    }

    fn visit_f64<E: Error>(self, value: f64) -> Result<Self::Value, E> {
        Ok(Quantity::of(Law::Fixed(within::<K, E>(value)?)))
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
        let law = match name.as_str() {
            "uniform" => {
                let [least, most] = two(&map.next_value::<Vec<f64>>()?)?;
                within::<K, _>(least)?;
                within::<K, _>(most)?;
                if most < least {
                    return Err(A::Error::custom(format!(
                        "uniform runs from {least} to {most}: the least comes first"
                    )));
                }
                Law::Uniform(least, most)
            }
            "normal" => {
                let [mean, sigma] = two(&map.next_value::<Vec<f64>>()?)?;
                within::<K, _>(mean)?;
                if !(0.0..=K::MOST - K::LEAST).contains(&sigma) {
                    return Err(A::Error::custom(format!(
                        "a standard deviation of {sigma} is outside 0 to {} {}",
                        K::MOST - K::LEAST,
                        K::UNIT
                    )));
                }
                Law::Normal(mean, sigma)
            }
            "choice" => {
                let values = map.next_value::<Vec<f64>>()?;
                if values.is_empty() {
                    return Err(A::Error::custom("a choice of nothing; give at least one value"));
                }
                for value in &values {
                    within::<K, _>(*value)?;
                }
                Law::Choice(values)
            }
            other => return Err(A::Error::unknown_field(other, &DISTRIBUTIONS)),
        };
        match map.next_key::<String>()? {
            Some(second) => Err(A::Error::custom(format!(
                "both {name} and {second}; a number has one distribution"
            ))),
            None => Ok(Quantity::of(law)),
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
    if (K::LEAST..=K::MOST).contains(&value) {
        Ok(value)
    } else {
        Err(E::custom(format!(
            "{value} is outside {} to {} {}",
            K::LEAST,
            K::MOST,
            K::UNIT
        )))
    }
}

impl<K: Kind> JsonSchema for Quantity<K> {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        K::NAME.into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let number = json_schema!({ "type": "number", "minimum": K::LEAST, "maximum": K::MOST });
        let table = |name: &str, value: Schema| {
            json_schema!({
                "type": "object",
                "properties": { name: value },
                "required": [name],
                "additionalProperties": false,
            })
        };
        json_schema!({
            "description": format!("{} to {} {}; drawn anew for every seed if a distribution.", K::LEAST, K::MOST, K::UNIT),
            "oneOf": [
                number,
                table("uniform", json_schema!({ "type": "array", "items": number, "minItems": 2, "maxItems": 2 })),
                table("normal", json_schema!({
                    "type": "array",
                    "prefixItems": [number, { "type": "number", "minimum": 0, "maximum": K::MOST - K::LEAST }],
                    "minItems": 2,
                    "maxItems": 2,
                })),
                table("choice", json_schema!({ "type": "array", "items": number, "minItems": 1 })),
            ],
        })
    }
}

macro_rules! kinds {
    ($($(#[$doc:meta])* $name:ident: $least:expr, $most:expr, $unit:literal;)*) => {$(
        $(#[$doc])*
        #[derive(Clone, Debug, PartialEq)]
        pub enum $name {}

        impl Kind for $name {
            const NAME: &'static str = stringify!($name);
            const UNIT: &'static str = $unit;
            const LEAST: f64 = $least;
            const MOST: f64 = $most;
        }
    )*};
}

kinds! {
    /// North or east of the datum. A tenth of what a snapshot accepts: in a day at 3 m/s in a current of 3 m/s
    /// nobody leaves that.
    Coordinate: -1.0e5, 1.0e5, "m";
    /// A length that must not vanish.
    Length: 0.01, 1.0e5, "m";
    /// Slant range to stay within; what a snapshot accepts.
    SlantRange: 1.0, 2.0e4, "m";
    /// A component of an offset; what a snapshot accepts.
    OffsetComponent: -1.0e3, 1.0e3, "m";
    /// Weight of a vehicle in a mean; what a snapshot accepts.
    Weight: 0.0, 1.0e6, "";
    /// Depth, positive down. Twice the deepest that gliders go, and more than most seas.
    Depth: 0.0, 2000.0, "m";
    /// A heading or a change of one, rad.
    Angle: -std::f64::consts::TAU, std::f64::consts::TAU, "rad";
    /// Pitch of a dive: steep enough to dive, short of the vertical, where yaw loses its meaning.
    Pitch: 0.05, 1.3, "rad";
    /// Speed through the water.
    Speed: 0.0, 5.0, "m/s";
    /// Speed of an underwater vehicle along its path.
    PathSpeed: 0.05, 3.0, "m/s";
    /// A component of the current; what a snapshot accepts.
    CurrentComponent: -3.0, 3.0, "m/s";
    /// How long a mission lasts: up to a day.
    MissionTime: 1.0, 86_400.0, "s";
    /// An instant of a mission.
    Instant: 0.0, 86_400.0, "s";
    /// A time on a clock, or an offset of one.
    ClockTime: -86_400.0, 86_400.0, "s";
    /// A time constant, a period, a delay.
    Period: 0.0, 3600.0, "s";
    /// A share of a whole.
    Share: 0.0, 1.0, "";
    /// A factor on a current.
    Factor: 0.0, 2.0, "";
    /// Standard deviation of a position.
    PositionNoise: 0.0, 1000.0, "m";
    /// Standard deviation of a measured speed.
    SpeedNoise: 0.0, 0.4, "m/s";
    /// Standard deviation of a speed of the water.
    WaterSpeedNoise: 0.0, 1.0, "m/s";
    /// Standard deviation of an angle.
    AngleNoise: 0.0, 0.5, "rad";
    /// Bias of an angle.
    AngleBias: -1.0, 1.0, "rad";
    /// Standard deviation of a rate of turn.
    RateNoise: 0.0, 0.2, "rad/s";
    /// Standard deviation of a depth.
    DepthNoise: 0.0, 1.0, "m";
    /// Damping ratio of a wave spectrum.
    Damping: 0.01, 0.5, "";
    /// Peak period of waves.
    WavePeriod: 1.0, 30.0, "s";
    /// Time after which a process has forgotten itself.
    CorrelationTime: 0.1, 1.0e6, "s";
    /// Half a turn to either side.
    HalfTurn: -std::f64::consts::PI, std::f64::consts::PI, "rad";
    /// Depth down to which a current changes.
    ShearDepth: 0.1, 2000.0, "m";
    /// Radius of a disc to keep out of; what a snapshot accepts.
    KeepOutRadius: 0.1, 1.0e4, "m";
    /// Slant range to keep within; what a snapshot accepts.
    RangeToKeep: 1.0, 20_000.0, "m";
    /// Range of an acoustic modem.
    AcousticRange: 0.01, 20_000.0, "m";
    /// Time from one slot to the next.
    FrameTime: 1.0, 3600.0, "s";
    /// Length of a message, or of its processing.
    MessageTime: 0.001, 30.0, "s";
    /// Time constant of a control loop; what a snapshot accepts.
    LoopLag: *description::TIME_CONSTANT.start(), *description::TIME_CONSTANT.end(), "s";
    /// Least speed of a craft that steers.
    LeastSpeed: 0.0, 2.0, "m/s";
    /// Speed of sound in water.
    SoundSpeed: 1400.0, 1600.0, "m/s";
    /// Largest rate of turn.
    TurnRate: 0.01, 2.0, "rad/s";
    /// Largest acceleration.
    Acceleration: 0.005, 5.0, "m/s²";
    /// Dry mass of a surface craft that is drawn.
    CraftMass: 20.0, 500.0, "kg";
    /// Lag that a loop of a craft that is drawn is tuned for.
    TunedLag: 0.5, 8.0, "s";
    /// Acceleration that the surge loop of a craft that is drawn asks for.
    TunedAcceleration: 0.03, 0.8, "m/s²";
    /// Delay of references on their way to the loops.
    CommandDelay: 0.0, 2.0, "s";
    /// Natural frequency of a heading loop; this and what follows as a snapshot accepts them.
    NaturalFrequency: *description::NATURAL_FREQUENCY.start(), *description::NATURAL_FREQUENCY.end(), "rad/s";
    /// Damping ratio of a heading loop.
    LoopDamping: *description::DAMPING.start(), *description::DAMPING.end(), "";
    /// Delay of a loop.
    LoopDelay: *description::DELAY.start(), *description::DELAY.end(), "s";
    /// Fastest turn that a heading loop makes.
    LoopRate: *description::RATE_MAX.start(), *description::RATE_MAX.end(), "rad/s";
    /// Largest acceleration of a speed loop.
    LoopAcceleration: *description::ACCELERATION.start(), *description::ACCELERATION.end(), "m/s²";
    /// Time of a speed loop's integrator.
    IntegralTime: *description::INTEGRAL_TIME.start(), *description::INTEGRAL_TIME.end(), "s";
    /// Sway per surge and yaw rate.
    SwayPerYawRate: *description::SWAY_PER_YAW_RATE.start(), *description::SWAY_PER_YAW_RATE.end(), "s";
    /// Coefficient of propulsion power.
    PowerCoefficient: *description::POWER_COEFFICIENT.start(), *description::POWER_COEFFICIENT.end(), "W/(m/s)ⁿ";
    /// Relative uncertainty of what is told of a craft.
    RelativeUncertainty:
        *description::RELATIVE_UNCERTAINTY.start(), *description::RELATIVE_UNCERTAINTY.end(), "";
    /// Propulsion energy.
    Energy: 0.0, 1.0e12, "J";
    /// Latitude of the datum.
    Latitude: -90.0, 90.0, "°";
    /// Longitude of the datum.
    Longitude: -180.0, 180.0, "°";
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
