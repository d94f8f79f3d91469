//! One sentence that explains a schedule to the operator.

use std::fmt::Write;

use crate::facts::{
    auv::VehicleId,
    schedule::{CostUnit, LeftOut, Schedule},
    visit::VisitCost,
};

/// The reason for a first visit, if it is not the cost.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Reason {
    /// The goal asks for it.
    Asked,
    /// Its deadline passed this long ago, s.
    Late(f64),
}

/// `auv-3 next: 41 m², growing 2 m²/min; auv-1 first would cost 180 m² more`, at the time `now`, s,
/// with the `reason`, if any, and the changes since the schedule `before`.
pub(crate) fn sentence(
    schedule: &Schedule,
    law: &VisitCost,
    now: f64,
    reason: Option<Reason>,
    before: Option<&Schedule>,
) -> String {
    let mut said = next(schedule, law, now);
    let _ = match reason {
        None => Ok(()),
        Some(Reason::Asked) => write!(said, "; as the goal asks"),
        Some(Reason::Late(late)) => write!(said, "; its deadline was {} s ago", short(late)),
    };
    if let Some(visited) = &schedule.next_visited {
        let _ = write!(said, "; {visited} was visited as the goal asks");
    }
    let changed = before.map_or_else(String::new, |before| changed(schedule, before, now));
    // Writing to a string does not fail.
    if reason.is_none() {
        said += &cost_of_alternative(schedule);
    }
    said += &changed;
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

/// AUVs that can be visited again or are gone, and the cost of the former next visit. All AUVs that
/// cannot be visited any more are named.
fn changed(schedule: &Schedule, before: &Schedule, now: f64) -> String {
    let mut said = String::new();
    let of =
        |schedule: &Schedule, auv: &VehicleId| schedule.costs.iter().find(|known| known.auv == *auv).cloned();
    for vehicle in schedule.costs.iter().filter(|vehicle| vehicle.left_out.is_none()) {
        let news = match of(before, &vehicle.auv).map(|known| known.left_out) {
            None => "is new",
            Some(Some(LeftOut::Silent)) => "is heard again",
            Some(Some(LeftOut::OutOfReach | LeftOut::TooDeep)) => "can be visited again",
            Some(None) => continue,
        };
        let _ = write!(said, "; {} {news}", vehicle.auv);
    }
    for gone in before
        .costs
        .iter()
        .filter(|known| of(schedule, &known.auv).is_none())
    {
        let _ = write!(said, "; {} is not in the goal any more", gone.auv);
    }
    let was = before
        .visits
        .iter()
        .find(|visit| now < visit.leave_s && !schedule.kept);
    // An AUV served since then needs no visit.
    let unserved = |auv: &VehicleId| {
        let costs = of(before, auv).zip(of(schedule, auv));
        costs.is_some_and(|(then, now)| then.cost <= now.cost)
    };
    let mut others = schedule.alternatives.iter();
    let was = was.filter(|was| unserved(&was.auv));
    if let Some(was) = was.and_then(|was| others.find(|other| other.next == was.auv)) {
        let more = 100.0 * (was.cost / schedule.cost - 1.0);
        if 0.0 <= more && more.is_finite() {
            let _ = write!(
                said,
                "; {}, next until now, would cost {} % more",
                was.next,
                short(more)
            );
        }
    }
    said
}

/// The additional cost of the best alternative.
fn cost_of_alternative(schedule: &Schedule) -> String {
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

/// A number with at least two digits.
fn short(value: f64) -> String {
    if value.abs() < 0.995 {
        format!("{value:.2}")
    } else if value.abs() < 9.95 {
        format!("{value:.1}")
    } else {
        format!("{value:.0}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::facts::schedule::{Alternative, ServedVehicle, Visit};

    const VARIANCE: VisitCost = VisitCost::Uncertainty {
        growth_m2ps: 1.0 / 30.0,
        sigma_m: 1.5,
        sigma_rad: 0.02,
        interval_s: 10.0,
    };

    fn schedule() -> Schedule {
        Schedule {
            unit: CostUnit::SquareMetres,
            visits: vec![Visit {
                auv: "auv-3".into(),
                arrive_s: 130.0,
                leave_s: 190.0,
                north_m: 0.0,
                east_m: 100.0,
                cost_before: 42.0,
                cost_after: 2.0,
            }],
            costs: vec![ServedVehicle {
                auv: "auv-3".into(),
                cost: 41.0,
                served_by_s: None,
                heard_within_m: 0.0,
                unheard_s: 0.0,
                left_out: None,
            }],
            cost: 20.0,
            bound: 5.0,
            gap: 0.75,
            exact: true,
            alternatives: vec![Alternative {
                next: "auv-1".into(),
                cost: 200.0,
                deadlines_missed: 0,
            }],
            deadlines_missed: Vec::new(),
            sentence: String::new(),
            kept: false,
            next_visited: None,
        }
    }

    #[test]
    fn a_sentence_names_the_next_auv_the_reason_and_the_cost_of_the_alternative() {
        let mut schedule = schedule();
        let said = |schedule: &Schedule| sentence(schedule, &VARIANCE, 100.0, None, None);
        assert_eq!(
            said(&schedule),
            "auv-3 next: 41 m², growing 2.0 m²/min; auv-1 first would cost 180 m² more"
        );
        schedule.alternatives[0].deadlines_missed = 1;
        assert!(said(&schedule).ends_with("; auv-1 first would miss a deadline"));
        schedule.alternatives[0] = Alternative {
            cost: 19.5,
            deadlines_missed: 0,
            ..schedule.alternatives[0].clone()
        };
        assert!(said(&schedule).ends_with("; auv-1 first would be better, too little to change"));
        schedule.visits[0].arrive_s = 80.0;
        schedule.costs[0].left_out = Some(LeftOut::OutOfReach);
        schedule.alternatives.clear();
        assert_eq!(
            said(&schedule),
            "auv-3 now, for another 90 s: 41 m², growing 2.0 m²/min; auv-3 is out of reach"
        );
        schedule.visits.clear();
        assert!(said(&schedule).starts_with("no vehicle can be visited"));
    }
    #[test]
    fn a_sentence_explains_a_change() {
        let (before, mut after) = (schedule(), schedule());
        let said = |after: &Schedule| sentence(after, &VARIANCE, 100.0, None, Some(&before));
        assert_eq!(said(&after), sentence(&after, &VARIANCE, 100.0, None, None));
        // Another one is better by a tenth.
        after.visits[0].auv = "auv-1".into();
        after.alternatives[0] = Alternative {
            next: "auv-3".into(),
            cost: 22.0,
            deadlines_missed: 0,
        };
        assert!(said(&after).ends_with("; auv-3, next until now, would cost 10 % more"));
        // The AUV was served on the way.
        after.costs[0].cost = 3.0;
        assert!(!said(&after).contains("next until now"));
        after.costs[0].auv = "auv-4".into();
        assert!(said(&after).ends_with("; auv-4 is new; auv-3 is not in the goal any more"));
        let mut silent = schedule();
        silent.costs[0].left_out = Some(LeftOut::Silent);
        let again = sentence(&schedule(), &VARIANCE, 100.0, None, Some(&silent));
        assert!(again.ends_with("; auv-3 is heard again"));
    }
}
