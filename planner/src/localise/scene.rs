//! The AUVs and the craft over the time of a trial, in the frame of the present craft.

use std::sync::Arc;

use nalgebra::{Matrix2, Vector2};

use crate::coast::land::Land;
use crate::coast::way::{Search, length};
use crate::facts::angle::{direction, ned_from_body};
use crate::facts::evidence::SPEED_AT_REST;
use crate::facts::localise::Localise;
use crate::facts::visit::{Fixes, Reduce};
use crate::predict::forecast::AuvForecast;
use crate::snapshot::build::Snapshot;
use crate::tuned::LocaliseNumbers;

/// Measurements of an AUV in a trial: more frequent ones count as one of less noise.
pub(crate) const MEASUREMENTS: usize = 60;

/// Longest time of a trial, s.
const HORIZON_MAX: f64 = 7200.0;

/// An AUV in a trial.
#[derive(Clone, Debug)]
pub(crate) struct Member {
    pub(crate) auv: usize,
    /// Weight of its variance; the sum over all is 1.
    pub(crate) share: f64,
    /// Covariance of its own navigation now, m².
    pub(crate) covariance: Matrix2<f64>,
    /// `true` if that was given or estimated.
    pub(crate) is_known: bool,
    /// Its position, m, and depth, m, now and at each measurement.
    pub(crate) track: Vec<(Vector2<f64>, f64)>,
}

/// The situation that all trials share.
#[derive(Clone, Debug)]
pub(crate) struct Scene {
    pub(crate) tuned: LocaliseNumbers,
    pub(crate) fixes: Fixes,
    pub(crate) reduce: Reduce,
    /// Variance of a measurement at range 0, m², and its growth, rad².
    pub(crate) noise: [f64; 2],
    /// Growth of a variance, m²/s.
    pub(crate) growth: f64,
    pub(crate) interval: f64,
    pub(crate) stand_off: f64,
    pub(crate) range_max: f64,
    /// Least size of a figure that has room for other craft, and largest of any, m.
    pub(crate) least_radius: f64,
    pub(crate) radius_max: f64,
    /// From starboard to port, independent of names and order.
    pub(crate) members: Vec<Member>,
    /// Weighted mean of the members now and at each measurement, m.
    pub(crate) mean: Vec<Vector2<f64>>,
    /// Largest and present speed of the craft through the water, m/s.
    pub(crate) speed: f64,
    pub(crate) speed_now: f64,
    pub(crate) turn_rate: f64,
    pub(crate) current: Vector2<f64>,
    /// Keep-outs: centre and radius, m.
    pub(crate) discs: Vec<(Vector2<f64>, f64)>,
    /// Corners of the way round no-go areas to the members on the mean, m; none if straight.
    pub(crate) corners: Vec<Vector2<f64>>,
    /// No-go areas, and the present craft's place and axes among them.
    pub(crate) land: (Arc<Land>, Vector2<f64>, Matrix2<f64>),
    /// Corners of the area, clockwise.
    pub(crate) area: Vec<Vector2<f64>>,
}

impl Scene {
    /// The scene of `snapshot` with these `auvs` and a craft of this speed and turn rate, if any.
    pub(crate) fn new(
        snapshot: &Snapshot,
        localise: &Localise,
        forecasts: &[AuvForecast],
        auvs: &[usize],
        (speed, turn_rate): (f64, f64),
        ways: &Search<'_>,
    ) -> Option<Self> {
        let tuned = snapshot.tuned().localise;
        let craft_from_ned = ned_from_body(snapshot.asc.heading().radians()).transpose();
        let place = |position: Vector2<f64>| craft_from_ned * (position - snapshot.asc.position());
        let at = |auv: usize, time: f64| place(forecasts[auv].at(time).position);
        let sum: f64 = auvs.iter().map(|auv| localise.weight(&snapshot.auvs[*auv].id)).sum();
        let share = |auv: usize| localise.weight(&snapshot.auvs[auv].id) / sum;
        let mean_now = auvs.iter().map(|auv| forecasts[*auv].at(0.0).position * share(*auv)).sum();
        let way = if ways.land.is_empty() { None } else { ways.between(&snapshot.asc.position(), &mean_now) };
        let way = way.unwrap_or_default();
        let farthest = auvs.iter().map(|auv| at(*auv, 0.0).norm()).fold(length(&way), f64::max);
        let horizon =
            (tuned.horizon.max(10.0 * localise.interval_s).max(3.0 * farthest / speed)).min(HORIZON_MAX);
        let interval = horizon / MEASUREMENTS as f64;
        let member = |auv: usize| {
            let (id, state) = (&snapshot.auvs[auv].id, &snapshot.estimates()[auv].state);
            let given = localise.costs_now.get(id).map(|cost| Matrix2::identity() * (0.5 * cost));
            let estimated = || {
                let block = state.covariance()?.fixed_view::<2, 2>(0, 0).into_owned();
                let grown =
                    Matrix2::identity() * (localise.growth_m2ps * state.age_s.clamp(0.0, HORIZON_MAX));
                Some(craft_from_ned * (block + grown) * craft_from_ned.transpose())
            };
            let known = given.or_else(estimated);
            let time = |k: usize| interval * k as f64;
            Member {
                auv,
                share: share(auv),
                covariance: known.unwrap_or_else(|| Matrix2::identity() * tuned.unknown_sigma.powi(2)),
                is_known: known.is_some(),
                track: (0..=MEASUREMENTS)
                    .map(|k| (at(auv, time(k)), forecasts[auv].depth_at(time(k))))
                    .collect(),
            }
        };
        let mut members: Vec<_> = auvs.iter().map(|auv| member(*auv)).collect();
        let key = |member: &Member| member.track[0].0;
        members.sort_by(|a, b| key(b).y.total_cmp(&key(a).y).then(key(b).x.total_cmp(&key(a).x)));
        let mean =
            (0..=MEASUREMENTS).map(|k| members.iter().map(|member| member.track[k].0 * member.share).sum());
        let mean = mean.collect();
        // Frequent measurements are one of less noise, rare ones of more.
        let merged = localise.interval_s / interval;
        let usbl = match localise.fixes {
            Fixes::Range => 0.0,
            Fixes::Usbl => localise.sigma_rad.powi(2),
        };
        (!members.is_empty()).then(|| Self {
            tuned,
            fixes: localise.fixes,
            reduce: localise.reduce,
            noise: [localise.sigma_m.powi(2) * merged, usbl * merged],
            growth: localise.growth_m2ps,
            interval,
            stand_off: localise.stand_off_m,
            range_max: snapshot.range_max().unwrap_or(f64::INFINITY),
            least_radius: snapshot.least_radius(),
            radius_max: f64::INFINITY,
            mean,
            speed,
            speed_now: snapshot.asc.speed_mps.clamp(0.0, speed),
            turn_rate,
            current: craft_from_ned * snapshot.current(),
            discs: snapshot.keep_outs.iter().map(|disc| (place(disc.centre()), disc.radius_m)).collect(),
            corners: way.iter().skip(1).rev().skip(1).rev().map(|corner| place(*corner)).collect(),
            land: (snapshot.shared_land(), snapshot.asc.position(), craft_from_ned.transpose()),
            area: snapshot.area.iter().map(|corner| place((*corner).into())).collect(),
            members,
        })
    }

    /// The mean of the members at `time`, s, and its velocity, m/s.
    pub(crate) fn mean_at(&self, time: f64) -> (Vector2<f64>, Vector2<f64>) {
        let place = (time / self.interval).clamp(0.0, MEASUREMENTS as f64 - 1e-9);
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "from 0 to less than MEASUREMENTS"
        )]
        let (k, share) = (place as usize, place.fract());
        let step = self.mean[k + 1] - self.mean[k];
        (self.mean[k] + step * share, step / self.interval)
    }

    /// Direction of the members' mean motion now; none at rest.
    pub(crate) fn course(&self) -> Option<f64> {
        let (_, velocity) = self.mean_at(0.0);
        (SPEED_AT_REST <= velocity.norm()).then(|| velocity.y.atan2(velocity.x))
    }

    /// Direction of the members' line, and their rms distance along it, m; none for one member.
    pub(crate) fn line(&self) -> Option<(f64, f64)> {
        let scatter: Matrix2<f64> = self
            .members
            .iter()
            .map(|member| {
                let off = member.track[0].0 - self.mean[0];
                off * off.transpose() * member.share
            })
            .sum();
        let angle = 0.5 * (2.0 * scatter.m12).atan2(scatter.m11 - scatter.m22);
        let along = direction(angle);
        let spread = along.dot(&(scatter * along)).max(0.0).sqrt();
        (1.0 < spread).then_some((angle, spread))
    }
}
