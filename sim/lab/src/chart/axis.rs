//! One axis: where values are drawn, and which of them are named.

/// Values at both ends, and where these are drawn, units.
#[derive(Clone, Copy)]
pub(super) struct Axis {
    values: (f64, f64),
    places: (f64, f64),
}

impl Axis {
    pub(super) fn new(values: (f64, f64), places: (f64, f64)) -> Self {
        Self { values, places }
    }

    /// Where `value` is drawn.
    pub(super) fn at(&self, value: f64) -> f64 {
        let share = (value - self.values.0) / (self.values.1 - self.values.0);
        self.places.0 + share * (self.places.1 - self.places.0)
    }
}

/// Room beyond the outermost values, as a share of what is between them.
const ROOM: f64 = 0.04;
/// Ticks of an axis, about.
const TICKS: f64 = 6.0;

/// The least and the greatest of `values` with some room around them; from 0 to 1 of none.
pub(super) fn range(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
        (low.min(value), high.max(value))
    });
    if low > high {
        return (0.0, 1.0);
    }
    let room = if low == high { 0.5 } else { ROOM * (high - low) };
    (low - room, high + room)
}

/// Widens one of two ranges, so that a unit of both is as long where the plot is `ratio` times as wide as high.
pub(super) fn as_long_up_as_across(across: &mut (f64, f64), up: &mut (f64, f64), ratio: f64) {
    let widen = |range: &mut (f64, f64), length: f64| {
        let middle = f64::midpoint(range.0, range.1);
        *range = (middle - length / 2.0, middle + length / 2.0);
    };
    let (width, height) = (across.1 - across.0, up.1 - up.0);
    if width < ratio * height {
        widen(across, ratio * height);
    } else {
        widen(up, width / ratio);
    }
}

/// Values to be named, with their names: steps of 1, 2 or 5 times a power of ten.
pub(super) fn ticks((low, high): (f64, f64)) -> Vec<(f64, String)> {
    let wanted = (high - low) / TICKS;
    let power = 10_f64.powf(wanted.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].map(|factor| factor * power);
    let step = step.into_iter().find(|step| wanted <= *step).unwrap_or(power);
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "between 0 and 12"
    )]
    let digits = (-step.log10().floor()).clamp(0.0, 12.0) as usize;
    let first = (low / step).ceil();
    (0..=20_u32)
        .map(|k| (first + f64::from(k)) * step)
        .take_while(|value| *value <= high)
        .map(|value| {
            (
                value,
                format!("{:.digits$}", value + 0.0).replace('-', "\u{2212}"),
            )
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_within_the_range_and_named_without_false_digits() {
        let named: Vec<String> = ticks((-0.2, 10.4)).into_iter().map(|(_, name)| name).collect();
        assert_eq!(named, ["0", "2", "4", "6", "8", "10"]);
        let named: Vec<String> = ticks((-0.03, 0.02)).into_iter().map(|(_, name)| name).collect();
        assert_eq!(
            named,
            [
                "\u{2212}0.03",
                "\u{2212}0.02",
                "\u{2212}0.01",
                "0.00",
                "0.01",
                "0.02"
            ]
        );
    }

    #[test]
    fn the_range_of_one_value_and_of_none_has_a_length() {
        assert_eq!(range([2.0].into_iter()), (1.5, 2.5));
        assert_eq!(range(std::iter::empty()), (0.0, 1.0));
    }
}
