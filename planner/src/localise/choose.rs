//! The selected figure: the best, unless the previous one is almost as good.

use std::f64::consts::TAU;

use nalgebra::Vector2;

use crate::coast::way::Search;
use crate::facts::angle::{ned_from_body, wrap};
use crate::facts::auv::VehicleId;
use crate::facts::goal::Goal;
use crate::facts::localise::{Figure, FigureKind, Localise, LocalisedVehicle};
use crate::localise::candidates::FixedFigure;
use crate::localise::scene::Scene;
use crate::localise::sentence::sentence;
use crate::localise::trial::{MEASUREMENTS_OF_ROW, Outcome};
use crate::predict::forecast::AuvForecast;
use crate::snapshot::build::Snapshot;

/// Phases that are tried for a new figure.
const PHASES: i32 = 36;

/// Time for which a difference of velocities counts as one of places, s.
const VELOCITY_TIME: f64 = 5.0;

/// Largest share of the time since the previous plan by which the phase waits or hurries.
const PHASE_SLIP: f64 = 0.5;

/// Share of its speed by which a figure grows or shrinks.
const DRIFT_SHARE: f64 = 0.2;

/// Longest time since a previous plan with a figure, s.
const REMEMBERED: f64 = 60.0;

/// Chooses the figure of a goal that localises.
pub(crate) struct Localiser<'a> {
    /// Largest planned speed through the water, m/s, and turn rate, rad/s.
    pub(crate) speed: f64,
    pub(crate) turn_rate: f64,
    /// Distance of ways from no-go areas, m.
    pub(crate) clearance: f64,
    /// The only figure that may be sailed, if one is prescribed.
    pub(crate) fixed: Option<FixedFigure>,
    /// `true` for an AUV, by index, whose last report is too old.
    pub(crate) is_stale: &'a dyn Fn(usize) -> bool,
    pub(crate) due: &'a dyn Fn() -> bool,
}

impl Localiser<'_> {
    /// The figure of `snapshot`, and the indices of its AUVs; `None` unless the goal localises and
    /// an AUV was heard, or takes ranges from the AUV that `visited` has, with its cost.
    pub(crate) fn figure(
        &self,
        snapshot: &Snapshot,
        forecasts: &[AuvForecast],
        visited: Option<(usize, f64)>,
    ) -> Option<(Figure, Vec<usize>)> {
        let (localise, radius_max) = match (&snapshot.goal.goal, visited) {
            (Goal::Localise(localise), _) => (localise.clone(), f64::INFINITY),
            (Goal::Visit(visits), Some((auv, cost))) => {
                (Localise::of_visit(visits, &snapshot.auvs[auv].id, cost)?, visits.arc())
            }
            _ => return None,
        };
        let heading = snapshot.asc.heading().radians();
        let named = localise.auvs.iter().filter(|id| 0.0 < localise.weight(id));
        let mut auvs: Vec<usize> = named
            .filter_map(|id| snapshot.auvs.iter().position(|auv| auv.id == *id))
            .filter(|auv| !(self.is_stale)(*auv))
            .collect();
        auvs.sort_unstable();
        let craft = (self.speed, self.turn_rate);
        let ways = Search { land: snapshot.land(), clearance: self.clearance, due: self.due };
        let scene = Scene { radius_max, ..Scene::new(snapshot, &localise, forecasts, &auvs, craft, &ways)? };
        let previous = snapshot.previous_plan.as_ref();
        let kept = previous.and_then(|previous| {
            let elapsed = snapshot.t_s - previous.made_at()?;
            let mut figure = previous.figure.clone()?;
            let is_of = |auv: &VehicleId| figure.vehicles.iter().any(|vehicle| vehicle.auv == *auv);
            let is_same = visited.is_none_or(|(auv, _)| is_of(&snapshot.auvs[auv].id));
            figure.axis_rad = wrap(figure.axis_rad - heading);
            (is_same && (0.0..=REMEMBERED).contains(&elapsed)).then_some((figure, elapsed))
        });
        let mut best: Option<(Figure, Outcome)> = None;
        let mut consider = |figure: Figure, margin: f64| {
            let least = best.as_ref().map_or(f64::INFINITY, |(_, best)| (1.0 - margin) * best.cost);
            if let Some(outcome) = scene.sail(&figure, least) {
                best = Some((figure, outcome));
            }
        };
        let (others, mut margin) = match &self.fixed {
            None => (scene.candidates(kept.as_ref().map(|(figure, _)| figure)), 0.0),
            Some(fixed) => (vec![scene.fixed(fixed)], 0.0),
        };
        if let Some((figure, elapsed)) = &kept {
            let neighbours = match &self.fixed {
                None => scene.neighbours(figure),
                Some(fixed) => vec![Figure { phase_rad: figure.phase_rad, ..scene.fixed(fixed) }],
            };
            for figure in neighbours {
                consider(scene.carried_on(figure, *elapsed), margin);
                margin = scene.tuned.adapt_margin;
            }
            margin = if 0.0 < margin { scene.tuned.keep_margin } else { 0.0 };
        }
        for figure in others {
            if (self.due)() || (self.fixed.is_some() && kept.is_some()) {
                break;
            }
            consider(scene.begun(figure), margin);
        }
        let above = scene.above();
        let sailed_above = scene.sail(&above, f64::INFINITY)?;
        let (mut figure, outcome) = best.unwrap_or_else(|| (above, sailed_above.clone()));
        if let Some((before, elapsed)) = &kept {
            figure = scene.approached(before, figure, *elapsed);
        }
        Some((scene.answer(snapshot, figure, [&outcome, &sailed_above], heading), auvs))
    }
}

impl Scene {
    /// `figure` with the phase from which the craft best joins it.
    fn begun(&self, figure: Figure) -> Figure {
        let (mean, drift) = self.mean_at(0.0);
        let velocity_now = Vector2::new(self.speed_now, 0.0) + self.current;
        let at =
            |k: i32| Figure { phase_rad: wrap(TAU * f64::from(k) / f64::from(PHASES)), ..figure.clone() };
        let misfit = |figure: &Figure| {
            let (place, velocity) = figure.at(0.0);
            let turn = (drift + velocity - velocity_now) * VELOCITY_TIME;
            (mean + place).norm_squared() + turn.norm_squared()
        };
        let phases = if figure.kind == FigureKind::Above { 1 } else { PHASES };
        let best = (0..phases).map(at).min_by(|a, b| misfit(a).total_cmp(&misfit(b)));
        best.unwrap_or(figure)
    }

    /// `figure`, `elapsed` seconds later, with a phase that waits for the craft or follows it.
    fn carried_on(&self, figure: Figure, elapsed: f64) -> Figure {
        let expected = Figure { phase_rad: figure.phase_rad + figure.rate_radps * elapsed, ..figure };
        let (place, velocity) = expected.at(0.0);
        let behind = -(self.mean[0] + place).dot(&velocity) / velocity.norm_squared().max(f64::MIN_POSITIVE);
        let slip = behind.clamp(-PHASE_SLIP * elapsed, PHASE_SLIP * elapsed);
        Figure { phase_rad: wrap(expected.phase_rad + expected.rate_radps * slip), ..expected }
    }

    /// `figure`, or a neighbour of `before` on the way to it: the goal drifts and does not jump.
    fn approached(&self, before: &Figure, figure: Figure, elapsed: f64) -> Figure {
        let (from, to) = (before.size(), figure.size());
        let step = DRIFT_SHARE * self.speed * elapsed;
        let same = figure.kind == before.kind && figure.rate_radps * before.rate_radps > 0.0;
        if !same || (to - from).abs() <= step || 1.5 * from < to || to < from / 1.5 {
            return figure;
        }
        figure.scaled((from + step.copysign(to - from)) / to)
    }

    /// The answer with the chosen `figure`, its axis counted from north.
    fn answer(
        &self,
        snapshot: &Snapshot,
        figure: Figure,
        [outcome, above]: [&Outcome; 2],
        heading: f64,
    ) -> Figure {
        let vehicle = |i: usize| {
            let member = &self.members[i];
            let sigma_now = member.covariance.trace().max(0.0).sqrt();
            let n = self.members.len();
            let later = (0..outcome.rows.len() / n).map(|row| {
                let [on_it, above] = [outcome, above].map(|of| of.rows[row * n + i].max(0.0).sqrt());
                [self.interval * (MEASUREMENTS_OF_ROW * (row + 1)) as f64, on_it, above]
            });
            LocalisedVehicle {
                auv: snapshot.auvs[member.auv].id.clone(),
                sigma_now_m: member.is_known.then_some(sigma_now),
                over_time: member
                    .is_known
                    .then_some([0.0, sigma_now, sigma_now])
                    .into_iter()
                    .chain(later)
                    .collect(),
                sigma_m: outcome.variances[i].max(0.0).sqrt(),
                sigma_above_m: above.variances[i].max(0.0).sqrt(),
            }
        };
        let mut vehicles: Vec<_> = (0..self.members.len()).collect();
        vehicles.sort_by_key(|i| self.members[*i].auv);
        let mean = snapshot.asc.position() + ned_from_body(heading) * self.mean[0];
        let mut figure = Figure {
            north_m: mean.x,
            east_m: mean.y,
            axis_rad: wrap(figure.axis_rad + heading),
            vehicles: vehicles.into_iter().map(vehicle).collect(),
            ..figure
        };
        figure.sentence = sentence(&figure);
        figure
    }
}
