//! Faults in words, for operators.

use planner::path::Side;

use super::{Fault, FaultKind};

impl Fault {
    /// The fault in words. `auvs` has the names of the underwater vehicles.
    pub fn in_words(&self, auvs: &[String]) -> String {
        let percent = |share: f64| format!("{:.0} %", 100.0 * share);
        match self.what {
            FaultKind::Thruster { side, share } => {
                let side = match side {
                    Side::Port => "port",
                    Side::Starboard => "starboard",
                };
                format!("the {side} thruster delivers {} of its thrust", percent(share))
            }
            FaultKind::SlowHeadingLoop(factor) => {
                format!("the heading of the craft responds {factor:.1} times as slowly")
            }
            FaultKind::HeadingOffset(offset) => {
                let degrees = offset.to_degrees();
                format!("the craft's heading settles {degrees:.0}° to starboard of its reference")
            }
            FaultKind::RudderStuck(share) => {
                format!("the rudder is stuck at {} to starboard", percent(share))
            }
            FaultKind::ThrustStuck(share) => format!("the thrust is stuck at {}", percent(share)),
            FaultKind::CraftDies => "the craft loses power and is silent".to_owned(),
            FaultKind::GnssOutage => "the craft has no GNSS position".to_owned(),
            FaultKind::ClockOffset(offset) if offset < 0.0 => {
                format!("the craft's clock is {:.1} s behind", -offset)
            }
            FaultKind::ClockOffset(offset) => format!("the craft's clock is {offset:.1} s ahead"),
            FaultKind::Silence(auv) => format!("no message of {} arrives", auvs[auv]),
            FaultKind::Stops(auv) => format!("{} surfaces and waits", auvs[auv]),
            FaultKind::Dies(auv) => format!("{} loses power and sends nothing", auvs[auv]),
            FaultKind::LeavesPath { auv, .. } => format!("{} leaves its path", auvs[auv]),
            FaultKind::WrongAccuracy { auv, factor } => {
                format!("{} claims {factor:.1} times the errors that its fixes have", auvs[auv])
            }
            FaultKind::ReportsSpeedZero(auv) => format!("{} reports speed 0", auvs[auv]),
            FaultKind::MessagesTwice(auv) => format!("messages of {} arrive twice", auvs[auv]),
        }
    }

    /// `true` if it stops the messages of an underwater vehicle.
    pub fn stops_messages(&self) -> bool {
        matches!(self.what, FaultKind::Silence(_) | FaultKind::Dies(_))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fault_names_its_vehicle_and_its_size() {
        let auvs = ["auv-1".to_owned(), "auv-2".to_owned()];
        let words = |what| {
            let fault = Fault { from: 0.0, until: 1.0, what };
            (fault.in_words(&auvs), fault.stops_messages())
        };
        let weak = FaultKind::Thruster { side: Side::Port, share: 0.6 };
        let expected = ("the port thruster delivers 60 % of its thrust".to_owned(), false);
        assert_eq!(words(weak), expected);
        let expected = ("auv-2 loses power and sends nothing".to_owned(), true);
        assert_eq!(words(FaultKind::Dies(1)), expected);
        let found = words(FaultKind::ClockOffset(-2.0)).0;
        assert_eq!(found, "the craft's clock is 2.0 s behind");
    }
}
