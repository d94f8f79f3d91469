numbers! {
    /// Numbers of the craft: its learning, the tests for its faults, and its prior.
    ///
    /// False alarms and delays of the tests over whole missions: `docs/evidence.md#random-craft`.
    CraftNumbers {
        /// Time in which an unexcited estimate returns to its prior, s.
        forgetting_time = 1800.0,
        /// Standard deviation of a heading around the loop's prediction, rad: compass and waves.
        heading_noise = 0.04,
        /// Random walk of the heading, rad/√s.
        heading_walk = 0.02,
        /// Standard deviation of an unknown heading offset, rad.
        offset_sigma = 0.1,
        /// Random walk of the heading offset, rad/√s.
        offset_walk = 0.004,
        /// Standard deviation of a speed through the water, m/s: speed log and waves.
        speed_noise = 0.03,
        /// Random walk of the speed, m/s/√s.
        speed_walk = 0.01,
        /// Standard deviation of an unknown surge disturbance, m/s².
        disturbance_sigma = 0.03,
        /// Random walk of a surge disturbance, m/s²/√s. Chosen on random craft: with 0.004 it
        /// follows the residue of a delay, and the speed reference varies 1.2 times as much; with
        /// 0.001 it follows a wound-up integrator late, and some craft are twice as far off.
        disturbance_walk = 0.002,
        /// Standard deviation of a sway through the water, m/s.
        sway_noise = 0.05,
        /// Standard deviation of a position, m, from a GNSS receiver.
        position_noise = 0.7,
        /// Standard deviation of an unknown current along an axis, m/s.
        current_sigma = 0.3,
        /// Random walk of a current, m/s/√s.
        current_walk = 0.002,
        /// Squared innovation, in variances, that is no noise.
        gate = 25.0,
        /// Largest speed offset from a learnt disturbance, m/s; more is assumed a fault.
        speed_offset_believed = 0.05,
        /// Largest crab angle of a craft that holds its course, rad.
        crab_max = 1.0,
        /// Recent turn whose thrust the speed lacks, rad.
        hard_turn = 0.35,
        /// The same as a yaw rate, rad/s, for a craft without way.
        hard_yaw_rate = 0.04,
        /// Largest ratio of a following craft's lead to its reference's motion between two plans.
        lead_max = 2.0,
        /// Least speed for an observation of drift, m/s.
        speed_with_drift = 0.15,
        /// Relative standard deviation of a loop's lag around its approximation by a delay and a
        /// first-order lag. Chosen on random craft with declared step responses: lags are 8 % off
        /// (median), nine in ten under 27 %.
        lag_model_error = 0.15,

        /// Standard deviation of a heading or course from the reference of its loop, rad.
        mode_heading_sigma = 0.25,
        /// Standard deviation of a speed from the reference of its loop, m/s.
        mode_speed_sigma = 0.08,
        /// Weight of a log-likelihood of a mode: errors last for several seconds.
        mode_share = 0.2,

        /// Averaging time of changes in the test for references without effect, s.
        effect_memory = 10.0,
        /// Rate of an opposite expected change, in deviations per second, that restarts the
        /// changes: a craft faster than the slowest reverses sooner.
        effect_reversal = 0.2,
        /// Time in which sufficient evidence fades, s.
        effect_fading_time = 60.0,
        /// Relative error of an expected change, without dead times, overshoot or integrators. It
        /// bounds the evidence per second: a late response to a large step is no fault.
        effect_model_error = 0.5,
        /// Standard deviation of heading changes from noise and waves, rad.
        effect_heading_sigma = 0.04,
        /// Standard deviation of speed changes, m/s. Waves exceed it, but briefly.
        effect_speed_sigma = 0.02,
        /// Share of its rates that is planned with while a loop has no effect: enough that a
        /// recovery shows.
        effect_left = 0.5,

        /// Time constant of the monitor's correction towards measurements, s.
        correction_time = 8.0,
        /// Averaging time of its test, s.
        averaging_time = 15.0,
        /// Standard deviation of a following craft's heading, rad: compass, waves, model.
        following_heading_sigma = 0.12,
        /// Standard deviation of a following craft's speed from its prediction, m/s.
        following_speed_sigma = 0.14,
        /// Relative error of a course loop's crab angle, from errors of current and speed.
        crab_error = 0.5,
        /// Relative error of a predicted turn, and speed lost in a turn, m/s per rad: weak
        /// thrusters serve the turn first. A stuck rudder makes no turn.
        turn_error = 0.15,
        /// Mean square, in variances, above which the craft does not follow.
        alarm = 4.0,
        /// Mean square below which it follows again.
        all_clear = 1.5,
        /// Largest single error, in deviations of a following craft: one wild reading is no trend.
        following_error_max = 6.0,
        /// Factor on the lags of a craft that does not follow.
        cautious_lag = 1.5,
        /// Share of its rates for a craft that does not follow.
        cautious_rate = 0.6,
        /// Least time for which planner or law steers during an alarm, s.
        trial_time = 60.0,
        /// Averaging time of a realised distance, s.
        realised_time = 30.0,
        /// Time in which the distance of the inactive one fades, s.
        trial_memory = 900.0,
        /// Averaging time of squared distances without an alarm, s.
        beside_time = 300.0,
        /// Share of the steering one's squared distance that another one's must be below.
        beside_margin = 0.7,
        /// Least distance to which differences are related, m.
        beside_error = 1.0,
        /// Largest evidence per second.
        beside_gain = 2.0,
        /// Evidence by which another one steers, s.
        beside_evidence = 120.0,

        /// Least speed of a craft that holds a course, as a multiple of the current.
        course_speed_ratio = 1.4,
        /// Largest share of the top speed for this least speed.
        course_speed_share = 0.6,
        /// Largest share of the weaker limit that a disturbance takes in a loop with an
        /// integrator, which unwinds.
        disturbance_share_of_an_integrator = 0.9,
        /// The same without an integrator: a present push, as of thrust used in a turn, is brief.
        disturbance_share = 0.5,

        /// Standard deviation of an undeclared time constant's logarithm: a factor of two.
        lag_sigma = 0.7,
        /// Standard deviation of an undeclared drift in turns, s.
        drift_sigma = 0.7,
        /// Smallest standard deviation of a drift in turns, s.
        drift_sigma_min = 0.05,
        /// Plausible deviation of a time constant in standard deviations: a factor of 4 for an
        /// undeclared one. Beyond it the craft has a fault.
        lag_deviations = 2.0,
        /// Least plausible deviation as a logarithm: a factor of 2.2 for a declared one.
        log_lag_spread_min = 0.8,
        /// Share of its declared rates of the slowest plausible craft.
        slowest_rate_declared = 0.7,
        /// The same for undeclared rates.
        slowest_rate = 0.5,
    }
}
