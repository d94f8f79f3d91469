//! What is wrong with a field that came from outside.

/// `name` as a token of a JSON pointer. Source: RFC 6901, section 3.
#[must_use]
pub fn pointer_token(name: &str) -> String {
    name.replace('~', "~0").replace('/', "~1")
}

/// One reason why what was given cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{field}: {reason}")]
pub struct InvalidField {
    /// Where, as slash-separated names that carry units: `auvs/0/state/speed_mps`.
    pub field: String,
    /// What is wrong.
    pub reason: InvalidReason,
}

/// What is wrong with a field.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum InvalidReason {
    /// Not finite, or outside its range.
    #[error("{given} is not in [{least}, {most}]")]
    OutOfRange {
        /// The value.
        given: f64,
        /// Least value accepted.
        least: f64,
        /// Largest value accepted.
        most: f64,
    },
    /// Steps that make too short or too long a horizon, s.
    #[error("the steps add up to {given} s, which is not in [{least}, {most}]")]
    Horizon {
        /// The horizon.
        given: f64,
        /// Shortest accepted.
        least: f64,
        /// Longest accepted.
        most: f64,
    },
    /// A horizon that takes too long to plan.
    #[error("{steps} steps in {iterations} iterations are {}, and at most {most} are accepted", .steps * .iterations)]
    Effort {
        /// Intervals of the horizon.
        steps: usize,
        /// SCP iterations.
        iterations: usize,
        /// Largest product accepted.
        most: usize,
    },
    /// A time that is too far from now, s.
    #[error("{given} is {} s from now and not in [{least}, {most}]", (.given - .now).abs())]
    OffTheClock {
        /// The time.
        given: f64,
        /// Now.
        now: f64,
        /// Earliest time accepted.
        least: f64,
        /// Latest time accepted.
        most: f64,
    },
    /// Too few or too many items or bytes.
    #[error("must have {least} to {most} {unit}, has {given}")]
    Length {
        /// What is counted, such as `points` or `bytes`.
        unit: &'static str,
        /// How many there are.
        given: usize,
        /// Fewest accepted.
        least: usize,
        /// Most accepted.
        most: usize,
    },
    /// A name stands twice.
    #[error("duplicate name {given:?}")]
    Duplicate {
        /// The name.
        given: String,
    },
    /// A name with a character that no screen shows.
    #[error("the name {given:?} has a control character")]
    ControlCharacter {
        /// The name.
        given: String,
    },
    /// A name that no vehicle has.
    #[error("no vehicle is called {given:?}")]
    UnknownVehicle {
        /// The name.
        given: String,
    },
    /// Left out, although a member that belongs with it is given.
    #[error("{detail}")]
    Incomplete {
        /// Which members come together.
        detail: &'static str,
    },
    /// A member that another one excludes.
    #[error("{detail}")]
    Unexpected {
        /// Which members exclude each other.
        detail: &'static str,
    },
    /// A name that no preset has.
    #[error("unknown preset {given:?}; the presets are {}", .known.join(", "))]
    UnknownPreset {
        /// The name.
        given: String,
        /// The names of all presets.
        known: Vec<&'static str>,
    },
    /// Weights of which none is positive.
    #[error("at least one weight must be above 0")]
    AllZero,
    /// A path is needed, and a vehicle has none.
    #[error("{given:?} has no path")]
    NoPath {
        /// Of which vehicle.
        given: String,
    },
    /// A path is needed, and several vehicles that are followed together have none in common.
    #[error("an offset along a path needs a goal that follows one vehicle at a time")]
    NoCommonPath,
    /// Times that do not increase, s, or arc lengths, m.
    #[error("{given} must be greater than the previous value, {before}")]
    NotIncreasing {
        /// The one that is not after the one before it.
        given: f64,
        /// The one before it.
        before: f64,
    },
    /// A covariance by which something would be known better than exactly.
    #[error("not a covariance: its smallest eigenvalue is {given}, and must not be negative")]
    NegativeVariance {
        /// Its least eigenvalue.
        given: f64,
    },
    /// A segment that does not begin where the one before it ends.
    #[error("starts {given} m from where the path is; at most {most} m is allowed")]
    Gap {
        /// How far away it begins, m.
        given: f64,
        /// Farthest accepted, m.
        most: f64,
    },
    /// A path that changes its direction at a point.
    #[error(
        "the direction changes by {given} rad at a point (at most {most} rad): insert an arc, or way-points with room to turn"
    )]
    Kink {
        /// By how much, rad, never negative.
        given: f64,
        /// Most accepted, rad.
        most: f64,
    },
    /// A fillet that its legs have no room for.
    #[error("the legs that meet here have no room for a fillet of {given} m, only for {most} m")]
    Fillet {
        /// Its radius, m.
        given: f64,
        /// Largest radius for which all legs have room, m.
        most: f64,
    },
    /// Way-points that are all at one place, or both ends of a line.
    #[error("{points} are within {within} m; give at least two places")]
    OnePlace {
        /// Which points: `all points` or `both ends`.
        points: &'static str,
        /// How near to the first they all are, m.
        within: f64,
    },
    /// A corner that no convex area has: it turns to the other side than the area does, or the corners before it
    /// have gone round once already.
    #[error("turns by {given} rad: the corners, in order, must go once round a convex area")]
    NotConvex {
        /// By how much it turns, rad, positive to the side to which the area turns.
        given: f64,
    },
    /// A corner on the corner before it, or almost.
    #[error("is {given} m from the corner before it, less than {least} m: give every corner once")]
    TooNear {
        /// How far from it, m.
        given: f64,
        /// Least distance accepted, m.
        least: f64,
    },
    /// An area that is hardly more than a line.
    #[error("the area is only {given} m wide, less than {least} m")]
    TooNarrow {
        /// How wide it is, m.
        given: f64,
        /// Least width accepted, m.
        least: f64,
    },
}
