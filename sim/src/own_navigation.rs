//! The navigation of AUVs that the craft localises: dead reckoning that drifts, and a Kalman filter
//! of its own in each that takes ranges of the craft, or the craft's fixes.

use nalgebra::{Matrix2, Vector2};
use planner::snapshot::{Fixes, Goal, Localise};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use crate::{fault::Behaviour, observe::normal_pair, record::NavigationRow, world::World};

/// Standard deviation of a launch position along either axis, m. Assumption: that of GNSS.
const LAUNCH_SIGMA: f64 = 1.0;

/// Standard deviations of its prediction beyond which a filter refuses a measurement.
const GATE: f64 = 4.0;

/// Faults of the measurements beside their noise.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RangingFaults {
    /// Share that does not arrive.
    pub lost_share: f64,
    /// Share that went a longer way, by up to `outlier`, m.
    pub outlier_share: f64,
    /// The longest such way, m.
    pub outlier: f64,
    /// Rate at which an AUV's clock makes its ranges longer, m/s.
    pub clock_drift: f64,
}

/// The navigation of all AUVs of a goal that localises.
#[derive(Clone, Debug)]
pub struct OwnNavigation {
    goal: Localise,
    faults: RangingFaults,
    range_max: f64,
    /// Anchored modems that replace the craft's, (north, east), m.
    anchored: Vec<Vector2<f64>>,
    /// Index in the world, and covariance of the position estimate, m².
    members: Vec<(usize, Matrix2<f64>)>,
    random: ChaCha8Rng,
    /// Times of the last call and of the next measurement, s.
    then: f64,
    next: f64,
}

impl OwnNavigation {
    /// None unless the goal localises.
    pub(crate) fn new(
        goal: &Goal,
        faults: RangingFaults,
        range_max: Option<f64>,
        anchored: Vec<Vector2<f64>>,
        world: &mut World,
        mut random: ChaCha8Rng,
    ) -> Option<Self> {
        let Goal::Localise(goal) = goal else { return None };
        let named = goal.auvs.iter();
        let places = named.filter_map(|id| world.auvs.iter().position(|auv| auv.id == *id));
        let covariance = Matrix2::identity() * LAUNCH_SIGMA.powi(2);
        let members: Vec<_> = places.map(|auv| (auv, covariance)).collect();
        for (auv, covariance) in &members {
            let auv = &mut world.auvs[*auv];
            auv.navigation_error += normal_pair(&mut random) * LAUNCH_SIGMA;
            auv.own_covariance = Some(*covariance);
        }
        Some(Self {
            goal: goal.clone(),
            faults,
            range_max: range_max.unwrap_or(f64::INFINITY),
            anchored,
            members,
            random,
            then: world.time(),
            next: world.time(),
        })
    }

    /// Advances to the world's time, with the measurements that were due from `craft`, positions.
    pub(crate) fn advance(&mut self, world: &mut World, craft: &[Vector2<f64>]) {
        let now = world.time();
        let elapsed = now - self.then;
        self.then = now;
        let growth = self.goal.growth_m2ps * elapsed;
        for (auv, covariance) in &mut self.members {
            world.auvs[*auv].navigation_error += normal_pair(&mut self.random) * growth.sqrt();
            *covariance += Matrix2::identity() * growth;
        }
        while self.next <= now {
            self.next += self.goal.interval_s;
            let sources = if self.anchored.is_empty() { craft } else { &self.anchored.clone() };
            for source in sources {
                for place in 0..self.members.len() {
                    self.measure(world, source, place, now);
                }
            }
        }
        for (auv, covariance) in &self.members {
            world.auvs[*auv].own_covariance = Some(*covariance);
        }
    }

    /// A measurement between the modem at `source` and a member, taken by that member's filter.
    fn measure(&mut self, world: &mut World, source: &Vector2<f64>, place: usize, now: f64) {
        // All are drawn, so that missions with other tracks have the same noise.
        let noise = normal_pair(&mut self.random);
        let [lost, longer, by] = [(); 3].map(|()| self.random.random::<f64>());
        let (auv, covariance) = &mut self.members[place];
        let is = &mut world.auvs[*auv];
        let off = is.position() - source;
        let range = off.norm().hypot(is.depth());
        let dead = is.behaviour == Behaviour::Drifts;
        if dead || self.range_max < range || lost < self.faults.lost_share {
            return;
        }
        let believed = off + is.navigation_error;
        let correction = match self.goal.fixes {
            Fixes::Range => {
                let expected = believed.norm().hypot(is.depth()).max(f64::EPSILON);
                let detour = if longer < self.faults.outlier_share { by * self.faults.outlier } else { 0.0 };
                let measured = range + self.goal.sigma_m * noise.x + detour + self.faults.clock_drift * now;
                let slope = believed / expected;
                let variance = slope.dot(&(*covariance * slope)) + self.goal.sigma_m.powi(2);
                let innovation = measured - expected;
                if GATE * variance.sqrt() < innovation.abs() {
                    return;
                }
                let gain = *covariance * slope / variance;
                *covariance -= gain * gain.transpose() * variance;
                gain * innovation
            }
            Fixes::Usbl => {
                let sigma = self.goal.sigma_m.hypot(self.goal.sigma_rad * range);
                let innovation = noise * sigma - is.navigation_error;
                let variance = *covariance + Matrix2::identity() * sigma.powi(2);
                let Some(inverse) = variance.try_inverse() else { return };
                let gain = *covariance * inverse;
                *covariance -= gain * *covariance;
                gain * innovation
            }
        };
        is.navigation_error += correction;
    }

    /// The navigation of AUV number `auv`; none if it is not localised.
    pub(crate) fn row(&self, world: &World, auv: usize) -> Option<NavigationRow> {
        let (_, covariance) = self.members.iter().find(|(place, _)| *place == auv)?;
        NavigationRow::of(world.auvs[auv].navigation_error, covariance)
    }
}

#[cfg(test)]
mod tests {
    use planner::angle::direction;

    use super::*;
    use crate::scenario::Scenario;

    /// Navigation of one AUV over twenty minutes with a craft at `place` about it at a time, s:
    /// root mean square error once settled, m, and mean squared error over its stated covariance.
    fn navigated(faults: RangingFaults, place: impl Fn(f64) -> Vector2<f64>) -> (f64, f64) {
        let scenario = Scenario::named("localise-straight").expect("exists");
        let (mut squares, mut nees, mut n) = (0.0, 0.0, 0.0);
        for seed in 0..12 {
            let start = scenario.start(seed).expect("valid");
            let (mut world, navigation) = (start.world, start.own_navigation);
            let mut navigation = navigation.expect("the goal localises");
            navigation.faults = faults;
            for second in 0..1200 {
                let time = world.time();
                let craft = world.auvs[0].position() + place(time);
                navigation.advance(&mut world, &[craft]);
                if 300 < second {
                    let row = navigation.row(&world, 0).expect("is localised");
                    (squares, nees, n) = (squares + row.error.powi(2), nees + row.nees, n + 1.0);
                }
                (0..10).for_each(|_| world.step(None));
            }
        }
        ((squares / n).sqrt(), nees / n)
    }

    fn circle(time: f64) -> Vector2<f64> {
        direction(time / 30.0) * 30.0
    }

    #[test]
    fn ranges_from_a_circle_fix_an_auv_and_ranges_from_above_do_not() {
        let (circled, nees) = navigated(RangingFaults::default(), circle);
        // The toy of `docs/ranging.md` has 1.75 m.
        assert!((1.4..2.2).contains(&circled), "{circled}");
        assert!((1.5..2.7).contains(&nees), "{nees}");
        let (above, _) = navigated(RangingFaults::default(), |_| Vector2::zeros());
        // An AUV that is metres off expects a longer range than it measures: that bounds its error.
        assert!(1.4 * circled < above, "{above}");
    }

    #[test]
    fn long_detours_and_losses_cost_little_and_a_drifting_clock_much() {
        let (clean, _) = navigated(RangingFaults::default(), circle);
        let faults = |faults| navigated(faults, circle).0;
        let outliers = faults(RangingFaults {
            outlier_share: 0.1,
            outlier: 50.0,
            lost_share: 0.1,
            ..RangingFaults::default()
        });
        assert!(clean < outliers && outliers < 1.6 * clean, "{outliers}");
        let drifting = faults(RangingFaults { clock_drift: 0.01, ..RangingFaults::default() });
        assert!(1.5 * clean < drifting, "{drifting}");
    }
}
