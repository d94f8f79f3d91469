//! The bound against the enumeration of all sequences, and its tightness.

use super::*;

#[test]
fn no_sequence_costs_less_than_the_bound() {
    let mut tighter = 0;
    for seed in 0..90 {
        let n = 1 + seed % 3;
        let far = if seed % 2 == 0 { 150.0 } else { 500.0 };
        let mut request = random(9000 + seed, n, far);
        if seed % 5 == 0 {
            visits(&mut request).dwell_min_s = Some(15.0);
        }
        let fleet = fleet(&request, horizon(&request, if n == 3 { 500.0 } else { 900.0 }));
        let least = enumerated(&fleet, &fleet.start(), None, Fleet::cost);
        let bound = fleet.least_cost();
        assert!(bound <= least * (1.0 + 1e-9), "{seed}: {bound}, {least}");
        tighter += u32::from(fleet.bound(&fleet.start()) < 0.99 * bound);
    }
    // These bounds know that the craft's time is shared.
    assert!(20 < tighter, "{tighter}");
}

#[test]
fn the_gap_for_distant_auvs_at_rest_is_below_a_half() {
    let gap = |seed: usize| {
        let mut request = by_age(random(9500 + seed, 2 + seed % 3, 900.0));
        states(&mut request).for_each(|state| state.speed_mps = 0.0);
        scheduled(&request).gap
    };
    let mut gaps: Vec<_> = (0..40).map(gap).collect();
    gaps.sort_by(f64::total_cmp);
    assert!(gaps[gaps.len() / 2] < 0.5, "{gaps:?}");
}
