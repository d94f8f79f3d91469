//! The end of an interval on which something holds, by bisection.

/// The last number from `low` on at which it `holds`, within 2^−`halvings` of the way to `high`.
pub(crate) fn last_at_which(
    holds: impl Fn(f64) -> bool,
    [mut low, mut high]: [f64; 2],
    halvings: u32,
) -> f64 {
    for _ in 0..halvings {
        let middle = 0.5 * (low + high);
        *(if holds(middle) { &mut low } else { &mut high }) = middle;
    }
    low
}
