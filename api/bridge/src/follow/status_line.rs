//! The status line that the bridge logs.

use super::Bridge;
use crate::{Plan, mavlink::Control, mission_link::LinkStatus};

impl Bridge {
    /// Mode, plan, reference, fixes and rejected input in one line.
    pub(super) fn status_line(&self, link: &LinkStatus) -> String {
        let now = self.now_s();
        let mode = match self.autopilot.control(now) {
            Control::Reported(Some((heartbeat, _))) => heartbeat.mode_name(),
            Control::Reported(None) => "no autopilot".to_owned(),
            Control::Unreported => "mode unknown".to_owned(),
        };
        let mut parts = vec![mode];
        if let Some(plan) = &link.plan {
            parts.extend(self.plan_status(plan, now));
        }
        let craft = &self.telemetry.craft;
        parts.extend(craft.missing(now).map(str::to_owned));
        parts.extend(craft.alarms().map(|alarm| format!("WARNING {alarm}")));
        let fixes = self.telemetry.fixes.iter();
        parts.extend(fixes.map(|(auv, (_, at, count))| {
            let fixes = if *count == 1 { "fix" } else { "fixes" };
            format!("{auv} heard {:.0} s ago, {count} {fixes}", now - at)
        }));
        let rejected = link.rejected.iter();
        parts.extend(rejected.map(|(count, why)| format!("{count} reports rejected ({why})")));
        if link.clamped.total() > 0 {
            parts.push(format!("values clamped: {}", link.clamped));
        }
        let wires = self.rejects().filter(|rejects| rejects.total() > 0);
        parts.extend(wires.map(|rejects| format!("input rejected: {rejects}")));
        let changes = self.limiter.changes();
        if changes.total() > 0 {
            parts.push(format!("references limited: {changes}"));
        }
        parts.join(", ")
    }

    fn plan_status(&self, plan: &Plan, now: f64) -> Vec<String> {
        let age = now - plan.planned.planned_s;
        let mut parts = vec![
            plan.method.clone(),
            format!("{:.1} m from the goal", plan.distance_m),
            format!("plan {age:.1} s old"),
        ];
        if let Some(reference) = self.reference(plan, now) {
            let heading = reference.heading.to_degrees().rem_euclid(360.0);
            parts.push(format!("{:.2} m/s {heading:03.0}°", reference.speed));
        }
        parts.push(plan.estimate.clone());
        parts.extend(plan.warnings.iter().cloned());
        if !plan.waits_for.is_empty() {
            parts.push(format!("waits for {}", plan.waits_for.join(" and ")));
        }
        parts
    }
}
