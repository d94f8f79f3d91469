//! Units and limits of a scenario's numbers.

use std::ops::RangeInclusive;

use planner::snapshot::{ACOUSTIC_RANGE, ANGLE, CURRENT_MAX, KEEP_OUT_RADIUS, OFFSET_MAX};

use crate::world::surface_craft::random;

/// A kind of number with its unit and limits.
pub trait Kind {
    /// Its name in the schema.
    const NAME: &'static str;
    /// Its unit, for messages.
    const UNIT: &'static str;
    /// Its range.
    const RANGE: RangeInclusive<f64>;
    /// Its largest value.
    const MAX: f64 = *Self::RANGE.end();
}

macro_rules! kinds {
    ($($(#[$doc:meta])* $name:ident: $range:expr, $unit:literal;)*) => {$(
        $(#[$doc])*
        #[derive(Clone, Debug, PartialEq)]
        pub enum $name {}

        impl Kind for $name {
            const NAME: &'static str = stringify!($name);
            const UNIT: &'static str = $unit;
            const RANGE: RangeInclusive<f64> = $range;
        }
    )*};
}

kinds! {
    /// North or east of the datum, a tenth of a snapshot's range: no vehicle leaves it in a day at
    /// 3 m/s in a current of 3 m/s.
    Coordinate: -1.0e5..=1.0e5, "m";
    /// A positive length.
    Length: 0.01..=1.0e5, "m";
    /// A component of an offset; the range of a snapshot.
    OffsetComponent: -OFFSET_MAX..=OFFSET_MAX, "m";
    /// Depth, positive down. Twice the depth that gliders reach.
    Depth: 0.0..=2000.0, "m";
    /// A heading or a change of one, rad.
    Angle: ANGLE, "rad";
    /// Pitch of a dive: steep enough to dive, short of the vertical, at which yaw is undefined.
    Pitch: 0.05..=1.3, "rad";
    /// Speed through the water.
    Speed: 0.0..=5.0, "m/s";
    /// Speed of an underwater vehicle along its path.
    PathSpeed: 0.05..=3.0, "m/s";
    /// A component of the current; the range of a snapshot.
    CurrentComponent: -CURRENT_MAX..=CURRENT_MAX, "m/s";
    /// Duration of a mission: up to a day.
    MissionTime: 1.0..=86_400.0, "s";
    /// An instant of a mission.
    Instant: 0.0..=86_400.0, "s";
    /// A time on a clock, or an offset of one.
    ClockTime: -86_400.0..=86_400.0, "s";
    /// A time constant, a period, a delay.
    Period: 0.0..=3600.0, "s";
    /// A share of a whole.
    Share: 0.0..=1.0, "";
    /// A share of a whole, to either side.
    SignedShare: -1.0..=1.0, "";
    /// A factor on a claimed standard deviation.
    ClaimFactor: 1.0e-6..=1.0e6, "";
    /// A factor on a current.
    Factor: 0.0..=2.0, "";
    /// Standard deviation of a position.
    PositionNoise: 0.0..=1000.0, "m";
    /// Standard deviation of a measured speed.
    SpeedNoise: 0.0..=0.4, "m/s";
    /// Standard deviation of a speed of the water.
    WaterSpeedNoise: 0.0..=1.0, "m/s";
    /// Standard deviation of an angle.
    AngleNoise: 0.0..=0.5, "rad";
    /// Bias of an angle.
    AngleBias: -1.0..=1.0, "rad";
    /// Standard deviation of a rate of turn.
    RateNoise: 0.0..=0.2, "rad/s";
    /// Standard deviation of a depth.
    DepthNoise: 0.0..=1.0, "m";
    /// Damping ratio of a wave spectrum.
    Damping: 0.01..=0.5, "";
    /// Peak period of waves.
    WavePeriod: 1.0..=30.0, "s";
    /// Period of a weave: from one that a hull cannot follow to most of a survey's lane.
    WeavePeriod: 5.0..=3600.0, "s";
    /// Share of a speed that a vehicle loses without coming to rest.
    LostShare: 0.0..=0.9, "";
    /// Correlation time of a process.
    CorrelationTime: 0.1..=1.0e6, "s";
    /// Half a turn to either side.
    HalfTurn: -std::f64::consts::PI..=std::f64::consts::PI, "rad";
    /// Depth down to which a current changes.
    ShearDepth: 0.1..=2000.0, "m";
    /// Radius of a keep-out disc; the range of a snapshot.
    KeepOutRadius: KEEP_OUT_RADIUS, "m";
    /// Largest slant range allowed; the range of a snapshot.
    RangeToKeep: ACOUSTIC_RANGE, "m";
    /// Range of an acoustic modem.
    AcousticRange: 0.01..=20_000.0, "m";
    /// Time from one slot to the next.
    FrameTime: 1.0..=3600.0, "s";
    /// Length of a message, or of its processing.
    MessageTime: 0.001..=30.0, "s";
    /// Speed of sound in water.
    SoundSpeed: 1400.0..=1600.0, "m/s";
    /// Dry mass of a random surface craft.
    CraftMass: random::MASS[0]..=random::MASS[1], "kg";
    /// Design lag of a loop of a random craft.
    TunedLag: random::LAG[0]..=random::LAG[1], "s";
    /// Largest acceleration that the surge loop of a random craft commands.
    TunedAcceleration: random::ACCELERATION[0]..=random::ACCELERATION[1], "m/s²";
    /// Delay of references before they reach the loops.
    CommandDelay: random::DELAY[0]..=random::DELAY[1], "s";
    /// Propulsion energy.
    Energy: 0.0..=1.0e12, "J";
    /// Latitude of the datum.
    Latitude: -90.0..=90.0, "°";
    /// Longitude of the datum.
    Longitude: -180.0..=180.0, "°";
}
