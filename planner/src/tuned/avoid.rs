numbers! {
    /// Numbers of keeping clear of other vessels.
    AvoidNumbers {
        /// Standard deviation of a vessel's velocity along either axis, m/s, at rest: AIS's step.
        sigma_velocity = 0.05,
        /// Growth of it with the vessel's speed: a course error of half a degree.
        sigma_velocity_share = 0.01,
        /// Standard deviation of the velocity of a vessel whose speed is not known, m/s.
        unknown_speed = 1.5,
        /// Time over which its reported velocities are averaged, s.
        velocity_memory = 60.0,
        /// A velocity that differs from the average by this, m/s, and a share of it is a change.
        velocity_change = 0.4,
        /// That share: 6°.
        velocity_change_share = 0.1,
        /// Most that uncertainty adds to a distance to keep, m.
        growth_max = 50.0,
        /// Time over which a way is sailed ahead, s.
        look_ahead = 300.0,
        /// Share of the distance to keep by which the way must be clear to end a manoeuvre.
        end_margin = 0.1,
        /// Share of the uncertainty of vessels that the present manoeuvre has to leave.
        kept_doubt = 0.3,
        /// Multiple of the time to leave a vessel's way at which a craft that gives way acts.
        early_share = 3.0,
        /// The multiple at which a craft that stands on acts.
        late_share = 2.0,
        /// Standard deviations of its position by which a vessel is passed farther off.
        deviations = 2.0,
        /// Price of a metre too near, m of distance from the goal.
        depth_price = 100.0,
        /// Price of a pass on the wrong side, m of distance from the goal.
        side_price = 300.0,
        /// Price of a pass on another side than was meant, m of distance from the goal.
        other_side_price = 200.0,
        /// Price of another manoeuvre than the present one, m of distance from the goal.
        change_price = 10.0,
        /// Rate at which a rolled-out craft closes the distance to its goal, 1/s.
        pursuit_rate = 0.2,
    }
}
