//! The heading whose next measurement tells most: a baseline for goals that localise AUVs.

use nalgebra::{Matrix2, Vector2};
use planner::{
    angle::{Heading, direction},
    goal::GoalForecast,
    los::Reference,
    snapshot::{Fixes, Goal, Localise, Snapshot},
};
use sim::guide::{Guidance, Guide, GuideError};

/// Headings that are tried.
const HEADINGS: u16 = 72;

/// Sails at full speed on the heading after which the next measurements of all AUVs leave the least
/// sum of variances. It knows what the planner knows, but neither keep-outs nor the area.
#[derive(Clone, Copy, Debug, Default)]
pub struct GreedyGuide;

impl Guide for GreedyGuide {
    fn name(&self) -> &'static str {
        "greedy"
    }

    fn guide(&mut self, snapshot: &Snapshot) -> Result<Guidance, GuideError> {
        let Goal::Localise(localise) = &snapshot.goal.goal else {
            return Err("the goal does not localise".into());
        };
        let speed = snapshot.limits().speed_max;
        let forecast = GoalForecast::holding(snapshot, None);
        let after = localise.interval_s;
        let unknown_sigma = snapshot.tuned().localise.unknown_sigma;
        let unknown = || Matrix2::identity() * unknown_sigma.powi(2);
        let auvs: Vec<_> = (0..snapshot.auvs.len())
            .filter(|auv| localise.auvs.contains(&snapshot.auvs[*auv].id))
            .map(|auv| {
                let there = &forecast.auvs()[auv];
                let given = localise.costs_now.get(&snapshot.auvs[auv].id);
                let given = given.map(|cost| Matrix2::identity() * (0.5 * cost));
                let estimated = || {
                    let covariance = snapshot.estimates()[auv].state.covariance()?;
                    Some(covariance.fixed_view::<2, 2>(0, 0).into_owned())
                };
                let covariance = given.or_else(estimated).unwrap_or_else(unknown);
                (there.at(after).position, there.depth_at(after), covariance)
            })
            .collect();
        let left = |heading: f64| {
            let craft = snapshot.asc.position() + (direction(heading) * speed + snapshot.current()) * after;
            auvs.iter().map(|(place, depth, before)| measured(localise, before, place - craft, *depth)).sum()
        };
        let bow = snapshot.asc.heading().radians();
        let headings =
            (0..HEADINGS).map(|k| bow + std::f64::consts::TAU * f64::from(k) / f64::from(HEADINGS));
        let heading = headings
            .map(|heading| (heading, left(heading)))
            .min_by(|a: &(f64, f64), b| a.1.total_cmp(&b.1))
            .map_or(bow, |(heading, _)| heading);
        Ok(Reference { speed, heading: Heading::new(heading) }.into())
    }
}

/// Sum of the variances, m², after a measurement at the horizontal displacement `off` of an AUV.
fn measured(localise: &Localise, before: &Matrix2<f64>, off: Vector2<f64>, depth: f64) -> f64 {
    let range = off.norm().hypot(depth);
    let gained = match localise.fixes {
        Fixes::Range => {
            let slope = off / range.max(f64::MIN_POSITIVE);
            slope * slope.transpose() / localise.sigma_m.powi(2)
        }
        Fixes::Usbl => Matrix2::identity() / localise.sigma_m.hypot(localise.sigma_rad * range).powi(2),
    };
    let grown = before + Matrix2::identity() * (localise.growth_m2ps * localise.interval_s);
    let information = grown.try_inverse().map(|inverse| inverse + gained);
    information.and_then(Matrix2::try_inverse).map_or(f64::INFINITY, |left| left.trace())
}
