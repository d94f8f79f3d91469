//! Units and limits of a scenario's numbers.

use std::ops::RangeInclusive;

use planner::snapshot::{ACOUSTIC_RANGE, ANGLE, CURRENT_MAX, KEEP_OUT_RADIUS, OFFSET_MAX, VESSEL_SEPARATION};

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
    ($($name:ident: $range:expr, $unit:literal;)*) => {$(
        #[doc = concat!("Numbers in `", stringify!($range), "` (", $unit, ").")]
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
    // A tenth of a snapshot's range: no vehicle leaves it in a day at 3 m/s in a current of 3 m/s.
    Coordinate: -1.0e5..=1.0e5, "m";
    Length: 0.01..=1.0e5, "m";
    OffsetComponent: -OFFSET_MAX..=OFFSET_MAX, "m";
    // Depth, positive down. Twice the depth that gliders reach.
    Depth: 0.0..=2000.0, "m";
    // A heading or a change of one, rad.
    Angle: ANGLE, "rad";
    // Pitch of a dive: steep enough to dive, short of the vertical, at which yaw is undefined.
    Pitch: 0.05..=1.3, "rad";
    Speed: 0.0..=5.0, "m/s";
    PathSpeed: 0.05..=3.0, "m/s";
    CurrentComponent: -CURRENT_MAX..=CURRENT_MAX, "m/s";
    MissionTime: 1.0..=86_400.0, "s";
    Instant: 0.0..=86_400.0, "s";
    ClockTime: -86_400.0..=86_400.0, "s";
    Period: 0.0..=3600.0, "s";
    Share: 0.0..=1.0, "";
    SignedShare: -1.0..=1.0, "";
    ClaimFactor: 1.0e-6..=1.0e6, "";
    Factor: 0.0..=2.0, "";
    PositionNoise: 0.0..=1000.0, "m";
    SpeedNoise: 0.0..=0.4, "m/s";
    WaterSpeedNoise: 0.0..=1.0, "m/s";
    AngleNoise: 0.0..=0.5, "rad";
    AngleBias: -1.0..=1.0, "rad";
    RateNoise: 0.0..=0.2, "rad/s";
    DepthNoise: 0.0..=1.0, "m";
    Damping: 0.01..=0.5, "";
    WavePeriod: 1.0..=30.0, "s";
    // Period of a weave: from one that a hull cannot follow to most of a survey's lane.
    WeavePeriod: 5.0..=3600.0, "s";
    // Share of a speed that a vehicle loses without coming to rest.
    LostShare: 0.0..=0.9, "";
    CorrelationTime: 0.1..=1.0e6, "s";
    HalfTurn: -std::f64::consts::PI..=std::f64::consts::PI, "rad";
    ShearDepth: 0.1..=2000.0, "m";
    KeepOutRadius: KEEP_OUT_RADIUS, "m";
    VesselSeparation: VESSEL_SEPARATION, "m";
    VesselLength: 1.0..=500.0, "m";
    // A hydrofoil's.
    VesselSpeed: 0.0..=30.0, "m/s";
    RangeToKeep: ACOUSTIC_RANGE, "m";
    AcousticRange: 0.01..=20_000.0, "m";
    FrameTime: 1.0..=3600.0, "s";
    MessageTime: 0.001..=30.0, "s";
    SoundSpeed: 1400.0..=1600.0, "m/s";
    CraftMass: random::MASS[0]..=random::MASS[1], "kg";
    TunedLag: random::LAG[0]..=random::LAG[1], "s";
    TunedAcceleration: random::ACCELERATION[0]..=random::ACCELERATION[1], "m/s²";
    CommandDelay: random::DELAY[0]..=random::DELAY[1], "s";
    Energy: 0.0..=1.0e12, "J";
    Latitude: -90.0..=90.0, "°";
    Longitude: -180.0..=180.0, "°";
}
