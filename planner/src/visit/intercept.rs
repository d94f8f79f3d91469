//! Earliest arrival of the craft near a moving AUV.

use nalgebra::Vector2;

use crate::estimate::legs::PastWork;
use crate::facts::angle::{angle_of, wrap};
use crate::facts::options::ForecastModel;
use crate::predict::forecast::AuvForecast;
use crate::predict::motion::Motion;

/// Samples of a track: at two hours they are 40 s apart, in which an AUV moves a few craft lengths.
const SAMPLES: usize = 180;

/// Tolerance of an arrival, as time, s.
const ARRIVED: f64 = 1e-3;

/// Sampled forecast of an AUV. Positions are relative to the present craft, (ahead, starboard), m.
#[derive(Clone, Debug)]
pub(crate) struct SampledTrack {
    /// Interval of the samples, s.
    step: f64,
    positions: Vec<Vector2<f64>>,
    depths: Vec<f64>,
    /// Largest speed through the water, m/s.
    pub(crate) fastest: f64,
}

impl SampledTrack {
    /// The forecast of an AUV until `horizon`, s, in the craft's `frame`, in a `current` of that
    /// frame, m/s, at its `depth`, m. Without a path, its `past` work predicts turns into random
    /// directions, and that it stays in its area; p̄ is the forecast if that forgets its course.
    ///
    /// ```text
    /// p(t) = p̄(t) + (1 − e^(−t/T)) (c − p̄(t))      p̄(t) = p + v τ (1 − e^(−t/τ))
    /// ```
    pub(crate) fn new(
        forecast: &AuvForecast,
        PastWork { between_turns: tau, area }: PastWork,
        horizon: f64,
        current: &Vector2<f64>,
        frame: impl Fn(&Motion) -> Vector2<f64>,
        depth: impl Fn(f64) -> f64,
    ) -> Self {
        let forecast = forecast.likeliest();
        let step = horizon / SAMPLES as f64;
        let times = || (0..=SAMPLES).map(|i| i as f64 * step);
        // A forecast that forgets its course is such a mean already.
        let foreseen = |time: f64| {
            let straight = forecast.at(time);
            if time <= 0.0 || matches!(forecast.model, ForecastModel::Path | ForecastModel::Hold) {
                return frame(&straight);
            }
            let here = forecast.at(0.0);
            let left = if forecast.forgets() { 1.0 } else { tau / time * -(-time / tau).exp_m1() };
            let mut position = here.position + (straight.position - here.position) * left;
            if let Some((centre, returns_in)) = area {
                position += (centre - position) * -(-time / returns_in).exp_m1();
            }
            frame(&Motion { position, ..straight })
        };
        let positions: Vec<_> = times().map(foreseen).collect();
        let velocities = positions.windows(2).map(|pair| (pair[1] - pair[0]) / step);
        let fastest = velocities.map(|velocity| (velocity - current).norm());
        Self { step, fastest: fastest.fold(0.0, f64::max), depths: times().map(depth).collect(), positions }
    }

    /// Position at a time within the horizon, s after now: linear between samples.
    pub(crate) fn at(&self, time: f64) -> Vector2<f64> {
        let (before, share) = self.place(time);
        let from = self.positions[before];
        from + (self.positions[before + 1] - from) * share
    }

    /// The straight piece of the track after a time.
    fn piece(&self, time: f64) -> TrackPiece {
        let (before, _) = self.place(time);
        let last = before + 2 == self.positions.len();
        let end = (before + 1) as f64 * self.step;
        TrackPiece {
            end: if last { f64::INFINITY } else { end },
            velocity: (self.positions[before + 1] - self.positions[before]) / self.step,
        }
    }

    pub(crate) fn depth_at(&self, time: f64) -> f64 {
        let (before, share) = self.place(time);
        let from = self.depths[before];
        from + (self.depths[before + 1] - from) * share
    }

    pub(crate) fn shallowest(&self) -> f64 {
        self.depths.iter().copied().fold(f64::INFINITY, f64::min)
    }

    /// Least distance from `other`, a track of equal samples, m: both are straight between samples.
    pub(crate) fn nearest(&self, other: &Self) -> f64 {
        let apart = self.positions.iter().zip(&other.positions).map(|(a, b)| a - b);
        let apart: Vec<_> = apart.collect();
        let nearest = |pair: &[Vector2<f64>]| {
            let along = pair[1] - pair[0];
            let share = -pair[0].dot(&along) / along.norm_squared().max(f64::MIN_POSITIVE);
            (pair[0] + along * share.clamp(0.0, 1.0)).norm()
        };
        apart.windows(2).map(nearest).fold(f64::INFINITY, f64::min)
    }

    #[expect(clippy::cast_possible_truncation, reason = "clamped to the samples")]
    fn place(&self, time: f64) -> (usize, f64) {
        let along = (time / self.step).max(0.0);
        let before = (along as usize).min(self.positions.len() - 2);
        (before, (along - before as f64).min(1.0))
    }
}

/// A straight piece of a track.
struct TrackPiece {
    /// End, s after now.
    end: f64,
    velocity: Vector2<f64>,
}

/// Motion of the craft.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Craft {
    /// Largest speed through the water, m/s.
    pub(crate) speed: f64,
    pub(crate) turn_rate: f64,
    /// Current, in the craft's present frame, m/s.
    pub(crate) current: Vector2<f64>,
}

/// The craft at departure.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Departure {
    /// Time, s after now.
    pub(crate) time: f64,
    pub(crate) position: Vector2<f64>,
    /// Heading, rad, in the craft's present frame.
    pub(crate) heading: f64,
    /// Length of the way round no-go areas beyond the straight line's, m; infinite without a way.
    pub(crate) detour: f64,
}

/// The craft at arrival.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Arrival {
    /// Time, s after now.
    pub(crate) time: f64,
    /// Heading, rad, in the craft's present frame.
    pub(crate) heading: f64,
    /// Duration of the turn before departure, s.
    pub(crate) turning: f64,
}

impl Craft {
    /// The earliest time until `end`, s after now, at which the craft can be within `within`.
    ///
    /// ```text
    /// f(t) = ‖p(t) − p₀ − v_c (t − t₀)‖ − within − u max(0, t − t₀ − τ) ≤ 0
    /// ```
    /// with the time τ of a turn. f changes no faster than u plus the AUV's speed, so a step of f
    /// over that passes no root. Between two samples, f = 0 is quadratic.
    pub(crate) fn reach(&self, track: &SampledTrack, from: &Departure, within: f64, end: f64) -> Option<f64> {
        self.reach_after(track, from, (from.time, 0.0), within, end)
    }

    /// The same for a craft that first turns on the spot to the meeting point, and sails a detour.
    pub(crate) fn arrive(
        &self,
        track: &SampledTrack,
        from: &Departure,
        within: f64,
        end: f64,
    ) -> Option<Arrival> {
        let direct = self.reach(track, from, within, end)?;
        let bearing = |time: f64| angle_of(&self.way(track, from, time));
        if direct <= from.time {
            return Some(Arrival { time: from.time, heading: from.heading, turning: 0.0 });
        }
        if from.detour.is_infinite() {
            return None;
        }
        let turning = wrap(bearing(direct) - from.heading).abs() / self.turn_rate;
        let later = turning + from.detour / self.speed;
        let time = self.reach_after(track, from, (direct, later), within, end)?;
        let heading = bearing(time);
        Some(Arrival { time, heading, turning: turning.min(time - from.time) })
    }

    /// Displacement through the water to the AUV's position at `time`, m.
    fn way(&self, track: &SampledTrack, from: &Departure, time: f64) -> Vector2<f64> {
        track.at(time) - from.position - self.current * (time - from.time)
    }

    /// The earliest time from `start`, before any root, for a craft that turns for `turning` s.
    fn reach_after(
        &self,
        track: &SampledTrack,
        from: &Departure,
        (start, turning): (f64, f64),
        within: f64,
        end: f64,
    ) -> Option<f64> {
        let closing = self.speed + track.fastest;
        let turned = from.time + turning;
        let mut time = start;
        while time <= end {
            let speed = if time < turned { 0.0 } else { self.speed };
            let near = within + speed * (time - turned);
            let (way, piece) = (self.way(track, from, time), track.piece(time));
            let missing = way.norm() - near;
            if missing <= self.speed * ARRIVED {
                return Some(time);
            }
            // ‖way + v s‖ = near + speed s, for the least s > 0.
            let velocity = piece.velocity - self.current;
            let a = velocity.norm_squared() - speed * speed;
            let b = way.dot(&velocity) - near * speed;
            let c = way.norm_squared() - near * near;
            let root = time + c / ((b * b - a * c).sqrt() - b);
            let straight = if speed > 0.0 { piece.end } else { piece.end.min(turned) };
            if time <= root && root <= straight.min(end) {
                return Some(root);
            }
            time = straight.max(time + missing / closing);
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{facts::options::Forecast, predict::forecast::Intent, tests::prelude::*};

    const STILL: Vector2<f64> = Vector2::new(0.0, 0.0);

    const HORIZON: f64 = 1800.0;
    const WITHIN: f64 = 20.0;

    fn forecast(north: f64, east: f64, course: f64, speed: f64, turn_rate: f64) -> AuvForecast {
        let state = AuvState { turn_rate_radps: turn_rate, ..moving(north, east, 8.0, course, speed) };
        AuvForecast::new(&state, Intent::default(), Forecast::ConstantTurn, &STILL)
    }

    /// Never turns, all but.
    const STRAIGHT: PastWork = PastWork { between_turns: 1e15, area: None };

    fn track(auv: &AuvForecast, past: PastWork, current: &Vector2<f64>) -> SampledTrack {
        let position = |motion: &Motion| motion.position;
        SampledTrack::new(auv, past, HORIZON, current, position, |_| 8.0)
    }

    /// Time at which a craft in still water is near enough after its turn.
    fn arrival(auv: &AuvForecast) -> Option<f64> {
        let arrival = craft(STILL).arrive(&track(auv, STRAIGHT, &STILL), &HERE, WITHIN, HORIZON);
        arrival.map(|arrival| arrival.time)
    }

    /// Time at which a craft on a constant heading in still water is near enough.
    fn reached(auv: &AuvForecast) -> Option<f64> {
        craft(STILL).reach(&track(auv, STRAIGHT, &STILL), &HERE, WITHIN, HORIZON)
    }

    fn craft(current: Vector2<f64>) -> Craft {
        Craft { speed: 1.5, turn_rate: 0.17, current }
    }

    const HERE: Departure =
        Departure { time: 0.0, position: Vector2::new(0.0, 0.0), heading: 0.0, detour: 0.0 };

    /// The earliest time, in steps of 0.05 s, at which a constant heading is near enough.
    fn scanned(craft: &Craft, auv: &AuvForecast, turns: bool) -> Option<f64> {
        let near = |time: f64| {
            let way = auv.at(time).position - craft.current * time;
            let turning = if turns { angle_of(&way).abs() / craft.turn_rate } else { 0.0 };
            way.norm() - WITHIN <= craft.speed * (time - turning).max(0.0)
        };
        (0..=36_000).map(|i| 0.05 * f64::from(i)).find(|time| near(*time))
    }

    #[test]
    fn the_earliest_arrival_agrees_with_a_dense_scan_in_any_current() {
        let mut n_reached = 0;
        for current in [[0.0, 0.0], [0.3, -0.4], [-0.5, 0.1], [0.0, 1.2]].map(Vector2::from) {
            for k in 0..24 {
                let angle = 0.26 * f64::from(k) + 0.3 * current.x;
                let place = direction(angle) * (15.0 + 60.0 * f64::from(k));
                let auv = forecast(place.x, place.y, 2.0 - angle, 0.1 * f64::from(k % 7), 0.0);
                let (track, craft) = (track(&auv, STRAIGHT, &current), craft(current));
                let found = craft.reach(&track, &HERE, WITHIN, HORIZON);
                let expected = scanned(&craft, &auv, false);
                assert_eq!(found.is_some(), expected.is_some(), "{current} {k}");
                if let (Some(found), Some(expected)) = (found, expected) {
                    near(found, expected, 0.06);
                    n_reached += 1;
                }
                let turned = craft.arrive(&track, &HERE, WITHIN, HORIZON);
                if let (Some(turned), Some(expected)) = (turned, scanned(&craft, &auv, true)) {
                    // The scan turns to the meeting point; the solver's guess misses half a turn.
                    near(turned.time, expected, 2.0);
                }
            }
        }
        assert!(60 < n_reached, "{n_reached} of 96 were reached");
    }

    #[test]
    fn sampling_does_not_change_the_arrival_at_a_turning_vehicle() {
        for turn_rate in [-0.02, 0.004, 0.01] {
            let auv = forecast(400.0, -250.0, 1.0, 0.4, turn_rate);
            let expected = scanned(&craft(STILL), &auv, false).expect("is met");
            // 10 s at 0.4 m/s along a circle of 20 m: the chord is 0.1 m inside.
            near(reached(&auv).expect("is met"), expected, 0.15);
        }
    }

    #[test]
    fn the_arrival_at_an_equally_fast_vehicle_agrees_with_a_scan() {
        let (mut met, mut lost) = (0, 0);
        for turn_rate in [0.0, 0.0005, 0.001, 0.002, 0.004] {
            let auv = forecast(25.0, 0.0, 0.0, 1.5, turn_rate);
            match (reached(&auv), scanned(&craft(STILL), &auv, false)) {
                (Some(found), Some(expected)) => {
                    near(found, expected, 1.0);
                    met += 1;
                }
                (None, None) => lost += 1,
                other => panic!("{turn_rate} rad/s: {other:?}"),
            }
        }
        assert!(0 < met && 0 < lost, "{met} met, {lost} not");
    }

    #[test]
    fn a_faster_departing_auv_is_not_reached_and_a_near_one_is_reached_now() {
        assert_eq!(arrival(&forecast(300.0, 0.0, 0.0, 1.6, 0.0)), None);
        assert_eq!(arrival(&forecast(12.0, -9.0, 0.0, 1.6, 0.0)), Some(0.0));
        // Astern, at rest: half a turn at 0.17 rad/s, then 280 m at 1.5 m/s.
        let astern = arrival(&forecast(-300.0, 0.0, 0.0, 0.0, 0.0)).expect("is reached");
        near(astern, std::f64::consts::PI / 0.17 + 280.0 / 1.5, 0.01);
    }

    #[test]
    fn an_auv_just_left_is_reached_again_after_a_turn() {
        for outside in [0.002, 0.01, 0.1, 0.5] {
            let again = arrival(&forecast(-WITHIN - outside, 0.0, 0.0, 0.0, 0.0));
            let late = again.expect("is reached") - std::f64::consts::PI / 0.17 - outside / 1.5;
            assert!((-2.0 * ARRIVED..0.4).contains(&late), "{outside} m outside: {late} s");
        }
    }

    #[test]
    fn the_forecast_of_an_auv_that_turns_is_the_mean_of_random_turns() {
        let auv = forecast(0.0, 0.0, 0.0, 0.5, 0.0);
        let past = PastWork { between_turns: 120.0, area: None };
        let [straight, turning] = [STRAIGHT, past].map(|past| track(&auv, past, &STILL));
        for until in [10, 120, 1700] {
            // Mean of tracks whose legs end at random, each second with a probability of 1/120.
            let each = (0..until).map(|t| 0.5 * (1.0_f64 - 1.0 / 120.0).powf(f64::from(t)));
            let place = turning.at(f64::from(until));
            near(place.x, each.sum(), 0.5);
            near(place.y, 0.0, 1e-9);
        }
        near(straight.at(1700.0).x, 850.0, 1e-6);
    }

    #[test]
    fn an_auv_at_rest_is_expected_where_it_is() {
        let corner = |k: u32| [400.0 * f64::from(k), 200.0 * f64::from(k % 2), 0.0];
        let past = PastWork::of(&(0..9).map(corner).collect::<Vec<_>>(), &STILL, 200.0);
        assert!(past.area.is_some());
        let state = moving(150.0, 0.0, 8.0, 0.0, 0.0);
        let auv = AuvForecast::new(&state, Intent::default(), Forecast::Auto, &STILL);
        near(track(&auv, past, &STILL).at(1700.0).x, 150.0, 1e-9);
    }

    #[test]
    fn an_auv_that_works_in_an_area_is_expected_in_its_middle() {
        // Eight legs of 200 m at 0.5 m/s, back and forth.
        let corner = |k: u32| [400.0 * f64::from(k), 200.0 * f64::from(k % 2), 0.0];
        let past = PastWork::of(&(0..9).map(corner).collect::<Vec<_>>(), &STILL, 200.0);
        let auv = forecast(150.0, 0.0, 0.0, 0.5, 0.0);
        let (here, later) = (track(&auv, past, &STILL).at(0.0), track(&auv, past, &STILL).at(1800.0));
        near(here.x, 150.0, 1e-9);
        near(later.x, 100.0, 10.0);
        // On a long way with bends it is not.
        let corner = |k: u32| [400.0 * f64::from(k), 150.0 * f64::from(k), 100.0 * f64::from(k % 2)];
        let past = PastWork::of(&(0..9).map(corner).collect::<Vec<_>>(), &STILL, 200.0);
        assert!(past.area.is_none());
    }
}
