//! Where the craft is meant to stay, from a client's JSON and back.

use nalgebra::Vector2;
use planner::snapshot as domain;

use super::request::{Acoustics, KeepOut, PlanRequest};

/// The lists of the bounds: pointer, items, fewest and most accepted.
pub(super) fn lengths(request: &PlanRequest) -> Vec<(&'static str, usize, usize, usize)> {
    let mut lengths = vec![("/keep_outs", request.keep_outs.len(), 0, domain::KEEP_OUTS_MAX)];
    if !request.area.is_empty() {
        let (least, most) = domain::AREA_CORNERS.into_inner();
        lengths.push(("/area", request.area.len(), least, most));
    }
    lengths
}

pub(super) fn read_keep_out(disc: &KeepOut) -> domain::KeepOut {
    domain::KeepOut {
        centre: Vector2::new(disc.north_m, disc.east_m),
        radius: disc.radius_m,
    }
}

pub(super) fn write_keep_out(disc: &domain::KeepOut) -> KeepOut {
    KeepOut {
        north_m: disc.centre.x,
        east_m: disc.centre.y,
        radius_m: disc.radius,
    }
}

pub(super) fn write_acoustics(range_max: f64) -> Acoustics {
    Acoustics {
        range_max_m: range_max,
    }
}
