numbers! {
    /// Numbers of visits, beside [`SchedulingParameters`](crate::SchedulingParameters).
    VisitNumbers {
        /// Share of its speed that a craft keeps over a turn: a MEDUSA that reverses at 1.5 m/s and
        /// 0.17 rad/s continues for 7 m of 8.8 m; half of that is assumed. Chosen on `switching`,
        /// cost `age`, seed 1: 27.4 s; with 0.2, 0.5, 0.6 28.2, 27.7, 27.9 s. With more than half,
        /// some AUVs that were said to be passed were not.
        kept_in_turn = 0.4,
        /// Mean time until an AUV turns that has not turned yet, s, beside the time for which it was
        /// seen to go straight on. Chosen on fleets of lanes with states (docs/fleets.md, seeds 101
        /// to 106): visits cost 8 % less at the median than without it.
        first_turn = 200.0,
        /// Weight of the mean cost beside the largest one.
        mean_beside_max = 0.01,
        /// Longest considered time of service, s; later plans may extend it.
        dwell_max = 1200.0,
        /// Least ratio of distinct times of service.
        dwell_ratio = 1.2,
        /// Silence in mean intervals between reports: by chance 1 in 65,000, with half lost.
        silent_intervals = 8.0,
        /// Silence in longest gaps between reports: AUVs that report in bursts pause as long again.
        silent_gaps = 2.0,
        /// Shortest silence, s.
        silence_min = 60.0,
        /// Longest interval between plans that counts as listening, s; outages do not.
        listened_max = 10.0,
        /// Least rise and fall of an unknown dive, m: swell and gauge errors are smaller.
        swing_height_min = 4.0,
        /// Interval of the present rate of that dive, s.
        swing_rate_time = 10.0,
    }
}
