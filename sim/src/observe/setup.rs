//! What the numbers of a sensor's or a modem's setup may be.

use std::ops::RangeInclusive;

/// Why a setup describes no sensor or modem.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum InvalidSetup {
    /// A number that is not finite, or outside its range.
    #[error("{field}: {given} is not in [{least}, {most}]")]
    OutOfRange {
        /// Where, as slash-separated names that carry units: `acoustics/frame_s`.
        field: String,
        /// The number.
        given: f64,
        /// Least number accepted.
        least: f64,
        /// Largest number accepted.
        most: f64,
    },
    /// Not one slot for each underwater vehicle.
    #[error("{field}: has {given} slots for {vehicles} vehicles")]
    SlotCount {
        /// Where.
        field: &'static str,
        /// How many slots there are.
        given: usize,
        /// How many vehicles.
        vehicles: usize,
    },
}

/// `given`, if it is in `range`; never, if it is NaN.
pub(super) fn within(field: &str, given: f64, range: RangeInclusive<f64>) -> Result<(), InvalidSetup> {
    if range.contains(&given) {
        return Ok(());
    }
    let (least, most) = range.into_inner();
    Err(InvalidSetup::OutOfRange {
        field: field.to_owned(),
        given,
        least,
        most,
    })
}
