numbers! {
    /// Numbers of the estimates of AUVs.
    EstimateNumbers {
        /// White acceleration along either axis after the last report, m²/s³. Chosen on simulated
        /// lawn-mowers: 1.63 m RMS in half a minute; from 1e-4 to 1e-3, 1.59 to 1.80 m.
        acceleration_density = 2.0e-4,
        /// Standard deviation of a telemetered speed, m/s: a quantised Doppler log or thruster
        /// model, and the speed of a sawtooth around its mean.
        speed_sigma = 0.03,
        /// Standard deviation of a telemetered course, rad: 3°, a micro-mechanical compass under
        /// water and the vehicle's estimate of its drift.
        course_sigma = 0.05,
        /// Largest squared Mahalanobis distance of an accepted measurement of two numbers: the 99.9
        /// % quantile of χ² with two degrees of freedom, −2 ln 0.001.
        gate = 13.815_510_557_964_274,
        /// White acceleration of a straight-moving vehicle along either axis, m²/s³.
        straight_density = 1.5e-4,
        /// Its growth with the speed, m²/s³ per (m/s)². Without it, errors at 3 m/s are 2 to 4
        /// times what the covariance says (`cargo test --lib speed_band -- --nocapture`).
        straight_density_of_speed = 1.0e-4,
        /// Distance over which a manoeuvring vehicle loses its velocity, m: twice the radius of a
        /// usual turn. Mean normalised errors are below 1.1 at 0.05 to 3 m/s; with 10 m up to 6.
        forgetting_length = 20.0,
        /// Mean distance before a manoeuvre, m: lanes of a survey.
        straight_length = 100.0,
        /// Mean length of a manoeuvre, m: half a turn of 10 m radius.
        manoeuvre_length = 30.0,
        /// Least speed in the manoeuvre model, m/s: half of the slowest cruise of known vehicles.
        manoeuvre_speed_min = 0.1,
        /// Largest acceleration towards a telemetered speed, m/s²: to 1 m/s between two fixes.
        acceleration_max = 0.1,

        /// Largest share of fixes outside the gate on a track that fits.
        rejected_max = 0.1,
        /// Largest consistent mean normalised innovation squared of an axis; its expectation is 1.
        normalised_max = 1.5,
        /// Share of fixes that are outliers: multipath in shallow water.
        outlier_share = 0.02,
        /// Scale of outliers along an axis, m.
        outlier_scale = 20.0,
        /// Gain in log-likelihood that an inflation of the accuracies needs: half of what χ²
        /// with one degree of freedom exceeds once in a hundred thousand. Of 14,400 lists of true
        /// claims 6 are doubted.
        inflation_evidence = 10.0,
        /// Deficit of log-likelihood that ends the search for wider inflations, if hardly any fix
        /// is outside the gate. If most are, single fixes decide, and wider ones are undetermined.
        clearly_less = 3.0,
        /// Largest inflation of consistent fixes, as a share of their mean distance. A vehicle that
        /// turns between fixes can resemble one at rest with inaccurate fixes.
        inflation_share = 0.1,
        /// Page's threshold h: fixes are e^h times as likely without the velocities.
        velocity_evidence = 8.0,
        /// Limit on the increments of the second and the third fix: the first may be the outlier,
        /// so two that differ from it contradict no velocity.
        velocity_evidence_at_first = 3.9,
        /// Largest distance of two simultaneous fixes that are one message over two links, m.
        repeated_within = 0.1,

        /// Standard deviation of the velocity along an axis, m/s, if only ranges are known.
        range_speed_sigma = 1.0,
        /// Share of ranges that went a longer way, and of fixes that are outliers beside ranges.
        multipath_share = 0.05,
        /// Mean length of a longer way beyond the direct one, m.
        multipath_length = 20.0,
        /// Most particles of all vehicles with ranges. Against 100,000, errors are 1.02 times as
        /// large; with 3000 1.09 times, and twice as many sure estimates are wrong.
        particles_most = 10_000.0,
        /// Fewest particles of a vehicle, when its place is known.
        particles_least = 1000.0,
        /// Spread of the positions from which on there are most particles, m.
        particles_spread = 40.0,
        /// Largest bend of a ring within the spread of the positions, in standard deviations of a
        /// range, at which a new range is added to what is known instead of filtering all anew:
        /// with 1, twice as many are added, and 3 of 83 sure estimates were lost instead of 1.
        bend_max = 0.3,
        /// Largest share of the variance that is left within two places that are told apart: 0.36
        /// for the halves of one Gaussian, 0.25 of a line, 0.19 of a ring.
        places_within = 0.27,
        /// Root-mean-square spread of the positions from which on the sides of the craft's track are
        /// told apart, m. Chosen on clouds of 100,000 particles (48 flights): 15 to 40 m leave no sure
        /// estimate on the wrong side, 60 m 2.6 %, no such rule 8.7 %.
        sides_from = 30.0,

        /// Standard deviation of the position of a state without a covariance, m: an acoustic fix.
        state_sigma = 1.5,

        /// Largest age of a telemetered rate of turn, s: a third of a lawn-mower's turn. With 30 s,
        /// the forecast a minute ahead is 12 % farther off; with more, a vehicle that falls silent
        /// in a turn would be forecast to circle.
        turn_rate_age_max = 60.0,
        /// Averaging time of a rate of turn that is not reported, s.
        turn_rate_memory = 5.0,
        /// Least significant rate of turn, rad/s: 22° over the default horizon of 78 s.
        turn_rate_min = 0.005,

        /// Distance over which a vehicle off any path forgets its course, m, before any turn was
        /// seen. Without it the craft is 4 to 10 % farther off; from 40 to 100 m, 2 to 6 %.
        forgets_after = 60.0,

        /// Shortest time of a steady turn, s. The four numbers were chosen so that of lanes, boxes,
        /// way-points and figures of eight hardly any piece is one.
        steady_turn_time = 120.0,
        /// Least angle of a steady turn, rad.
        steady_turn_min = 1.8,
        /// Least gain in squared normalised residuals of a steady turn over a straight line.
        steady_turn_gain = 60.0,
        /// Largest misfit of a steady turn, in standard deviations of χ² above its expectation.
        steady_turn_misfit = 1.5,

        /// Probability at the first report that a vehicle follows its path.
        follows_at_first = 0.9,
        /// Mean time until a vehicle leaves its path, s.
        leaves_after = 3600.0,
        /// Mean time until it returns, s.
        returns_after = 600.0,
        /// Least current for the hypothesis of a declared speed over ground, m/s.
        current_min = 0.05,
        /// Spread of the place along the path besides the speed's error, m²/s. The surges of a
        /// sawtooth's reversals, 0.4 m each, two in a cycle of 200 s, make 0.0016.
        along_density = 0.002,
        /// The same per square of the vehicle's speed, s. Chosen on lanes: after 30 s a survey AUV
        /// of 1.8 m/s was 1.6 to 1.7 m from the place of its mean speed.
        pace_time = 0.03,
        /// Standard deviation of the speed along the path, m/s, from an unknown or remote current.
        path_speed_sigma = 0.05,
        /// The same as a share of the declared speed: accuracy of planned speeds.
        path_speed_share = 0.2,
        /// Spread of that difference, (m/s)²/s, between still water and an unknown current.
        pace_density = 1.0e-5,
        /// The spread for vehicles whose speed changes by 0.1 m/s in 100 s. The speed of robot
        /// boats changes by 20 to 40 % within a leg, an AUV's by 4 %.
        pace_density_varied = 1.0e-4,
        /// The same for 0.3 m/s.
        pace_density_uneven = 1.0e-3,
        /// The same for 1 m/s.
        pace_density_erratic = 1.0e-2,
        /// Standard deviation of the velocity across the path, m/s: the offset's spread in 10 s.
        across_sigma = 0.014,
        /// Standard deviation of a telemetered, momentary speed along the path, m/s: half of what a
        /// sawtooth's reversal adds. Without telemetry first errors are a tenth larger.
        telemetry_sigma = 0.05,
        /// Standard deviation of the path's offset along either axis at the first report, m: most
        /// vehicles are some metres off, as in an unknown current. With the three numbers below
        /// chosen on an Otter and a MEDUSA behind lawn-mowers of 0.2 to 0.9 m/s.
        offset_sigma = 2.0,
        /// Spread of that offset along either axis, m²/s.
        offset_density = 0.001,
        /// Standard deviation of the offset by dead reckoning, m: tens of metres after an hour.
        poor_offset_sigma = 20.0,
        /// Its spread, m²/s: a metre in a hundred seconds.
        poor_offset_density = 0.01,
        /// Probability of dead reckoning.
        poor_share = 0.1,
        /// Probability that a vehicle keeps loosely to its path: it weaves by metres, or overshoots
        /// or cuts its corners. This and the next nine were chosen on way-points declared without
        /// radii (`cargo test --lib tracking_error -- --nocapture`, other tracks and seeds).
        loose_share = 0.15,
        /// Probability that it keeps to it roughly.
        rough_share = 0.05,
        /// Standard deviation of a loose vehicle's cross-track error, m.
        loose_sigma = 1.5,
        /// Standard deviation of a rough vehicle's cross-track error, m.
        rough_sigma = 4.0,
        /// Standard deviation of what a corner of 90° adds to a loose vehicle's errors along and
        /// across its path, m. With 6, lanes are covered better and sharp corners worse.
        loose_turn = 4.0,
        /// Standard deviation of what it adds to a rough vehicle's errors, m.
        rough_turn = 12.0,
        /// Standard deviation of the way that a turn takes beyond the path's, m/rad, learnt at each
        /// corner. Without it, lanes with overshot corners are 22 instead of 7.5 m off.
        exact_corner = 0.1,
        /// The same standard deviation for a loose vehicle.
        loose_corner = 3.0,
        /// The same standard deviation for a rough vehicle.
        rough_corner = 6.0,
        /// Share of that way by which a turn carries the vehicle outwards.
        corner_out = 0.8,
        /// Correlation time of the cross-track error, s: a quarter of the period of a weave.
        error_time = 15.0,
        /// Prior probability that a vehicle follows its path backwards.
        backwards = 0.02,
        /// Largest distance of a path from the first report, m: 3 σ of a poor navigation.
        reach = 60.0,
        /// Variance of a telemetered course about the path's, rad²: crab angles and turns.
        course_variance = 0.1,
        /// Density of any course relative to one along the path.
        course_unlike = 0.01,
        /// Least bend that is a turn, rad; fixes of 1.5 m bend a leg twice by up to 0.2 rad.
        turn_least = 0.35,
        /// Standard deviation of the beginning of a turn of unknown radius, s: up to 7 s either
        /// way. Of turns up to 20 s ahead (Otter, seeds 61 to 63) the 50 % interval holds 54
        /// instead of 20 %, the 95 % interval 98 instead of 54 %.
        turn_begins_sigma = 4.0,

        /// Least standard deviation of a fix, m, in a track: vehicles move no straighter.
        fix_sigma_min = 0.7,
        /// Price of a leg, in squared residuals: 4 for its numbers, the rest for its end.
        leg_price = 14.0,
        /// Tolerance of the simplification of a track, in standard deviations of a fix.
        track_tolerance = 0.7,
        /// Least turn of a reversal, rad; its legs do not intersect.
        reversal_min = 2.4,
        /// Sine of the least turn whose legs are intersected.
        bend_sine_min = 0.2,
        /// Relative tolerance of a turn's length against usual speed times elapsed time.
        turn_length_tolerance = 0.35,
        /// Least length of a long leg, in standard deviations of a fix.
        long_leg = 8.0,
        /// The same as a share of the longest leg.
        long_leg_share = 0.2,
        /// Distance between compared points of a track, in standard deviations of a fix.
        spacing = 2.7,
        /// Least change of course of a compared piece, rad: nearly a half turn. At 2.5, 5 of 200
        /// tracks through random way-points had a pattern, at 3.0 at most one.
        piece_turn_min = 3.0,
        /// Least change of course of a pattern, rad; pieces of lines and wide curves are all alike.
        /// One corner is enough: between the two of a turn, a lane ago was between two others.
        lag_turn_min = 1.2,
        /// Largest root-mean-square distance of equal pieces, in standard deviations of a fix.
        residual_max = 2.3,
        /// The same as a share of the radius of gyration; pieces as small as their noise are alike.
        residual_share_max = 0.1,
        /// Fewest repetitions of a pattern. Behind random way-points of a weaving vehicle the craft
        /// is 1.08 times as far off as by the law (worst 1.17), without this 1.11 (1.32).
        times_min = 2.2,
        /// Weight against a pattern that explains the whole track, in repetitions: it may end. With
        /// 0.1 to 0.5, errors of 20 to 60 s differ by less than 1 %.
        pattern_ends = 0.2,

        /// Least height of a detected sawtooth, m: gauge errors and swell are 2.5 % of it.
        sawtooth_height_min = 4.0,
        /// Depth change from an extreme that is a reversal, as a share of the height.
        swing = 0.3,
        /// Largest relative difference of reversal depths (by the height) and of the legs' rates.
        spread_max = 0.1,
        /// Largest root-mean-square bend of a leg, as a share of the height; waves exceed it.
        bent_max = 0.03,
    }
}
