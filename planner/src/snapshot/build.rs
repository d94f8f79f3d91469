//! A checked request with its estimates.

use std::{ops::Deref, sync::Arc};

use nalgebra::Vector2;

use crate::coast::land::Land;
use crate::craft::closed_loop::{Craft, SpeedReference};
use crate::craft::estimate::CraftEstimate;
use crate::craft::learn_by_ekf::CraftObservation;
use crate::craft::model::CraftModel;
use crate::craft::prior::Prior;
use crate::estimate::from_reports::{Before, Estimate, Estimator};
use crate::estimate::repeats::TRACK_POINTS_MAX;
use crate::facts::angle::{Heading, wrap};
use crate::facts::asc::{Asc, AscNow, Limits};
use crate::facts::auv::{Auv, VehicleId};
use crate::facts::bounds::clockwise;
use crate::facts::goal::Goal;
use crate::facts::known_path::KnownPath;
use crate::facts::reference::Reference;
use crate::facts::traffic::Vessel;
use crate::snapshot::check::InvalidRequest;
use crate::snapshot::request::{PlanRequest, REMEMBERED_AGE_MAX};
use crate::tuned::{EstimateNumbers, Tuned};

/// Weight of the sway from the yaw rate, against the measured one, at the start of a plan.
const DRIFT_SHARE: f64 = 0.8;

impl From<&Snapshot> for AscNow {
    fn from(snapshot: &Snapshot) -> Self {
        Self {
            position: snapshot.asc.position(),
            heading: snapshot.asc.heading(),
            current: snapshot.current(),
        }
    }
}

/// A checked [`PlanRequest`] with its defaults and the estimates from it. Every number is finite
/// and in its range, names are unique, and the goal names existing vehicles.
#[derive(Clone, Debug, PartialEq)]
pub struct Snapshot {
    request: PlanRequest,
    limits: Limits,
    /// In the order of the request's AUVs, like the estimates.
    paths: Vec<Option<KnownPath>>,
    estimates: Vec<Estimate>,
    craft_prior: Prior,
    craft_estimate: CraftEstimate,
    craft: CraftModel,
    tuned: Box<Tuned>,
    land: Arc<Land>,
    cut_short: bool,
    of_others: Vec<VehicleId>,
    stands_by: bool,
    least_radius: f64,
}

impl Snapshot {
    /// The snapshot of `request`. Once `due`, estimates use the newest reports alone.
    ///
    /// # Errors
    /// All faults of the request.
    pub fn until(request: PlanRequest, due: &dyn Fn() -> bool) -> Result<Self, InvalidRequest> {
        Self::with(request, &Tuned::DEFAULT, due)
    }

    /// The snapshot of another `request` by the same tuned numbers.
    ///
    /// # Errors
    /// All faults of the request.
    pub fn again(&self, request: PlanRequest) -> Result<Self, InvalidRequest> {
        Self::with(request, &self.tuned, &|| false)
    }

    /// The snapshot of `request` by these tuned numbers.
    ///
    /// # Errors
    /// All faults of the request.
    pub fn with(
        mut request: PlanRequest,
        tuned: &Tuned,
        due: &dyn Fn() -> bool,
    ) -> Result<Self, InvalidRequest> {
        let paths = request.known_paths()?;
        request.place_ranges();
        let current = request.current();
        let numbers = shared_particles(&request, &tuned.estimate);
        let estimator = Estimator { now: request.t_s, current, tuned: &numbers, due };
        let estimate = |(auv, path): (&Auv, &Option<KnownPath>)| {
            let before = request.before(&auv.id);
            // A state shows a turn sooner and better than a pattern foretells it. Only visits look
            // farther ahead: an Otter behind exact states of 0.9 m/s was 0.088 m off, not 0.085.
            let used =
                before.track.filter(|_| auv.state.is_none() || matches!(request.goal.goal, Goal::Visit(_)));
            let mut estimate = estimator.estimate(auv, path.as_ref(), Before { track: used, ..before });
            // A plan that does not need the track of a state still remembers it.
            if let (Some(_), Some(track), []) = (&auv.state, before.track, &estimate.track[..]) {
                estimate.track = track[track.len().saturating_sub(TRACK_POINTS_MAX)..].to_vec();
            }
            estimate
        };
        let estimates = request.auvs.iter().zip(&paths).map(estimate).collect();
        let land = Arc::new(Land::new(&request.no_go));
        Ok(Self::of_estimates(request, (paths, estimates), land, tuned, due()))
    }

    /// The same moment for another craft of the fleet; the AUVs and the no-go areas are shared.
    pub(crate) fn of_other_craft(&self, request: PlanRequest) -> Self {
        let known = (self.paths.clone(), self.estimates.clone());
        Self::of_estimates(request, known, self.shared_land(), &self.tuned, self.cut_short)
    }

    /// The moment for a craft with this `goal`, among further `vessels`, if other craft serve
    /// `of_others`. Its figures have at least that radius, m. Without a goal it stands by.
    pub(crate) fn part(
        &self,
        goal: Option<Goal>,
        vessels: impl Iterator<Item = Vessel>,
        of_others: Vec<VehicleId>,
        least_radius: f64,
    ) -> Self {
        let mut part = Self { of_others, stands_by: goal.is_none(), least_radius, ..self.clone() };
        let first = self.goal.goal.vehicles().next();
        let nothing = first.map(|auv| Goal::Track { auv: auv.clone() });
        part.request.goal.goal = goal.or(nothing).expect("a goal names an AUV");
        part.request.traffic.extend(vessels);
        part
    }

    fn of_estimates(
        mut request: PlanRequest,
        (paths, estimates): (Vec<Option<KnownPath>>, Vec<Estimate>),
        land: Arc<Land>,
        tuned: &Tuned,
        cut_short: bool,
    ) -> Self {
        let corners: Vec<_> = request.area.iter().copied().map(Vector2::from).collect();
        request.area = clockwise(&corners).into_iter().map(Into::into).collect();
        let (limits, craft) = (request.limits(), request.craft());
        let craft_prior = Prior::new(&craft, &tuned.craft);
        (request.limits, request.craft) = (Some(limits.into()), Some(craft));
        let current = request.current();
        let observation = CraftObservation { tuned: &tuned.craft, ..request.craft_observation(&limits) };
        let craft_estimate = CraftEstimate::new(&observation, &craft_prior);
        let craft = CraftModel::learnt(&craft_prior, &craft_estimate, &limits, &current, &tuned.craft);
        Self {
            request,
            limits,
            paths,
            estimates,
            craft_prior,
            craft_estimate,
            craft,
            tuned: Box::new(*tuned),
            land,
            cut_short,
            of_others: Vec::new(),
            stands_by: false,
            least_radius: 0.0,
        }
    }

    /// The same moment for the craft `asc` that follows a heading reference, rad, without a plan.
    pub(crate) fn of_craft(&self, asc: Asc, followed: f64) -> Self {
        let mut other = self.clone();
        (other.craft_estimate.surge.x, other.request.asc) = (asc.speed_mps, asc);
        if let Some(previous) = &mut other.request.previous_plan {
            previous.trajectory.truncate(1);
            if let Some(craft) = &mut previous.craft_estimate {
                craft.asked_heading_rad = followed - self.craft.heading_offset;
            }
        }
        other
    }

    /// `true` if time did not suffice for all estimates.
    pub fn cut_short(&self) -> bool {
        self.cut_short
    }

    /// Least radius of a figure on which other craft localise the same AUVs, too, m.
    pub(crate) fn least_radius(&self) -> f64 {
        self.least_radius
    }

    /// `true` if the craft serves no AUV: its plan is a stop.
    pub fn stands_by(&self) -> bool {
        self.stands_by
    }

    /// `true` if another craft serves the AUV, an index.
    pub(crate) fn is_of_another(&self, auv: usize) -> bool {
        self.of_others.contains(&self.auvs[auv].id)
    }

    pub(crate) fn land(&self) -> &Land {
        &self.land
    }

    pub(crate) fn shared_land(&self) -> Arc<Land> {
        Arc::clone(&self.land)
    }

    /// The no-go area in which a position (north, east), m, is, by index.
    pub fn no_go_at(&self, position: &Vector2<f64>) -> Option<usize> {
        self.land.inside(position).map(|(area, _)| area)
    }

    /// The tuned numbers of its estimates and forecasts.
    pub fn tuned(&self) -> &Tuned {
        &self.tuned
    }

    /// The command that makes the craft move through the water as `reference` says.
    pub fn command(&self, reference: &Reference) -> Reference {
        let (heading_held, speed_held) = self.craft_estimate.modes(&self.craft_prior);
        let craft = Craft { speed_held, heading_held, ..self.craft_prior.craft };
        craft.command(reference, &self.current(), self.limits.speed_max)
    }

    /// `reference` through the water, within the largest speed over ground and the least speed.
    pub(crate) fn within_speed_max(&self, reference: &Reference) -> Reference {
        let (_, speed_held) = self.craft_estimate.modes(&self.craft_prior);
        let speed_max = match speed_held {
            SpeedReference::ThroughWater => self.limits.speed_max,
            SpeedReference::OverGround => {
                let along = self.current().dot(&reference.heading.unit());
                (self.limits.speed_max - along).max(self.limits.speed_min)
            }
        };
        Reference { speed: reference.speed.min(speed_max), ..*reference }
    }

    /// [`Snapshot::command`] behind a slew-rate limit: the heading changes by no more than the
    /// craft can turn, or than `reference` changed. New currents enter at that rate.
    pub(crate) fn slew_limited_command(&self, reference: &Reference) -> Reference {
        let command = self.command(reference);
        let before = self.previous_plan.as_ref().and_then(|previous| {
            let elapsed = self.t_s - previous.made_at()?;
            let young = (0.0..=REMEMBERED_AGE_MAX).contains(&elapsed);
            young.then_some((elapsed, previous.asked()?.heading, previous.command()?.heading))
        });
        let Some((elapsed, reference_before, command_before)) = before else {
            return command;
        };
        let between = |from: Heading, to: Heading| wrap(to.radians() - from.radians());
        let moved = between(reference_before, reference.heading).abs();
        let most = moved.max(self.craft.limits.turn_rate_max * elapsed);
        let step = between(command_before, command.heading);
        if step.abs() <= most {
            return command;
        }
        Reference { heading: Heading::new(command_before.radians() + step.clamp(-most, most)), ..command }
    }

    /// Velocity through the water (ahead, starboard) at the start of a plan, m/s: the filtered
    /// surge, and a mean of the measured sway and that from the yaw rate.
    ///
    /// Waves, the log's noise and the swing of the bow in them end before a plan could react.
    pub fn velocity_now(&self, yaw_rate: f64) -> Vector2<f64> {
        let (surge, sway) = (self.craft_estimate.surge.x, self.asc.sway_mps);
        let drift = -self.craft.sway_per_yaw_rate * surge * yaw_rate;
        Vector2::new(surge, sway + DRIFT_SHARE * (drift - sway))
    }

    /// The declared surface craft, with its uncertainty.
    pub fn craft_prior(&self) -> &Prior {
        &self.craft_prior
    }

    /// The estimate of the surface craft from its motion.
    pub fn craft_estimate(&self) -> &CraftEstimate {
        &self.craft_estimate
    }

    /// The response model of the surface craft.
    pub fn craft_model(&self) -> &CraftModel {
        &self.craft
    }

    /// Limits of the surface craft.
    pub fn limits(&self) -> &Limits {
        &self.limits
    }

    /// Largest speed of the craft through the water, m/s: it may be too fast now.
    pub(crate) fn speed_most(&self) -> f64 {
        self.limits.speed_max.max(self.asc.speed_mps.hypot(self.asc.sway_mps))
    }

    /// The path of each AUV, if known, in the request's order.
    pub fn paths(&self) -> &[Option<KnownPath>] {
        &self.paths
    }

    /// The estimate of every AUV, in the request's order.
    pub fn estimates(&self) -> &[Estimate] {
        &self.estimates
    }

    /// Every AUV in the request's order.
    pub(crate) fn known_auvs(&self) -> impl Iterator<Item = KnownAuv<'_>> {
        let known = self.auvs.iter().zip(&self.paths).zip(&self.estimates);
        known.map(|((auv, path), estimate)| KnownAuv {
            auv,
            path: estimate.path.as_ref().or(path.as_ref()),
            estimate,
        })
    }
}

/// The numbers for `request`, in which all AUVs with ranges share the particles.
fn shared_particles(request: &PlanRequest, tuned: &EstimateNumbers) -> EstimateNumbers {
    let has_range = |auv: &&Auv| auv.reports.iter().flatten().any(|report| report.range_m.is_some());
    let sharing = request.auvs.iter().filter(has_range).count().max(1);
    let most = (tuned.particles_most / sharing as f64).max(tuned.particles_least);
    EstimateNumbers { particles_most: most, ..*tuned }
}

/// An AUV, its declared or repeated path, and its estimate.
#[derive(Clone, Copy, Debug)]
pub(crate) struct KnownAuv<'a> {
    pub(crate) auv: &'a Auv,
    pub(crate) path: Option<&'a KnownPath>,
    pub(crate) estimate: &'a Estimate,
}

impl Deref for Snapshot {
    type Target = PlanRequest;

    fn deref(&self) -> &PlanRequest {
        &self.request
    }
}

impl TryFrom<PlanRequest> for Snapshot {
    type Error = InvalidRequest;

    fn try_from(request: PlanRequest) -> Result<Self, InvalidRequest> {
        Self::until(request, &|| false)
    }
}
