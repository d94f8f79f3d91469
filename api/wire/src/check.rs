//! Checks of a request: the planner's, and those of the envelope.

use std::mem;

use planner::snapshot::{InvalidRequest, Origin, PlanRequest, SCHEMA_VERSION, Snapshot};
use serde_json::Value;

use super::{DEADLINE_MS, METADATA_BYTES_MAX, positions::wrong_place};
use crate::{CraftFrame, FieldError};

/// The snapshot of `request`, in the frame at the craft if it has an origin. Fails with all faults.
pub fn snapshot(request: PlanRequest) -> Result<Snapshot, Vec<FieldError>> {
    snapshot_until(request, &|| false)
}

/// As [`snapshot`]; once `due`, estimates use only the newest reports.
pub fn snapshot_until(mut request: PlanRequest, due: &dyn Fn() -> bool) -> Result<Snapshot, Vec<FieldError>> {
    let mut envelope = envelope_faults(&request);
    if request.origin.is_some() {
        // Before the change of frame, which changes the numbers; the envelope has none of them.
        all(mem::take(&mut envelope), request.check())?;
        let craft = request.asc.position();
        CraftFrame::enter(&mut request, craft);
    }
    all(envelope, Snapshot::until(request, due))
}

/// `request` with the defaults of its `snapshot`.
pub fn with_defaults(request: PlanRequest, snapshot: &Snapshot) -> PlanRequest {
    PlanRequest { limits: snapshot.limits, craft: snapshot.craft.clone(), ..request }
}

/// Fails with every wrong field of `request`, as [`snapshot`] does. Estimates nothing.
pub fn check(request: &PlanRequest) -> Result<(), Vec<FieldError>> {
    all(envelope_faults(request), request.check())
}

/// Fails with the faults of the envelope and then those of the planner.
fn all<T>(envelope: Vec<FieldError>, checked: Result<T, InvalidRequest>) -> Result<T, Vec<FieldError>> {
    match checked {
        Ok(valid) if envelope.is_empty() => Ok(valid),
        Ok(_) => Err(envelope),
        Err(InvalidRequest(fields)) => Err([envelope, fields].concat()),
    }
}

/// The fault of a `schema_version`, if it has one.
pub fn unsupported_version(given: &str) -> Option<FieldError> {
    (given != SCHEMA_VERSION).then(|| {
        let detail = format!("this service speaks version {SCHEMA_VERSION}");
        FieldError::new("/schema_version", "unsupported", detail).given(given).limit(SCHEMA_VERSION)
    })
}

/// Faults of the members that the planner does not read.
pub(crate) fn envelope_faults(request: &PlanRequest) -> Vec<FieldError> {
    let mut invalid = Vec::from_iter(unsupported_version(&request.schema_version));
    let previous = request.previous_plan.as_ref().and_then(|plan| plan.origin);
    let place = "/previous_plan/origin";
    invalid.extend(previous.iter().flat_map(|before| origin_faults(before, request.origin.as_ref(), place)));
    invalid.extend(request.origin.iter().filter_map(|origin| wrong_place(origin, "/origin")));
    let deadline = request.deadline_ms;
    invalid.extend(deadline.and_then(|given| FieldError::outside("/deadline_ms", given, &DEADLINE_MS)));
    let bytes = Value::Object(request.metadata.clone()).to_string().len();
    let range = 0..=METADATA_BYTES_MAX;
    invalid.extend(FieldError::of_length("/metadata", bytes, &range, "bytes"));
    invalid
}

/// The faults of the origin of a previous plan, at `place`, before a request with this `origin`.
pub(crate) fn origin_faults(before: &Origin, origin: Option<&Origin>, place: &str) -> Vec<FieldError> {
    let mut invalid = Vec::from_iter(wrong_place(before, place));
    if origin.is_some_and(|origin| origin != before) {
        let detail = "the previous plan has another origin: leave it out of the first request after a change";
        invalid.push(FieldError::new(place, "contradicts", detail));
    }
    invalid
}
