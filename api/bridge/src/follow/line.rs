//! How it goes, for people who look over the craft's shoulder.

use super::Bridge;
use crate::{PlanNow, mavlink::Control, mission_link::LinkNow};

impl Bridge {
    /// How it goes, in one line.
    pub(super) fn line(&self, link: &LinkNow) -> String {
        let now = self.now_s();
        let mode = match self.helm.control(now) {
            Control::Reported(Some((heartbeat, _))) => heartbeat.mode_name(),
            Control::Reported(None) => "no autopilot".to_owned(),
            Control::Unreported => "mode unknown".to_owned(),
        };
        let mut parts = vec![mode];
        if let Some(plan) = &link.plan {
            parts.extend(self.of_plan(plan, now));
        }
        let heard = self.seen.fixes.iter();
        parts.extend(heard.map(|(auv, (_, at, _))| format!("{auv} heard {:.0} s ago", now - at)));
        let refused = link.refused.iter();
        parts.extend(refused.map(|(count, why)| format!("{count} reports refused ({why})")));
        let wires = self.refused().filter(|refused| refused.total() > 0);
        parts.extend(wires.map(|refused| format!("not understood: {refused}")));
        parts.join(", ")
    }

    fn of_plan(&self, plan: &PlanNow, now: f64) -> Vec<String> {
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
        parts.push(plan.learnt.clone());
        parts.extend(plan.warnings.iter().cloned());
        if !plan.waits_for.is_empty() {
            parts.push(format!("waits for {}", plan.waits_for.join(" and ")));
        }
        parts
    }
}
