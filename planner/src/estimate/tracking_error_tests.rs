//! Forecasts of vehicles that do not keep exactly to the way-points that they mean to follow.

#![expect(
    clippy::disallowed_macros,
    reason = "the planner has no output, its tests print what they measured"
)]

use std::f64::consts::TAU;

use super::{Estimate, tests::Random};
use crate::{
    facts::options::Forecast,
    predict::forecast::{AuvForecast, Intent},
    tests::prelude::*,
};

const SIGMA: f64 = 1.5;
const INTERVAL: usize = 10;
const SPEED: f64 = 1.0;
const AHEAD: usize = 60;
const AHEAD_S: f64 = 60.0;
const FLIGHT: usize = 1800;

/// A vehicle that steers from way-point to way-point.
struct Vehicle {
    name: &'static str,
    /// Distance before a way-point at which the next leg begins, m.
    accept: f64,
    turn_rate: f64,
    /// Amplitude of a weave, m, and its period, s.
    weave: (f64, f64),
}

const VEHICLES: [Vehicle; 5] = [
    Vehicle { name: "exact", accept: 6.0, turn_rate: 0.3, weave: (0.0, 60.0) },
    Vehicle { name: "weaves", accept: 6.0, turn_rate: 0.3, weave: (5.0, 80.0) },
    Vehicle { name: "overshoots", accept: 1.0, turn_rate: 0.1, weave: (0.0, 60.0) },
    Vehicle { name: "cuts corners", accept: 15.0, turn_rate: 0.15, weave: (0.0, 60.0) },
    Vehicle { name: "both", accept: 1.0, turn_rate: 0.08, weave: (4.0, 60.0) },
];

impl Vehicle {
    /// Positions at each second on the legs between `points`, by line of sight.
    fn positions(&self, points: &[Vector2<f64>]) -> Vec<Vector2<f64>> {
        const STEP: f64 = 0.1;
        let (mut position, mut course) = (points[0], angle_of(&(points[1] - points[0])));
        let (mut leg, mut t) = (1, 0.0);
        let mut positions = Vec::new();
        while positions.len() <= FLIGHT + AHEAD {
            positions.push(position);
            for _ in 0..10 {
                let (from, to) = (points[leg - 1], points[leg]);
                let tangent = angle_of(&(to - from));
                if (to - position).dot(&direction(tangent)) < self.accept && leg + 1 < points.len() {
                    leg += 1;
                }
                let (amplitude, period) = self.weave;
                let aim = amplitude * f64::sin(TAU * t / period);
                let beside = (position - from).dot(&starboard(tangent)) - aim;
                let turn = wrap(tangent - (beside / 8.0).atan() - course);
                course += turn.clamp(-self.turn_rate, self.turn_rate) * STEP;
                position += direction(course) * (SPEED * STEP);
                t += STEP;
            }
        }
        positions
    }
}

fn lanes() -> Vec<Vector2<f64>> {
    let lane = |lane: u8| {
        let ends = if lane.is_multiple_of(2) { [0.0, 140.0] } else { [140.0, 0.0] };
        ends.map(|north| Vector2::new(north, 30.0 * f64::from(lane)))
    };
    (0..14).flat_map(lane).collect()
}

fn random_walk() -> Vec<Vector2<f64>> {
    let mut random = Random(77);
    let mut at = Vector2::zeros();
    let step = |_| {
        at += direction(TAU * random.uniform()) * (60.0 + 120.0 * random.uniform());
        at
    };
    (0..30).map(step).collect()
}

/// Root-mean-square error of forecasts a minute ahead, m; share of them inside the 80 % ellipse;
/// share along a route. The vehicle declares its way-points alone, or nothing.
fn a_minute_ahead(vehicle: &Vehicle, points: &[Vector2<f64>], declares: bool) -> [f64; 3] {
    let positions = vehicle.positions(points);
    let waypoints = points.iter().map(|point| (*point).into()).collect();
    let declared = declares.then(|| declared_through(waypoints, None, SPEED));
    let known = declared.as_ref().map(|path| path.known().expect("is a path"));
    let (mut squares, mut inside, mut followed, mut n) = (0.0, 0.0, 0.0, 0.0);
    for seed in [20] {
        let mut random = Random(seed);
        let (mut reports, mut track) = (Vec::new(), Vec::new());
        for (t_s, known_positions) in (0_u32..).zip(positions.windows(AHEAD + 1)).step_by(INTERVAL) {
            let t_s = f64::from(t_s);
            let (now, then) = (known_positions[0], known_positions[AHEAD]);
            reports.push(Report::new(t_s, now + random.normal() * SIGMA, SIGMA));
            let newest = reports[reports.len().saturating_sub(64)..].to_vec();
            let mut auv = Auv::reported("a", newest);
            auv.path.clone_from(&declared);
            let before = (!declares).then_some(&track[..]);
            let found = Estimate::new(&auv, known.as_ref(), t_s, &Vector2::zeros(), None, before, &|| false);
            track.clone_from(&found.track);
            if t_s < 300.0 {
                continue;
            }
            let route = found.route.as_ref().filter(|route| route.is_followed());
            let intent = Intent {
                path: found.path.as_ref().filter(|_| route.is_some()),
                fit: route.map(|route| &route.fit),
                forgets_after: found.forgets_after,
                ..Intent::default()
            };
            let forecast = AuvForecast::new(&found.state, intent, Forecast::Auto, &Vector2::zeros());
            let error = forecast.at(AHEAD_S).position - then;
            let inverse = forecast.position_covariance(AHEAD_S).try_inverse().expect("is positive definite");
            squares += error.norm_squared();
            inside += f64::from(u8::from(error.dot(&(inverse * error)) <= 3.219));
            followed += f64::from(u8::from(route.is_some()));
            n += 1.0;
        }
    }
    [f64::sqrt(squares / n), inside / n, followed / n]
}

/// Prints errors and coverage; the bounds hold for tracks that the numbers were not chosen on.
#[test]
fn vehicles_that_weave_overshoot_or_cut_corners_keep_their_routes() {
    let most = [(3.0, 9.0), (6.0, 8.0), (6.0, 11.0), (5.0, 23.0), (14.0, 24.0)];
    for (vehicle, (most_on_lanes, most_on_walk)) in VEHICLES.iter().zip(most) {
        for (pattern, points, most) in
            [("lanes", lanes(), most_on_lanes), ("way-points", random_walk(), most_on_walk)]
        {
            let [off, inside, followed] = a_minute_ahead(vehicle, &points, true);
            println!("{:12} {pattern:10} {off:5.1} m, {inside:4.2} inside", vehicle.name);
            assert!(0.5 < inside && 0.85 < followed, "{}, {pattern}", vehicle.name);
            assert!(off < most, "{}, {pattern}: {off} m", vehicle.name);
        }
        let [off, inside, _] = a_minute_ahead(vehicle, &lanes(), false);
        println!("{:12} undeclared {off:5.1} m, {inside:4.2} inside", vehicle.name);
        assert!(off < 28.0, "{}, undeclared: {off} m", vehicle.name);
    }
}
