numbers! {
    /// Numbers of the forecasts of AUVs.
    ForecastNumbers {
        /// Rate of turn below which a forecast is straight, rad/s: 9° over the default horizon.
        turn_rate_straight = 0.002,
        /// Averaging time of drift, s, as of the current, and the time in which it fades along a
        /// path. Chosen on `slocum`, 0.01 m off instead of 0.37 m, and `faults`: without fading 1.5
        /// times as far off.
        drift_memory = 30.0,
        /// Longest interval between two reports for an estimate of drift, s; vehicles turn.
        drift_between_max = 60.0,
        /// Distance from the expected position at which a vehicle has jumped, m, unless the time
        /// between the reports explains it: it corrected its position, or was confused with
        /// another. Two standard deviations of an acoustic fix (1.5 m).
        drift_jump = 3.0,
        /// Drift that explains a distance, m/s: a strong current in a working area.
        drift_usual = 0.3,
        /// Largest drift along an axis, m/s: an AUV in a stronger one does not return.
        drift_max = 0.5,
        /// Distance of the approach to the steady offset beside a path, m: the course relative to
        /// the path decreases by a factor of e. Chosen on the simulated follower beside a straight
        /// path, 0.1 m/s across: RMS error over 60 s 0.70 m; offset kept: 1.26 m; 1.5 m: 0.80 m; 3
        /// m: 0.59 m, but would lose by errors of a reported course.
        approach_length = 2.0,
        /// Default standard deviation of a position along either axis, m: an acoustic fix's.
        position_sigma = 1.5,
        /// Default standard deviation of a reported velocity along either axis, m/s.
        velocity_sigma = 0.05,
        /// Spectral density of the acceleration of an AUV with unknown plans, along either axis,
        /// m²/s³. Chosen on a lawn-mower: a constant velocity is wrong by 4.4 m RMS after 78 s.
        acceleration_density = 6.0e-5,
        /// Standard deviation of the speed along a known path, as a share of the speed through the
        /// water: accuracy of planned speeds in a current known to 0.02 m/s.
        path_speed_share = 0.1,
        /// Standard deviation of the cross-track offset that a follower acquires, m. Measured: a
        /// current of 0.1 m/s across changes its offset by 0.7 m RMS over 60 s.
        cross_track_sigma = 0.7,
    }
}
