//! One sentence that explains a schedule to the operator.

use std::fmt::Write;

use crate::facts::auv::VehicleId;
use crate::facts::schedule::{CostUnit, LeftOut, Schedule};
use crate::facts::visit::VisitCost;

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
        CostUnit::SquareMetres | CostUnit::Kilobits => {
            write!(said, ": {} {unit}, growing {} {unit}/min", short(cost), short(growth))
        }
    };
    said
}

/// AUVs that can be visited again or are gone, and the cost of the former next visit.
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
    for gone in before.costs.iter().filter(|known| of(schedule, &known.auv).is_none()) {
        let _ = write!(said, "; {} is not in the goal any more", gone.auv);
    }
    let was = before.visits.iter().find(|visit| now < visit.leave_s && !schedule.kept);
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
            let _ = write!(said, "; {}, next until now, would cost {} % more", was.next, short(more));
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
    use serde_json::json;

    use super::*;
    use crate::facts::visit::Fixes;

    const VARIANCE: VisitCost = VisitCost::Uncertainty {
        fixes: Fixes::Usbl,
        growth_m2ps: 1.0 / 30.0,
        sigma_m: 1.5,
        sigma_rad: 0.02,
        interval_s: 10.0,
    };

    /// auv-3 from 130 s on, rather than auv-1, at a tenth of the cost.
    fn schedule() -> Schedule {
        let visit = json!({
            "auv": "auv-3", "arrive_s": 130.0, "leave_s": 190.0, "north_m": 0.0, "east_m": 100.0,
            "cost_before": 42.0, "cost_after": 2.0,
        });
        let schedule = json!({
            "unit": "m2", "visits": [visit], "costs": [{ "auv": "auv-3", "cost": 41.0 }],
            "cost": 20.0, "bound": 5.0, "gap": 0.75, "exact": true, "sentence": "", "kept": false,
            "alternatives": [{ "next": "auv-1", "cost": 200.0, "deadlines_missed": 0 }],
        });
        serde_json::from_value(schedule).expect("is a schedule")
    }

    fn said(schedule: &Schedule, before: Option<&Schedule>) -> String {
        sentence(schedule, &VARIANCE, 100.0, None, before)
    }

    #[track_caller]
    fn ends(said: &str, with: &str) {
        assert!(said.ends_with(with), "{said}");
    }

    #[test]
    fn a_sentence_names_the_next_auv_the_reason_and_the_cost_of_the_alternative() {
        let mut schedule = schedule();
        let state = "41 m², growing 2.0 m²/min;";
        let expected = format!("auv-3 next: {state} auv-1 first would cost 180 m² more");
        assert_eq!(said(&schedule, None), expected);
        schedule.alternatives[0].deadlines_missed = 1;
        ends(&said(&schedule, None), "; auv-1 first would miss a deadline");
        (schedule.alternatives[0].deadlines_missed, schedule.alternatives[0].cost) = (0, 19.5);
        ends(&said(&schedule, None), "; auv-1 first would be better, too little to change");
        schedule.visits[0].arrive_s = 80.0;
        schedule.costs[0].left_out = Some(LeftOut::OutOfReach);
        schedule.alternatives.clear();
        let expected = format!("auv-3 now, for another 90 s: {state} auv-3 is out of reach");
        assert_eq!(said(&schedule, None), expected);
        schedule.visits.clear();
        assert!(said(&schedule, None).starts_with("no vehicle can be visited"));
    }
    #[test]
    fn a_sentence_explains_a_change() {
        let (before, mut after) = (schedule(), schedule());
        assert_eq!(said(&after, Some(&before)), said(&after, None));
        // Another one is better by a tenth.
        after.visits[0].auv = "auv-1".into();
        (after.alternatives[0].next, after.alternatives[0].cost) = ("auv-3".into(), 22.0);
        ends(&said(&after, Some(&before)), "; auv-3, next until now, would cost 10 % more");
        // The AUV was served on the way.
        after.costs[0].cost = 3.0;
        assert!(!said(&after, Some(&before)).contains("next until now"));
        after.costs[0].auv = "auv-4".into();
        ends(&said(&after, Some(&before)), "; auv-4 is new; auv-3 is not in the goal any more");
        let mut silent = schedule();
        silent.costs[0].left_out = Some(LeftOut::Silent);
        ends(&said(&schedule(), Some(&silent)), "; auv-3 is heard again");
    }
}
