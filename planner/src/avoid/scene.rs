//! The craft, its goal and other vessels over the next minutes, in the frame of the present craft.

use nalgebra::{Matrix2, Vector2};

use crate::avoid::encounter::{SPEED_UNDER_WAY, closest_approach};
use crate::coast::land::Land;
use crate::craft::model::CraftModel;
use crate::facts::angle::ned_from_body;
use crate::facts::traffic::EncounterKind;
use crate::predict::goal::GoalForecast;
use crate::predict::motion::Motion;
use crate::predict::vessel::VesselForecast;
use crate::snapshot::build::Snapshot;
use crate::tuned::AvoidNumbers;

/// Steps of a trial.
pub(crate) const STEPS: usize = 150;

/// Most vessels that a trial looks at: those that are first.
const VESSELS_MOST: usize = 16;

/// A vessel in a trial.
#[derive(Clone, Debug)]
pub(crate) struct Other {
    pub(crate) forecast: VesselForecast,
    /// The kind of the encounter, if they would come too near.
    pub(crate) kind: Option<EncounterKind>,
    /// The side of its course on which the craft meant to pass, positive to starboard.
    pub(crate) side: Option<f64>,
    /// The course of the goal, beside which the sides of a vessel at rest are.
    pub(crate) course: Vector2<f64>,
}

/// The situation that all trials share.
#[derive(Clone, Debug)]
pub(crate) struct Scene<'a> {
    pub(crate) tuned: AvoidNumbers,
    /// From the earliest to the latest that may come too near.
    pub(crate) others: Vec<Other>,
    /// The goal now and after each step.
    pub(crate) goal: Vec<Motion>,
    pub(crate) craft: CraftModel,
    pub(crate) speed_now: f64,
    pub(crate) current: Vector2<f64>,
    /// Keep-outs: centre and radius, m.
    pub(crate) discs: Vec<(Vector2<f64>, f64)>,
    /// Corners of the area, clockwise.
    pub(crate) area: Vec<Vector2<f64>>,
    /// No-go areas, if the craft could reach one, with its place and axes among them.
    pub(crate) land: Option<(&'a Land, Vector2<f64>, Matrix2<f64>)>,
}

impl<'a> Scene<'a> {
    /// The scene of `snapshot` with the craft as it is planned; none without a vessel near.
    pub(crate) fn new(snapshot: &'a Snapshot, goal: &GoalForecast, craft: CraftModel) -> Option<Self> {
        let tuned = snapshot.tuned().avoid;
        let turned = ned_from_body(snapshot.asc.heading().radians()).transpose();
        let place = |position: Vector2<f64>| turned * (position - snapshot.asc.position());
        let motion =
            |motion: &Motion| Motion { position: place(motion.position), velocity: turned * motion.velocity };
        let current = turned * snapshot.current();
        let reach = (snapshot.speed_most() + current.norm()) * tuned.look_ahead;
        let course = motion(&goal.at(0.0)).velocity.try_normalize(SPEED_UNDER_WAY);
        // The bow's direction would change sides with each turn about the vessel.
        let course = course.unwrap_or_else(|| Vector2::new(1.0, 0.0));
        let mut others: Vec<_> = VesselForecast::all(snapshot)
            .map(|vessel| vessel.seen_from(motion))
            .filter_map(|forecast| {
                let distance = closest_approach(&forecast.position, &forecast.velocity).0;
                let is_near = forecast.has_plan() || distance - forecast.radius(tuned.look_ahead) < reach;
                let gap = forecast.position.norm() - forecast.radius(0.0) - reach;
                let comes = forecast.has_plan() || gap < forecast.velocity.norm() * tuned.look_ahead;
                // The earliest time at which it could be too near.
                let first = (gap + reach) / (forecast.velocity.norm() + snapshot.speed_most());
                (is_near && comes).then_some((first, Other { forecast, kind: None, side: None, course }))
            })
            .collect();
        let key = |other: &(f64, Other)| (other.0, other.1.forecast.position);
        others.sort_by(|a, b| {
            let ((a, at), (b, bt)) = (key(a), key(b));
            a.total_cmp(&b).then(at.x.total_cmp(&bt.x)).then(at.y.total_cmp(&bt.y))
        });
        others.truncate(VESSELS_MOST);
        if others.is_empty() {
            return None;
        }
        let dt = tuned.look_ahead / STEPS as f64;
        let (land, here) = (snapshot.land(), snapshot.asc.position());
        let shore = land.sides.nearest(&here, reach, |_| true);
        Some(Self {
            land: shore.map(|_| (land, here, turned.transpose())),
            tuned,
            others: others.into_iter().map(|(_, other)| other).collect(),
            goal: (0..=STEPS).map(|k| motion(&goal.at(dt * k as f64))).collect(),
            craft,
            speed_now: snapshot.craft_estimate().surge.x.clamp(0.0, craft.limits.speed_max),
            current,
            discs: snapshot.keep_outs.iter().map(|disc| (place(disc.centre()), disc.radius_m)).collect(),
            area: snapshot.area.iter().map(|corner| place(Vector2::from(*corner))).collect(),
        })
    }

    pub(crate) fn dt(&self) -> f64 {
        self.tuned.look_ahead / STEPS as f64
    }

    /// Velocity over ground at which the craft wants to sail, m/s, or its bow if that is no course.
    /// The present course would tell an encounter by a turn for another one.
    pub(crate) fn course(&self) -> Vector2<f64> {
        let goal = &self.goal[0];
        let wanted = goal.velocity + goal.position * self.tuned.pursuit_rate;
        if wanted.norm() < SPEED_UNDER_WAY {
            return Vector2::new(self.speed_now.max(0.01), 0.0);
        }
        wanted.cap_magnitude(self.craft.limits.speed_max)
    }
}
