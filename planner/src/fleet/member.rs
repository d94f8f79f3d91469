//! A craft of a fleet as a request describes it, and the faults of all.

use nalgebra::Vector2;

use crate::facts::angle::Course;
use crate::facts::auv::{Auv, VehicleId};
use crate::facts::evidence::AuvState;
use crate::facts::field_error::FieldError;
use crate::facts::goal::Goal;
use crate::facts::ranges::AUVS_MAX;
use crate::snapshot::check::InvalidRequest;
use crate::snapshot::request::PlanRequest;

/// The members of a request that each craft has for itself.
const OWN: [&str; 4] = ["/previous_plan", "/asc", "/craft", "/limits"];

/// A craft of a fleet.
#[derive(Clone, Debug)]
pub struct Member {
    /// Its name.
    pub id: VehicleId,
    /// The AUVs that it may serve; all without a list.
    pub serves: Option<Vec<VehicleId>>,
    /// `true` if it serves nobody for now: the others see it go straight on.
    pub is_away: bool,
    /// Its place in the previous answer, which faults name.
    pub place_before: usize,
    /// What it would plan for alone: `asc`, `craft`, `limits` and `previous_plan` are its own.
    pub request: PlanRequest,
}

impl Member {
    /// The faults of the fleet of `members`, at least one, by field of its request. Of those that
    /// are `gone` only the previous plan counts, and `serves`. If a list is too long, that alone.
    pub fn faults(members: &[Self], gone: &[Self]) -> Vec<FieldError> {
        let request = &members[0].request;
        let mut faults = request.check().err().map_or_else(Vec::new, |InvalidRequest(faults)| faults);
        for (i, member) in members.iter().enumerate() {
            let serves = member.serves.iter().map(Vec::len).max().unwrap_or(0);
            let place = format!("/surface_craft/{i}/serves");
            faults.extend(FieldError::of_length(place, serves, &(0..=AUVS_MAX), "items"));
        }
        members[0].name(0, &mut faults);
        if faults.iter().any(|fault| fault.code == "length") {
            return faults;
        }
        for (i, member) in members.iter().chain(gone).enumerate().skip(1) {
            let mut own = member.own_request().check().err().map_or_else(Vec::new, |InvalidRequest(own)| own);
            let members_of = if i < members.len() { &OWN[..] } else { &OWN[..1] };
            own.retain(|fault| members_of.iter().any(|own| fault.pointer.starts_with(own)));
            member.name(i, &mut own);
            faults.extend(own);
        }
        for (i, member) in members.iter().enumerate() {
            let place = format!("/surface_craft/{i}/id");
            faults.extend(member.id.faults(&place));
            let is_taken = members[..i].iter().any(|other| other.id == member.id)
                || request.traffic.iter().any(|vessel| vessel.id == member.id);
            if is_taken {
                faults.push(FieldError::new(&place, "duplicate", "duplicate name").given(&*member.id.0));
            }
            let is_known = |id: &VehicleId| request.auvs.iter().any(|auv| auv.id == *id);
            let served = member.serves.iter().flatten().enumerate();
            for (j, id) in served.filter(|(_, id)| !is_known(id)) {
                let place = format!("/surface_craft/{i}/serves/{j}");
                faults
                    .push(FieldError::new(place, "unknown_vehicle", "names no AUV of `auvs`").given(&*id.0));
            }
        }
        for id in request.goal.goal.vehicles() {
            if !members.iter().chain(gone).any(|member| member.may_serve(id)) {
                let detail = "no craft may serve this AUV: add it to the `serves` of one";
                faults.push(FieldError::new("/goal", "unserved", detail).given(&*id.0));
            }
        }
        for (i, auv) in request.auvs.iter().enumerate() {
            let reports = auv.reports.iter().flatten().enumerate();
            for (j, _) in reports.filter(|(_, report)| report.is_range() && report.from.is_none()) {
                let detail = "say where the craft was that measured this range: a fleet has several";
                faults.push(FieldError::new(format!("/auvs/{i}/reports/{j}/from"), "missing", detail));
            }
        }
        faults
    }

    /// `true` if it may serve the AUV, when it is not away.
    pub(super) fn may_serve(&self, id: &VehicleId) -> bool {
        self.serves.as_ref().is_none_or(|serves| serves.contains(id))
    }

    /// Its own members, in a request that is valid without them.
    fn own_request(&self) -> PlanRequest {
        let PlanRequest { t_s, asc, craft, limits, previous_plan, .. } = &self.request;
        let auv = AuvState::new(Vector2::zeros(), 0.0, Course::new(0.0), 0.0);
        let goal = Goal::Track { auv: "auv".into() };
        PlanRequest {
            craft: craft.clone(),
            limits: *limits,
            previous_plan: previous_plan.clone(),
            ..PlanRequest::new(*t_s, *asc, vec![Auv::new("auv", auv)], goal)
        }
    }

    /// Names the fields of a fleet's request in the faults of this one, the craft at index `i`.
    fn name(&self, i: usize, faults: &mut [FieldError]) {
        for fault in faults {
            if OWN[1..].iter().any(|own| fault.pointer.starts_with(own)) {
                fault.pointer = format!("/surface_craft/{i}{}", fault.pointer);
            } else if let Some(rest) = fault.pointer.strip_prefix("/previous_plan") {
                fault.pointer = format!("/previous_plan/surface_craft/{}/plan{rest}", self.place_before);
            }
        }
    }
}
