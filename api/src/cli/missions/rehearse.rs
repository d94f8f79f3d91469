//! The controller of a rehearsal: what steers the craft on its wire.

use bridge::rehearsal::{Rehearsal, Vehicle};
use lab::http_guide::GUIDE;
use planner::angle::{Heading, direction};
use planner::los::Reference;
use planner::nalgebra::Vector2;
use planner::snapshot::{Auv, Snapshot};
use sim::guide::{Guidance, Guide, GuideError};

/// The craft's name on the wire.
const CRAFT: &str = "craft";

/// Plays the vehicles of a mission in real time.
pub(super) struct WireGuide(pub(super) Rehearsal);

impl Guide for WireGuide {
    fn name(&self) -> &'static str {
        GUIDE
    }

    fn guide(&mut self, snapshot: &Snapshot) -> Result<Guidance, GuideError> {
        let craft = craft(snapshot);
        let auvs: Vec<Vehicle> = snapshot.auvs.iter().filter_map(|auv| reported(auv, snapshot.t_s)).collect();
        let steered = self.0.say(snapshot.t_s, &craft, &auvs);
        // As one whose references end, it stops.
        let (speed, heading) =
            steered.map_or((0.0, craft.heading), |reference| (reference.speed, reference.heading));
        Ok(Reference { speed, heading: Heading::new(heading) }.into())
    }
}

fn craft(snapshot: &Snapshot) -> Vehicle {
    let asc = &snapshot.asc;
    let through_water = asc.speed_mps * direction(asc.heading_rad)
        + asc.sway_mps * direction(asc.heading_rad + std::f64::consts::FRAC_PI_2);
    let over_ground =
        asc.ground_north_mps.zip(asc.ground_east_mps).map(|(north, east)| Vector2::new(north, east));
    Vehicle {
        name: CRAFT.to_owned(),
        t_s: snapshot.t_s,
        position: asc.position(),
        velocity: Some(over_ground.unwrap_or(through_water)),
        heading: asc.heading_rad,
        yaw_rate: asc.yaw_rate_radps,
        depth_m: 0.0,
    }
}

/// The newest that the craft was told of `auv`; nothing of a range.
fn reported(auv: &Auv, now_s: f64) -> Option<Vehicle> {
    let newest = auv.reports.iter().flatten().max_by(|a, b| a.t_s.total_cmp(&b.t_s));
    let (t_s, position, motion, depth) = match (&auv.state, newest) {
        (Some(state), _) => (
            now_s - state.age_s,
            state.position(),
            Some((state.course_rad, state.speed_mps)),
            Some(state.depth_m),
        ),
        (None, Some(report)) => {
            let position = Vector2::new(report.north_m?, report.east_m?);
            (report.t_s, position, report.course_rad.zip(report.speed_mps), report.depth_m)
        }
        (None, None) => return None,
    };
    Some(Vehicle {
        name: auv.id.to_string(),
        t_s,
        position,
        velocity: motion.map(|(course, speed)| speed * direction(course)),
        heading: motion.map_or(0.0, |(course, _)| course),
        yaw_rate: 0.0,
        depth_m: depth.unwrap_or_default(),
    })
}
