//! The previous plan while it still applies: its trajectory, and its heading reference.

use crate::facts::angle::{Heading, wrap};
use crate::facts::reference::TrajectoryPoint;
use crate::problem::parameters::Parameters;
use crate::snapshot::build::Snapshot;

/// A trajectory of this mission that is young, reaches into the future, and passes near the craft.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PreviousTrajectory<'a> {
    points: &'a [TrajectoryPoint],
}

/// The heading reference since the previous plan, independent of the trajectory.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FollowedHeading {
    /// The reference plus the craft's steady error.
    pub(crate) heading: Heading,
    pub(crate) age: f64,
}

impl FollowedHeading {
    /// The one of `snapshot`'s previous plan, if young enough.
    pub(crate) fn of(snapshot: &Snapshot, parameters: &Parameters) -> Option<Self> {
        let previous = snapshot.previous_plan.as_ref()?;
        let age = snapshot.t_s - previous.made_at()?;
        let reference = previous.asked()?.heading.radians();
        let heading = Heading::new(reference + snapshot.craft_model().heading_offset);
        (0.0 <= age && age < parameters.previous_plan_age_max).then_some(Self { heading, age })
    }
}

impl<'a> PreviousTrajectory<'a> {
    /// The trajectory of `snapshot`'s previous plan, if it is usable.
    pub(crate) fn of(snapshot: &'a Snapshot, parameters: &Parameters) -> Option<Self> {
        let previous = snapshot.previous_plan.as_ref()?;
        let points = previous.trajectory.as_slice();
        let (first, last, now) = (points.first()?, points.last()?, snapshot.t_s);
        let young = first.t_s <= now && now - first.t_s < parameters.previous_plan_age_max && now < last.t_s;
        let miss = (point_at(points, now).position() - snapshot.asc.position()).norm();
        (young && miss < parameters.previous_plan_miss_max).then_some(Self { points })
    }

    /// Its point at `time`, s on the snapshot's clock.
    pub(crate) fn at(&self, time: f64) -> TrajectoryPoint {
        point_at(self.points, time)
    }
}

/// A trajectory between its points, linear in position and speed; beyond its ends, the end points.
fn point_at(points: &[TrajectoryPoint], time: f64) -> TrajectoryPoint {
    let after = points.partition_point(|point| point.t_s <= time);
    if after == 0 {
        return points[0];
    }
    if after == points.len() {
        return points[after - 1];
    }
    let (from, to) = (&points[after - 1], &points[after]);
    let share = (time - from.t_s) / (to.t_s - from.t_s);
    let turn = wrap(to.heading_rad - from.heading_rad);
    TrajectoryPoint::new(
        time,
        from.position().lerp(&to.position(), share),
        from.speed_mps + share * (to.speed_mps - from.speed_mps),
        Heading::new(from.heading_rad + share * turn),
    )
}
