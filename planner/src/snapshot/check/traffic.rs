//! Checks of other vessels, and of what an earlier answer did about them.

use std::collections::HashSet;

use super::{Check, found};
use crate::facts::auv::VehicleId;
use crate::facts::field_error::FieldError;
use crate::facts::ranges::{
    FORESEEN, MANOEUVRE, PAST_VESSEL, VESSEL, VESSEL_PLAN, VESSEL_PLAN_LENGTH, VESSEL_SEPARATION,
};
use crate::facts::traffic::{Avoidance, Vessel};

impl Vessel {
    /// Its faults, by member within `field`.
    pub fn faults(&self, field: &str) -> Vec<FieldError> {
        found(|check| check.vessel(field, self))
    }
}

impl Check {
    pub(super) fn traffic(&mut self, vessels: &[Vessel], separation: Option<f64>) {
        let mut seen = HashSet::new();
        for (i, vessel) in vessels.iter().enumerate() {
            let field = format!("/traffic/{i}");
            self.vessel(&field, vessel);
            if !seen.insert(&vessel.id) {
                self.fail_name(format_args!("{field}/id"), "duplicate", "duplicate name", &vessel.id);
            }
        }
        if let Some(separation) = separation {
            self.within(format_args!("/vessel_separation_m"), separation, &VESSEL_SEPARATION);
        }
    }

    fn vessel(&mut self, field: &str, vessel: &Vessel) {
        self.name(&format!("{field}/id"), &vessel.id);
        if let Some(name) = vessel.name.as_ref().filter(|name| !name.is_empty()) {
            self.name(&format!("{field}/name"), &VehicleId(name.clone()));
        }
        let values = [
            vessel.t_s,
            Some(vessel.north_m),
            Some(vessel.east_m),
            vessel.course_rad,
            vessel.speed_mps,
            vessel.heading_rad,
            vessel.length_m,
            vessel.sigma_m,
        ];
        self.given(field, &VESSEL, values);
        let n_planned = vessel.plan.len();
        if !VESSEL_PLAN_LENGTH.contains(&n_planned) {
            return self.length(format_args!("{field}/plan"), n_planned, &VESSEL_PLAN_LENGTH);
        }
        for (i, point) in vessel.plan.iter().enumerate() {
            self.numbers(&format!("{field}/plan/{i}"), &VESSEL_PLAN, *point);
        }
        for (i, pair) in vessel.plan.windows(2).enumerate().filter(|(_, pair)| pair[1][0] <= pair[0][0]) {
            let place = format_args!("{field}/plan/{}/0", i + 1);
            self.invalid.push(FieldError::not_increasing(place, pair[1][0], pair[0][0]));
        }
    }

    pub(super) fn avoidance(&mut self, avoidance: &Avoidance) {
        for (i, past) in avoidance.vessels.iter().enumerate() {
            let values = [past.t_s, past.north_mps, past.east_mps, past.count];
            self.numbers(&format!("/previous_plan/avoidance/vessels/{i}"), &PAST_VESSEL, values);
        }
        for (i, met) in avoidance.encounters.iter().enumerate() {
            let place = format_args!("/previous_plan/avoidance/encounters/{i}/starboard_m");
            self.within(place, met.starboard_m, &FORESEEN);
        }
        if let Some(manoeuvre) = &avoidance.manoeuvre {
            let values = [manoeuvre.heading_rad, manoeuvre.speed_mps, manoeuvre.until_s];
            self.numbers("/previous_plan/avoidance/manoeuvre", &MANOEUVRE, values);
        }
    }
}
