//! A fault of a field that came from outside.

/// `name` as a token of a JSON pointer. Source: RFC 6901, section 3.
#[must_use]
pub fn pointer_token(name: &str) -> String {
    name.replace('~', "~0").replace('/', "~1")
}

/// A field that cannot be used, and one reason.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{field}: {reason}")]
pub struct InvalidField {
    /// Slash-separated names that carry units: `auvs/0/state/speed_mps`.
    pub field: String,
    /// The fault.
    pub reason: InvalidReason,
}

/// The fault of a field.
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
    /// Steps that add up to a horizon out of range, s.
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
        /// Number of SCP iterations.
        iterations: usize,
        /// Largest product accepted.
        most: usize,
    },
    /// A time too far from now, s.
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
        /// The counted unit, such as `points` or `bytes`.
        unit: &'static str,
        /// Number of items.
        given: usize,
        /// Fewest accepted.
        least: usize,
        /// Most accepted.
        most: usize,
    },
    /// A repeated name.
    #[error("duplicate name {given:?}")]
    Duplicate {
        /// The name.
        given: String,
    },
    /// A name with a control character.
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
    /// A missing member that another given member requires.
    #[error("{detail}")]
    Incomplete {
        /// The members that require each other.
        detail: &'static str,
    },
    /// A member that another given member excludes.
    #[error("{detail}")]
    Unexpected {
        /// The members that exclude each other.
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
    /// A vehicle without the path that the request needs.
    #[error("{given:?} has no path")]
    NoPath {
        /// The vehicle.
        given: String,
    },
    /// A path offset for vehicles that are followed together.
    #[error("an offset along a path needs a goal that follows one vehicle at a time")]
    NoCommonPath,
    /// Times, s, or arc lengths, m, that do not increase.
    #[error("{given} must be greater than the previous value, {before}")]
    NotIncreasing {
        /// The value.
        given: f64,
        /// The previous value.
        before: f64,
    },
    /// A covariance with a negative eigenvalue.
    #[error("not a covariance: its smallest eigenvalue is {given}, and must not be negative")]
    NegativeVariance {
        /// Its smallest eigenvalue.
        given: f64,
    },
    /// A segment that does not begin where the previous one ends.
    #[error("starts {given} m from where the path is; at most {most} m is allowed")]
    Gap {
        /// Distance of its beginning, m.
        given: f64,
        /// Largest distance accepted, m.
        most: f64,
    },
    /// A path with a change of direction at a point.
    #[error(
        "the direction changes by {given} rad at a point (at most {most} rad): insert an arc, or way-points with room to turn"
    )]
    Kink {
        /// The change, rad, never negative.
        given: f64,
        /// Largest change accepted, rad.
        most: f64,
    },
    /// A fillet too large for its legs.
    #[error("the legs that meet here have no room for a fillet of {given} m, only for {most} m")]
    Fillet {
        /// Its radius, m.
        given: f64,
        /// Largest radius for which all legs have room, m.
        most: f64,
    },
    /// Way-points, or both ends of a line, at one place.
    #[error("{points} are within {within} m; give at least two places")]
    OnePlace {
        /// The points: `all points` or `both ends`.
        points: &'static str,
        /// Largest distance from the first point, m.
        within: f64,
    },
    /// A corner that no convex area has: it turns to the other side, or beyond a full turn.
    #[error("turns by {given} rad: the corners, in order, must go once round a convex area")]
    NotConvex {
        /// Its turn, rad, positive to the side to which the area turns.
        given: f64,
    },
    /// A corner too near the previous one.
    #[error("is {given} m from the corner before it, less than {least} m: give every corner once")]
    TooNear {
        /// Its distance, m.
        given: f64,
        /// Least distance accepted, m.
        least: f64,
    },
    /// An area that is almost a line.
    #[error("the area is only {given} m wide, less than {least} m")]
    TooNarrow {
        /// Its width, m.
        given: f64,
        /// Least width accepted, m.
        least: f64,
    },
}
