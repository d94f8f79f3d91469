//! What all craft know of the AUVs together.

use planner::snapshot::{Auv, PlanRequest, Report};

/// Largest number of reports of an AUV that are told, the newest.
const REPORTS_TOLD: usize = 32;

/// The AUVs as all craft of `requests`, at least one, know them together, by the newest.
pub(super) fn shared(requests: &[PlanRequest]) -> Vec<Auv> {
    let auv = |place: usize| {
        let known = requests.iter().map(|request| &request.auvs[place]);
        let newest = known.clone().max_by(|a, b| newness(a).total_cmp(&newness(b)));
        let mut auv = newest.unwrap_or(&requests[0].auvs[place]).clone();
        if auv.reports.is_some() {
            let mut reports: Vec<Report> = known.filter_map(|auv| auv.reports.clone()).flatten().collect();
            reports.sort_by(|a, b| a.t_s.total_cmp(&b.t_s));
            // All were told of the launch.
            reports.dedup();
            reports.drain(..reports.len().saturating_sub(REPORTS_TOLD));
            auv.reports = Some(reports);
        }
        auv
    };
    (0..requests[0].auvs.len()).map(auv).collect()
}

/// Time of the newest report, s, or minus the age of the state.
fn newness(auv: &Auv) -> f64 {
    let reported = auv.reports.iter().flatten().map(|report| report.t_s).reduce(f64::max);
    reported.or(auv.state.map(|state| -state.age_s)).unwrap_or(f64::NEG_INFINITY)
}
