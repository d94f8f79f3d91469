//! A schedule in words, for who has no time to read its numbers.

use std::fmt::Write;

use crate::facts::{
    schedule::{CostUnit, LeftOut, Schedule},
    visit::VisitCost,
};

/// `auv-3 next: 41 m², growing 2 m²/min; auv-1 first would cost 180 m² more`, at the time `now`, s.
pub(crate) fn sentence(schedule: &Schedule, law: &VisitCost, now: f64) -> String {
    let mut said = next(schedule, law, now);
    // Writing to a string does not fail.
    let _ = write!(said, "{}", against_the_best_alternative(schedule));
    for vehicle in &schedule.costs {
        let because = match vehicle.left_out {
            Some(LeftOut::Silent) => "is not heard any more",
            Some(LeftOut::OutOfReach) => "is out of reach",
            Some(LeftOut::TooDeep) => "is too deep",
            None => continue,
        };
        let _ = write!(said, "; {} {because}", vehicle.auv);
    }
    said
}

fn next(schedule: &Schedule, law: &VisitCost, now: f64) -> String {
    let Some(first) = schedule.visits.first() else {
        return "no vehicle can be visited".to_owned();
    };
    let known = schedule.costs.iter().find(|known| known.auv == first.auv);
    let cost = known.map_or(first.cost_before, |known| known.cost);
    let unit = unit(schedule.unit);
    let mut said = if first.arrive_s <= now {
        let stays = short(first.leave_s - now);
        format!("{} now, for another {stays} s", first.auv)
    } else {
        format!("{} next", first.auv)
    };
    let growth = law.unserved(0.0, 60.0).cost;
    let _ = match schedule.unit {
        CostUnit::Seconds => write!(said, ": {} s since it was served", short(cost)),
        CostUnit::SquareMetres | CostUnit::Kilobits => write!(
            said,
            ": {} {unit}, growing {} {unit}/min",
            short(cost),
            short(growth)
        ),
    };
    said
}

/// What it would cost to begin otherwise.
fn against_the_best_alternative(schedule: &Schedule) -> String {
    let Some(other) = schedule.alternatives.first() else {
        return String::new();
    };
    let missed = schedule.deadlines_missed.len();
    if missed < other.deadlines_missed {
        return format!("; {} first would miss a deadline", other.next);
    }
    let (more, unit) = (other.cost - schedule.cost, unit(schedule.unit));
    if other.deadlines_missed < missed || more < 0.0 {
        format!("; {} first would be better, too little to change", other.next)
    } else {
        format!("; {} first would cost {} {unit} more", other.next, short(more))
    }
}

fn unit(unit: CostUnit) -> &'static str {
    match unit {
        CostUnit::Seconds => "s",
        CostUnit::SquareMetres => "m²",
        CostUnit::Kilobits => "kbit",
    }
}

/// Two digits or more of a number.
fn short(value: f64) -> String {
    if value.abs() < 0.995 {
        format!("{value:.2}")
    } else if value.abs() < 9.95 {
        format!("{value:.1}")
    } else {
        format!("{value:.0}")
    }
}
