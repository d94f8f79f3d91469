//! What goes wrong, and when.

use planner::path::Side;

use crate::world::hull::ThrusterHealth;

/// Something that goes wrong for a while.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fault {
    /// From when on, s.
    pub from: f64,
    /// Until when, s; it has ended at that instant.
    pub until: f64,
    /// What.
    pub what: FaultKind,
}

/// What goes wrong. Underwater vehicles are numbered in the scenario's order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FaultKind {
    /// A thruster of the surface craft gives a share of its thrust.
    Thruster {
        /// Which.
        side: Side,
        /// The share, 0 to 1.
        share: f64,
    },
    /// The surface craft's heading loop is slower by this factor, above 1.
    SlowHeadingLoop(f64),
    /// The surface craft's heading loop comes to rest this far to starboard of its reference, rad: the autopilot's own
    /// compass turned in its mount.
    HeadingOffset(f64),
    /// The surface craft's rudder, or what stands for one, is stuck at this share of the largest yaw moment, −1 to 1,
    /// positive to starboard.
    RudderStuck(f64),
    /// The surface craft's GNSS receiver gives nothing.
    GnssOutage,
    /// The surface craft's clock is ahead, s.
    ClockOffset(f64),
    /// Nothing is heard of an underwater vehicle.
    Silence(usize),
    /// An underwater vehicle surfaces and waits there.
    Stops(usize),
    /// An underwater vehicle has no power and is not heard.
    Dies(usize),
    /// An underwater vehicle keeps its heading.
    LeavesPath(usize),
}

/// What an underwater vehicle does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Conduct {
    /// It follows its path and dives.
    FollowsPath,
    /// It keeps its heading and dives.
    KeepsHeading,
    /// It climbs to the top of its dive and waits there.
    WaitsAtTheTop,
    /// It drifts.
    Drifts,
}

/// Everything that goes wrong in a mission.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Faults(pub Vec<Fault>);

impl Faults {
    /// What the surface craft's thrusters are worth at `time` s. Faults of one thruster multiply.
    #[must_use]
    pub fn thrusters(&self, time: f64) -> ThrusterHealth {
        let mut health = ThrusterHealth::SOUND;
        for what in self.at(time) {
            match what {
                FaultKind::Thruster {
                    side: Side::Port,
                    share,
                } => health.port *= share,
                FaultKind::Thruster {
                    side: Side::Starboard,
                    share,
                } => health.starboard *= share,
                FaultKind::RudderStuck(share) => health.steering_stuck = Some(share),
                _ => {}
            }
        }
        health
    }

    /// By which factor the surface craft's heading loop is slower at `time` s. Factors multiply.
    #[must_use]
    pub fn heading_loop_slowed(&self, time: f64) -> f64 {
        self.at(time).fold(1.0, |product, what| match what {
            FaultKind::SlowHeadingLoop(factor) => product * factor,
            _ => product,
        })
    }

    /// How far to starboard of its reference the surface craft's heading loop comes to rest at `time` s, rad. Offsets
    /// add up.
    #[must_use]
    pub fn heading_offset(&self, time: f64) -> f64 {
        self.at(time).fold(0.0, |sum, what| match what {
            FaultKind::HeadingOffset(offset) => sum + offset,
            _ => sum,
        })
    }

    /// Whether the surface craft's GNSS receiver works at `time` s.
    #[must_use]
    pub fn gnss_works(&self, time: f64) -> bool {
        !self.at(time).any(|what| what == FaultKind::GnssOutage)
    }

    /// By how much the surface craft's clock is ahead at `time` s. Offsets add up.
    #[must_use]
    pub fn clock_offset(&self, time: f64) -> f64 {
        self.at(time).fold(0.0, |sum, what| match what {
            FaultKind::ClockOffset(offset) => sum + offset,
            _ => sum,
        })
    }

    /// Whether underwater vehicle `auv` cannot be heard at `time` s.
    #[must_use]
    pub fn is_silent(&self, auv: usize, time: f64) -> bool {
        self.at(time)
            .any(|what| [FaultKind::Silence(auv), FaultKind::Dies(auv)].contains(&what))
    }

    /// What underwater vehicle `auv` does at `time` s. The gravest of several faults counts.
    #[must_use]
    pub fn conduct(&self, auv: usize, time: f64) -> Conduct {
        let is = |kind: FaultKind| self.at(time).any(|what| what == kind);
        if is(FaultKind::Dies(auv)) {
            Conduct::Drifts
        } else if is(FaultKind::Stops(auv)) {
            Conduct::WaitsAtTheTop
        } else if is(FaultKind::LeavesPath(auv)) {
            Conduct::KeepsHeading
        } else {
            Conduct::FollowsPath
        }
    }

    fn at(&self, time: f64) -> impl Iterator<Item = FaultKind> {
        self.0
            .iter()
            .filter(move |fault| fault.from <= time && time < fault.until)
            .map(|fault| fault.what)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn faults(what: &[FaultKind]) -> Faults {
        let during = |what: &FaultKind| Fault {
            from: 10.0,
            until: 20.0,
            what: *what,
        };
        Faults(what.iter().map(during).collect())
    }

    #[test]
    fn a_fault_begins_at_its_first_instant_and_is_over_at_its_last() {
        let outage = faults(&[FaultKind::GnssOutage]);
        assert_eq!(
            [9.9, 10.0, 19.9, 20.0].map(|time| outage.gnss_works(time)),
            [true, false, false, true]
        );
    }

    #[test]
    fn faults_touch_only_the_vehicle_that_they_name() {
        let several = faults(&[
            FaultKind::Thruster {
                side: Side::Port,
                share: 0.5,
            },
            FaultKind::Thruster {
                side: Side::Port,
                share: 0.5,
            },
            FaultKind::Silence(1),
            FaultKind::LeavesPath(0),
            FaultKind::ClockOffset(2.0),
        ]);
        let health = several.thrusters(15.0);
        assert_eq!((health.port, health.starboard), (0.25, 1.0));
        assert!(several.is_silent(1, 15.0) && !several.is_silent(0, 15.0));
        assert_eq!(several.conduct(0, 15.0), Conduct::KeepsHeading);
        assert_eq!(several.conduct(1, 15.0), Conduct::FollowsPath);
        assert_eq!(several.clock_offset(15.0), 2.0);
        assert!(several.gnss_works(15.0));
    }

    #[test]
    fn a_dead_vehicle_neither_waits_nor_transmits() {
        let dead = faults(&[FaultKind::Stops(0), FaultKind::Dies(0)]);
        assert_eq!(dead.conduct(0, 15.0), Conduct::Drifts);
        assert!(dead.is_silent(0, 15.0));
    }
}
