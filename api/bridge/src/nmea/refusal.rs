//! Why a line gave no measurement, or not all of it was believed.

/// One reason.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Refusal {
    /// Bytes outside any sentence.
    NoSentence,
    /// Longer than any sentence may be.
    TooLong,
    /// Does not end in `*` and two hexadecimal digits: cut short, or never given.
    NoChecksum,
    /// The checksum is of another sentence.
    WrongChecksum,
    /// Bytes that are not printable ASCII.
    NotText,
    /// A kind of sentence that tells nothing we need.
    UnusedSentence,
    /// Headings from magnetic north.
    Magnetic,
    /// The receiver says that it has no fix.
    NoFix,
    /// The sender says that the value is not valid.
    NotValid,
    /// The sender says that the value was entered by hand or simulated, or uses a mode that is not known.
    NotMeasured,
    /// A field that is no decimal number.
    Number,
    /// A number in another unit than the sentence has there.
    Unit,
    /// A number that no craft has.
    Range,
    /// No place on Earth.
    Position,
    /// No time of day.
    Time,
    /// No field of use is filled.
    Empty,
    /// A time of day too far from ours; the measurement is dated by its arrival.
    Clock,
}

impl Refusal {
    /// As it is counted.
    pub(super) fn reason(self) -> &'static str {
        match self {
            Self::NoSentence => "no sentence",
            Self::TooLong => "too long",
            Self::NoChecksum => "no checksum",
            Self::WrongChecksum => "wrong checksum",
            Self::NotText => "not text",
            Self::UnusedSentence => "unused sentence",
            Self::Magnetic => "magnetic",
            Self::NoFix => "no fix",
            Self::NotValid => "not valid",
            Self::NotMeasured => "not measured",
            Self::Number => "number",
            Self::Unit => "unit",
            Self::Range => "range",
            Self::Position => "position",
            Self::Time => "time",
            Self::Empty => "empty",
            Self::Clock => "clock",
        }
    }
}
