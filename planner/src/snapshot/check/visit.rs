//! Checks of visit goals, and of returned schedules.

use std::collections::BTreeMap;

use super::Check;
use crate::facts::{
    auv::VehicleId,
    field_error::pointer_token,
    ranges::{GOAL_VISIT, SERVED_VEHICLE, TIME, VISIT, VISIT_COST, WEIGHT},
    schedule::Schedule,
    visit::Visits,
};

const NOT_NAMED: &str = "only vehicles in goal/auvs count";

impl Check {
    pub(super) fn visits(&mut self, visits: &Visits) {
        self.numbers("/goal", &GOAL_VISIT, [visits.within(), visits.dwell_min()]);
        let _ = visits.cost.map(&mut self.each_within("/goal/cost"));
        let by_name = [
            ("weights", &visits.weights, WEIGHT),
            ("serve_by_s", &visits.serve_by_s, TIME),
            ("costs_now", &visits.costs_now, VISIT_COST),
        ];
        for (member, values, range) in by_name {
            self.each_named(member, values, &visits.auvs, &range);
        }
        if visits.auvs.iter().all(|id| visits.weight(id) == 0.0) {
            self.no_weight();
        }
        if visits.next.as_ref().is_some_and(|id| !visits.auvs.contains(id)) {
            self.fail(format_args!("/goal/next"), "unexpected", NOT_NAMED);
        }
    }

    pub(super) fn each_named(
        &mut self,
        member: &str,
        values: &BTreeMap<VehicleId, f64>,
        named: &[VehicleId],
        range: &std::ops::RangeInclusive<f64>,
    ) {
        for (id, value) in values {
            let name = pointer_token(&id.0);
            if !named.contains(id) {
                self.fail(format_args!("/goal/{member}/{name}"), "unexpected", NOT_NAMED);
            }
            self.within(format_args!("/goal/{member}/{name}"), *value, range);
        }
    }

    pub(super) fn schedule(&mut self, schedule: &Schedule) {
        let field = "/previous_plan/schedule";
        for (i, visit) in schedule.visits.iter().enumerate() {
            let values = [
                visit.arrive_s,
                visit.leave_s,
                visit.north_m,
                visit.east_m,
                visit.cost_before,
                visit.cost_after,
            ];
            self.numbers(&format!("{field}/visits/{i}"), &VISIT, values);
        }
        for (i, vehicle) in schedule.costs.iter().enumerate() {
            self.numbers(
                &format!("{field}/costs/{i}"),
                &SERVED_VEHICLE,
                [vehicle.cost, vehicle.heard_within_m, vehicle.unheard_s],
            );
            if let Some(served_by) = vehicle.served_by_s {
                self.within(format_args!("{field}/costs/{i}/served_by_s"), served_by, &TIME);
            }
        }
    }
}
