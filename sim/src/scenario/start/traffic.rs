//! The other vessels at the start.

use std::f64::consts::FRAC_PI_2;

use nalgebra::Vector2;
use planner::angle::direction;

use super::draw::Draw;
use crate::observe::AisSetup;
use crate::scenario::file::{AisFile, VesselFile};
use crate::world::vessel::SimulatedVessel;

pub(super) fn vessel(file: &VesselFile, draw: &mut Draw) -> SimulatedVessel {
    let place = Vector2::new(draw.take(&file.north_m), draw.take(&file.east_m));
    let (off, at) = (draw.take_or(file.off_m.as_ref(), 0.0), draw.take_or(file.at_s.as_ref(), 0.0));
    let (course, speed) = (draw.take(&file.course_rad), draw.take(&file.speed_mps));
    SimulatedVessel {
        id: file.id.clone(),
        length: draw.take_or(file.length_m.as_ref(), 20.0),
        status: file.status,
        behaviour: file.behaviour,
        position: place + direction(course + FRAC_PI_2) * off - direction(course) * (speed * at),
        course,
        speed,
        intended: course,
        turn: {
            let angle = draw.take_or(file.turn_rad.as_ref(), 0.5);
            (draw.take_or(file.turns_at_s.as_ref(), 60.0), angle)
        },
    }
}

pub(super) fn ais(file: &AisFile, draw: &mut Draw) -> AisSetup {
    AisSetup {
        interval: draw.take_or(file.interval_s.as_ref(), 6.0),
        latency: draw.take_or(file.latency_s.as_ref(), 1.0),
        lost_share: draw.take_or(file.lost_share.as_ref(), 0.1),
        position_sigma: draw.take_or(file.position_sigma_m.as_ref(), 5.0),
        course_sigma: draw.take_or(file.course_sigma_rad.as_ref(), 0.02),
    }
}
