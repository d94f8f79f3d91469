numbers! {
    /// Numbers of sharing AUVs out among craft, chosen on seeds 1 to 106 of `docs/fleets.md`.
    FleetNumbers {
        /// Mean time for which an AUV without a path is foreseen to keep its course, at most, s:
        /// who serves whom is better decided by where AUVs are than by where they would be.
        straight_most = 60.0,
        /// Share of its cost by which another assignment must be better than the previous one.
        keep_margin = 0.2,
        /// The same right after a change. Without it, 20 flights had 145 changes, with it 35 in 30.
        keep_margin_at_first = 0.5,
        /// Time constant with which the second decays to the first, s.
        settles_in = 120.0,
    }
}
