//! Faults with their start and end.

use planner::path::Side;

use crate::world::hull::ThrusterHealth;

mod words;

/// A fault that lasts for a while.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fault {
    /// Start, s.
    pub from: f64,
    /// End, s, exclusive.
    pub until: f64,
    /// Its kind.
    pub what: FaultKind,
}

/// A kind of fault. Underwater vehicles are numbered in the scenario's order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FaultKind {
    /// A thruster of the surface craft delivers a share of its thrust.
    Thruster {
        /// Side of the thruster.
        side: Side,
        /// The share, 0 to 1.
        share: f64,
    },
    /// The surface craft's heading loop is slower by this factor, above 1.
    SlowHeadingLoop(f64),
    /// The surface craft's heading loop settles this angle to starboard of its reference, rad: the
    /// compass of the autopilot is misaligned.
    HeadingOffset(f64),
    /// The surface craft's rudder, or differential thrust, is stuck at this share of the largest
    /// yaw moment, −1 to 1, positive to starboard.
    RudderStuck(f64),
    /// The thrust of the surface craft is stuck at this share of the largest ahead, 0 to 1.
    ThrustStuck(f64),
    /// The surface craft has no power: it drifts and is silent.
    CraftDies,
    /// The surface craft's GNSS receiver gives nothing.
    GnssOutage,
    /// The surface craft's clock is ahead, s.
    ClockOffset(f64),
    /// No message of an underwater vehicle arrives.
    Silence(usize),
    /// An underwater vehicle surfaces and waits there.
    Stops(usize),
    /// An underwater vehicle has no power: it drifts and sends no messages.
    Dies(usize),
    /// An underwater vehicle leaves its path, and rejoins it afterwards.
    LeavesPath {
        /// The vehicle.
        auv: usize,
        /// Heading that it takes, rad. Default: its own.
        heading: Option<f64>,
    },
    /// The reported standard deviation of an underwater vehicle's fixes is wrong by a factor.
    WrongAccuracy {
        /// The vehicle.
        auv: usize,
        /// The factor, positive.
        factor: f64,
    },
    /// An underwater vehicle reports speed 0.
    ReportsSpeedZero(usize),
    /// Every message of an underwater vehicle arrives twice.
    MessagesTwice(usize),
}

/// The behaviour of an underwater vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Behaviour {
    /// It follows its path and dives.
    FollowsPath,
    /// It takes this heading, rad (default: its own), and dives.
    LeavesPath(Option<f64>),
    /// It climbs to the surface and waits there.
    WaitsAtSurface,
    /// It drifts.
    Drifts,
}

/// The faults of a mission.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Faults(pub Vec<Fault>);

impl Faults {
    /// Health of the surface craft's thrusters at `time` s. Shares of one thruster multiply.
    pub fn thrusters(&self, time: f64) -> ThrusterHealth {
        let mut health = ThrusterHealth::SOUND;
        for what in self.at(time) {
            match what {
                FaultKind::Thruster { side: Side::Port, share } => health.port *= share,
                FaultKind::Thruster { side: Side::Starboard, share } => health.starboard *= share,
                FaultKind::RudderStuck(share) => health.steering_stuck = Some(share),
                FaultKind::ThrustStuck(share) => health.thrust_stuck = Some(share),
                FaultKind::CraftDies => (health.port, health.starboard) = (0.0, 0.0),
                _ => {}
            }
        }
        health
    }

    /// `true` if the surface craft has no power at `time` s.
    pub fn craft_is_dead(&self, time: f64) -> bool {
        self.at(time).any(|what| what == FaultKind::CraftDies)
    }

    /// Factor by which the surface craft's heading loop is slower at `time` s. Factors multiply.
    pub fn heading_loop_slowed(&self, time: f64) -> f64 {
        self.at(time).fold(1.0, |product, what| match what {
            FaultKind::SlowHeadingLoop(factor) => product * factor,
            _ => product,
        })
    }

    /// Steady error of the craft's heading loop at `time` s, rad, positive to starboard; a sum.
    pub fn heading_offset(&self, time: f64) -> f64 {
        self.at(time).fold(0.0, |sum, what| match what {
            FaultKind::HeadingOffset(offset) => sum + offset,
            _ => sum,
        })
    }

    /// `true` while the surface craft's GNSS receiver works at `time` s.
    pub fn gnss_works(&self, time: f64) -> bool {
        !self.at(time).any(|what| what == FaultKind::GnssOutage)
    }

    /// Offset of the surface craft's clock at `time` s, s, positive if ahead. Offsets add up.
    pub fn clock_offset(&self, time: f64) -> f64 {
        self.at(time).fold(0.0, |sum, what| match what {
            FaultKind::ClockOffset(offset) => sum + offset,
            _ => sum,
        })
    }

    /// `true` if no message of underwater vehicle `auv` arrives at `time` s.
    pub fn is_silent(&self, auv: usize, time: f64) -> bool {
        self.at(time).any(|what| [FaultKind::Silence(auv), FaultKind::Dies(auv)].contains(&what))
    }

    /// Factor on the claimed standard deviation of fixes of `auv` at `time` s. Factors multiply.
    pub fn accuracy_factor(&self, auv: usize, time: f64) -> f64 {
        self.at(time).fold(1.0, |product, what| match what {
            FaultKind::WrongAccuracy { auv: of, factor } if of == auv => product * factor,
            _ => product,
        })
    }

    /// `true` if underwater vehicle `auv` reports speed 0 at `time` s.
    pub fn reports_speed_zero(&self, auv: usize, time: f64) -> bool {
        self.at(time).any(|what| what == FaultKind::ReportsSpeedZero(auv))
    }

    /// `true` if messages of underwater vehicle `auv` that arrive at `time` s arrive twice.
    pub fn messages_twice(&self, auv: usize, time: f64) -> bool {
        self.at(time).any(|what| what == FaultKind::MessagesTwice(auv))
    }

    /// Behaviour of underwater vehicle `auv` at `time` s. The gravest of several faults applies.
    pub fn behaviour(&self, auv: usize, time: f64) -> Behaviour {
        let is = |kind: FaultKind| self.at(time).any(|what| what == kind);
        if is(FaultKind::Dies(auv)) {
            Behaviour::Drifts
        } else if is(FaultKind::Stops(auv)) {
            Behaviour::WaitsAtSurface
        } else {
            let left = self.at(time).find_map(|what| match what {
                FaultKind::LeavesPath { auv: of, heading } if of == auv => Some(heading),
                _ => None,
            });
            left.map_or(Behaviour::FollowsPath, Behaviour::LeavesPath)
        }
    }

    fn at(&self, time: f64) -> impl Iterator<Item = FaultKind> {
        let is_on = move |fault: &&Fault| fault.from <= time && time < fault.until;
        self.0.iter().filter(is_on).map(|fault| fault.what)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn faults(what: &[FaultKind]) -> Faults {
        let during = |what: &FaultKind| Fault { from: 10.0, until: 20.0, what: *what };
        Faults(what.iter().map(during).collect())
    }

    #[test]
    fn a_fault_includes_its_start_and_excludes_its_end() {
        let outage = faults(&[FaultKind::GnssOutage]);
        let found = [9.9, 10.0, 19.9, 20.0].map(|time| outage.gnss_works(time));
        assert_eq!(found, [true, false, false, true]);
    }

    #[test]
    fn faults_affect_only_their_vehicle() {
        let (side, share) = (Side::Port, 0.5);
        let several = faults(&[
            FaultKind::Thruster { side, share },
            FaultKind::Thruster { side, share },
            FaultKind::Silence(1),
            FaultKind::LeavesPath { auv: 0, heading: None },
            FaultKind::ClockOffset(2.0),
            FaultKind::WrongAccuracy { auv: 0, factor: 0.3 },
            FaultKind::WrongAccuracy { auv: 0, factor: 0.1 },
            FaultKind::ReportsSpeedZero(1),
            FaultKind::MessagesTwice(1),
        ]);
        let health = several.thrusters(15.0);
        assert_eq!((health.port, health.starboard), (0.25, 1.0));
        assert_eq!(several.clock_offset(15.0), 2.0);
        assert!(several.gnss_works(15.0));
        let leaves = Behaviour::LeavesPath(None);
        let both = [0, 1];
        let found = both.map(|auv| several.behaviour(auv, 15.0));
        assert_eq!(found, [leaves, Behaviour::FollowsPath]);
        assert_eq!(both.map(|auv| several.is_silent(auv, 15.0)), [false, true]);
        let found = both.map(|auv| several.accuracy_factor(auv, 15.0));
        assert_eq!(found, [0.3 * 0.1, 1.0]);
        let found = both.map(|auv| several.reports_speed_zero(auv, 15.0));
        assert_eq!(found, [false, true]);
        assert_eq!(both.map(|auv| several.messages_twice(auv, 15.0)), [false, true]);
        assert!(!several.messages_twice(1, 20.0));
    }

    #[test]
    fn a_dead_vehicle_neither_waits_nor_transmits() {
        let dead = faults(&[FaultKind::Stops(0), FaultKind::Dies(0)]);
        assert_eq!(dead.behaviour(0, 15.0), Behaviour::Drifts);
        assert!(dead.is_silent(0, 15.0));
    }
}
