//! Positions and attitudes of the craft over the last minute.

use std::collections::VecDeque;

use planner::angle::wrap;

use crate::Origin;

/// Longest extrapolation and interpolation of poses, s: 1.5 m of motion at full speed.
const HOLD_S: f64 = 1.0;

/// Time for which poses are kept, s. Older fixes are rejected.
const KEPT_S: f64 = 60.0;

/// Largest number of poses: a minute at 100 Hz.
const KEPT_MAX: usize = 6000;

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct CraftPose {
    /// Position of its reference point, usually the GNSS antenna.
    pub(crate) position: Origin,
    /// Heading, rad, true, clockwise from north.
    pub(crate) heading: f64,
    /// Roll, rad, positive starboard down; 0 if not measured.
    pub(crate) roll: f64,
    /// Pitch, rad, positive bow up; 0 if not measured.
    pub(crate) pitch: f64,
}

/// The craft's poses of the last minute, in order of time.
#[derive(Clone, Debug, Default)]
pub(crate) struct PoseHistory {
    poses: VecDeque<(f64, CraftPose)>,
}

impl PoseHistory {
    /// Adds the pose at `t_s`, s of Unix time, and drops poses from then on: the clock was set
    /// back. Poses with numbers that are not finite are ignored.
    pub(crate) fn push(&mut self, t_s: f64, pose: CraftPose) {
        let Origin { lat_deg, lon_deg } = pose.position;
        let numbers = [t_s, lat_deg, lon_deg, pose.heading, pose.roll, pose.pitch];
        if !numbers.iter().all(|number| number.is_finite()) {
            return;
        }
        while self.poses.back().is_some_and(|(newest_s, _)| *newest_s >= t_s) {
            self.poses.pop_back();
        }
        self.poses.push_back((t_s, pose));
        let is_old = |(oldest_s, _): &(f64, CraftPose)| t_s - oldest_s > KEPT_S;
        while self.poses.len() > KEPT_MAX || self.poses.front().is_some_and(is_old) {
            self.poses.pop_front();
        }
    }

    /// The pose at `t_s`, s of Unix time: interpolated, angles by the shorter turn; beyond the ends
    /// the nearest one. `None` more than 1 s from any pose.
    pub(crate) fn at(&self, t_s: f64) -> Option<CraftPose> {
        let next = self.poses.partition_point(|(pose_s, _)| *pose_s < t_s);
        let after = self.poses.get(next);
        let before = next.checked_sub(1).and_then(|index| self.poses.get(index));
        let near = |pose: Option<&(f64, CraftPose)>| pose.is_some_and(|(s, _)| (s - t_s).abs() <= HOLD_S);
        if !near(before) && !near(after) {
            return None;
        }
        match (before, after) {
            (Some(before), Some(after)) => Some(between(before, after, t_s)),
            (Some((_, pose)), None) | (None, Some((_, pose))) => Some(*pose),
            (None, None) => None,
        }
    }
}

fn between((t0, from): &(f64, CraftPose), (t1, to): &(f64, CraftPose), t_s: f64) -> CraftPose {
    let part = (t_s - t0) / (t1 - t0);
    let turned = |from: f64, to: f64| wrap(from + part * wrap(to - from));
    let (lat0, lat1) = (from.position.lat_deg, to.position.lat_deg);
    let (lon0, lon1) = (from.position.lon_deg, to.position.lon_deg);
    CraftPose {
        position: Origin {
            lat_deg: lat0 + part * (lat1 - lat0),
            lon_deg: turned(lon0.to_radians(), lon1.to_radians()).to_degrees(),
        },
        heading: turned(from.heading, to.heading),
        roll: turned(from.roll, to.roll),
        pitch: turned(from.pitch, to.pitch),
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::on_earth;

    fn pose(lat_deg: f64, lon_deg: f64, heading: f64) -> CraftPose {
        CraftPose {
            position: on_earth(lat_deg, lon_deg).expect("is on Earth"),
            heading,
            roll: 0.0,
            pitch: 0.0,
        }
    }

    #[test]
    fn poses_are_interpolated_and_angles_take_the_shorter_turn() {
        let mut poses = PoseHistory::default();
        poses.push(10.0, pose(60.0, 179.9999, 3.0));
        poses.push(11.0, pose(60.0004, -179.9999, -3.0));
        let quarter = poses.at(10.25).expect("is within");
        assert!((quarter.position.lat_deg - 60.0001).abs() < 1e-12);
        assert!((quarter.position.lon_deg - 179.99995).abs() < 1e-9);
        assert!((quarter.heading - (3.0 + 0.25 * (2.0 * PI - 6.0))).abs() < 1e-12);
        let most = poses.at(10.75).expect("is within");
        assert!((most.position.lon_deg + 179.99995).abs() < 1e-9);
    }

    #[test]
    fn end_poses_hold_for_a_second_and_gaps_have_no_pose() {
        let mut poses = PoseHistory::default();
        assert_eq!(poses.at(0.0), None);
        poses.push(0.0, pose(1.0, 2.0, 0.0));
        poses.push(10.0, pose(1.1, 2.0, 0.0));
        assert_eq!(poses.at(-1.0), Some(pose(1.0, 2.0, 0.0)));
        assert_eq!(poses.at(11.0), Some(pose(1.1, 2.0, 0.0)));
        for far in [-1.01, 1.01, 5.0, 8.99, 11.01, f64::NAN, f64::INFINITY] {
            assert_eq!(poses.at(far), None, "{far}");
        }
    }

    #[test]
    fn memory_is_bounded_and_a_clock_set_back_restarts_the_history() {
        let mut poses = PoseHistory::default();
        for k in 0..100_000 {
            poses.push(1000.0 + f64::from(k) * 1e-3, pose(1.0, 2.0, 0.0));
            assert!(poses.poses.len() <= KEPT_MAX);
        }
        poses.push(5000.0, pose(1.0, 2.0, 0.0));
        assert_eq!(poses.poses.len(), 1);
        poses.push(3.0, pose(4.0, 5.0, 0.0));
        assert_eq!(poses.at(3.5), Some(pose(4.0, 5.0, 0.0)));
        assert_eq!(poses.at(5000.0), None);
        poses.push(f64::NAN, pose(1.0, 2.0, 0.0));
        poses.push(4.0, pose(1.0, 2.0, f64::NAN));
        assert_eq!(poses.poses.len(), 1);
    }
}
