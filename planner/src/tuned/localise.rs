numbers! {
    /// Numbers of goals that localise AUVs.
    LocaliseNumbers {
        /// Least time over which a figure is compared, s.
        horizon = 600.0,
        /// Price of sailing at full speed, as a share of the cost: it pays for its cube.
        energy_price = 0.4,
        /// Share of its cost by which another figure must be better than the previous one.
        keep_margin = 0.04,
        /// The same for a larger, smaller, faster or slower one of its kind.
        adapt_margin = 0.003,
        /// Price of a figure that is always in breach of a bound, as a multiple of its cost.
        breach_price = 10.0,
        /// Standard deviation of an unknown navigation along either axis, m.
        unknown_sigma = 20.0,
        /// Rate at which a rolled-out craft closes the distance to its figure, 1/s.
        pursuit_rate = 0.2,
    }
}
