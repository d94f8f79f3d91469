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
            parts.extend(self.plan_status(plan, now, self.output_limits(link).speed_max));
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

    /// The plan, with its reference at a speed of `speed_max` at most, m/s: a faster one is not sent.
    fn plan_status(&self, plan: &Plan, now: f64, speed_max: f64) -> Vec<String> {
        let age = now - plan.planned.planned_s;
        let mut parts = vec![
            plan.method.clone(),
            format!("{:.1} m from the goal", plan.distance_m),
            format!("plan {age:.1} s old"),
        ];
        if let Some(reference) = self.reference(plan, now) {
            let heading = reference.heading.to_degrees().rem_euclid(360.0);
            let speed = reference.speed.min(speed_max);
            parts.push(format!("{speed:.2} m/s {heading:03.0}°"));
        }
        parts.push(plan.estimate.clone());
        parts.extend(plan.warnings.iter().cloned());
        if !plan.waits_for.is_empty() {
            parts.push(format!("waits for {}", plan.waits_for.join(" and ")));
        }
        parts
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;
    use crate::{autopilot_link::AutopilotSettings, follow::Settings, wire::Endpoint};

    #[test]
    fn the_speed_shown_is_one_that_may_be_sent() {
        let connect = Endpoint::Udp("127.0.0.1:0".to_owned());
        let bridge = Bridge::open(AutopilotSettings::Nmea { connect }, Settings::default());
        let point = json!({ "t_s": 0.0, "north_m": 0.0, "east_m": 0.0, "speed_mps": 20.0, "heading_rad": 0.0, "valid_until_s": 1e3 });
        let plan = json!({ "trajectory": [point], "reference": point, "baseline": point, "goal": { "trajectory": [point] } });
        let answer = json!({ "t_s": 0.0, "age_s": 0.0, "plan": plan });
        let link = LinkStatus {
            plan: Plan::from_answer(&answer, bridge.now_s(), bridge.now_s()),
            setting: json!({ "limits": { "speed_max_mps": 1.2 } }),
            ..LinkStatus::default()
        };
        let line = bridge.status_line(&link);
        assert!(line.contains(", 1.20 m/s 000°"), "{line}");
    }
}
