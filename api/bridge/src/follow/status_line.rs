//! The status line that the bridge logs.

use std::fmt;

use ::mavlink::dialects::ardupilotmega::MavSeverity;

use super::{Bridge, Sending};
use crate::{
    Plan,
    mavlink::{Control, HEARTBEAT_AGE_MAX_S, Silence},
    mission_link::LinkStatus,
};

/// Warnings of a plan that say that the craft does not do what it is told.
const NOT_FOLLOWED: [&str; 3] = [
    "craft_does_not_follow",
    "heading_does_not_respond",
    "speed_does_not_respond",
];

/// Whether the craft is steered, for those who watch.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Steering {
    /// References are sent.
    On,
    /// The same, but not as it should be, and why.
    Degraded(String),
    /// Nothing is sent.
    Off(Silence),
}

impl Steering {
    fn severity(&self) -> MavSeverity {
        match self {
            Self::On => MavSeverity::MAV_SEVERITY_INFO,
            Self::Degraded(_) => MavSeverity::MAV_SEVERITY_WARNING,
            Self::Off(silence) if silence.is_meant() => MavSeverity::MAV_SEVERITY_NOTICE,
            Self::Off(_) => MavSeverity::MAV_SEVERITY_CRITICAL,
        }
    }
}

impl fmt::Display for Steering {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::On => f.write_str("steering"),
            Self::Degraded(why) => write!(f, "DEGRADED: {why}"),
            Self::Off(silence) => {
                let state = if silence.is_meant() {
                    "not steering"
                } else {
                    "NOT STEERING"
                };
                // What follows from it stands in the log.
                let text = silence.to_string();
                let cause = text.split([':', ';']).next().unwrap_or_default();
                write!(f, "{state}: {cause}")
            }
        }
    }
}

impl Bridge {
    /// Whether the craft is steered; none before the first tick and in a dry run.
    fn steering(&self, link: &LinkStatus) -> Option<Steering> {
        if self.settings.dry_run {
            return None;
        }
        if let Sending::Stopped(silence) = self.logged? {
            return Some(Steering::Off(silence));
        }
        let alarms = self.telemetry.craft.alarms().map(|alarm| alarm.to_string());
        let mut why: Vec<_> = alarms.collect();
        if let Some(plan) = &link.plan {
            let codes = plan.warnings.iter().map(String::as_str);
            let not_followed = codes.filter(|code| NOT_FOLLOWED.contains(code));
            why.extend(not_followed.map(|code| code.replace('_', " ")));
            why.extend(plan.is_degraded.then(|| plan.method.clone()));
        }
        Some(if why.is_empty() {
            Steering::On
        } else {
            Steering::Degraded(why.join("; "))
        })
    }

    /// Tells the ground station whether the craft is steered, once that has changed for a second.
    pub(super) fn tell_ground_station(&mut self, link: &LinkStatus) {
        let steering = self.steering(link);
        if let Some(steering) = &steering
            && self.steering.as_ref() == Some(steering)
            && self.steering_told.as_ref() != Some(steering)
        {
            let text = format!("Pilotfish {steering}");
            self.autopilot.send_text(steering.severity(), &text);
            self.steering_told = Some(steering.clone());
        }
        self.steering = steering;
    }

    /// Whether the craft is steered, mode, plan, reference, fixes and rejected input in one line.
    pub(super) fn status_line(&self, link: &LinkStatus) -> String {
        let now = self.now_s();
        let mode = match self.autopilot.control(now) {
            Control::Reported(Some((heartbeat, age))) if age <= HEARTBEAT_AGE_MAX_S => heartbeat.mode_name(),
            Control::Reported(Some((_, age))) => format!("autopilot heard {age:.0} s ago"),
            Control::Reported(None) => "no autopilot".to_owned(),
            Control::Unreported => "mode unknown".to_owned(),
        };
        let dry_run = self.settings.dry_run.then(|| "dry run".to_owned());
        let steering = self.steering(link).map(|steering| steering.to_string());
        let mut parts: Vec<_> = dry_run.into_iter().chain(steering).collect();
        parts.push(mode);
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

    /// The plan, with its reference at a speed of `speed_max` at most, m/s: a faster one is not sent. What one says that is too old to
    /// follow is not true any more.
    fn plan_status(&self, plan: &Plan, now: f64, speed_max: f64) -> Vec<String> {
        let age = now - plan.planned.planned_s;
        let mut parts = Vec::new();
        if let Some(reference) = self.reference(plan, now) {
            let heading = reference.heading.to_degrees().rem_euclid(360.0);
            let speed = reference.speed.min(speed_max);
            parts.extend([
                plan.method.clone(),
                format!("{:.1} m from the goal", plan.distance_m),
                format!("plan {age:.1} s old"),
                format!("{speed:.2} m/s {heading:03.0}°"),
                plan.estimate.clone(),
            ]);
            parts.extend(plan.warnings.iter().cloned());
        } else {
            parts.push(format!("last plan {age:.0} s ago"));
        }
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

    /// A bridge without a wire, and a plan made now, whose answer is changed.
    fn bridge_and_link(change: impl Fn(&mut serde_json::Value)) -> (Bridge, LinkStatus) {
        let connect = Endpoint::Udp("127.0.0.1:0".to_owned());
        let bridge = Bridge::open(AutopilotSettings::Nmea { connect }, Settings::default());
        let point = json!({ "t_s": 0.0, "north_m": 0.0, "east_m": 0.0, "speed_mps": 20.0, "heading_rad": 0.0, "valid_until_s": 1e3 });
        let plan = json!({ "method": "mpc", "outcome": "ok", "trajectory": [point], "reference": point, "baseline": point, "goal": { "trajectory": [point] } });
        let mut answer = json!({ "t_s": 0.0, "age_s": 0.0, "plan": plan });
        change(&mut answer);
        let link = LinkStatus {
            plan: Plan::from_answer(&answer, bridge.now_s(), bridge.now_s()),
            setting: json!({ "limits": { "speed_max_mps": 1.2 } }),
            ..LinkStatus::default()
        };
        (bridge, link)
    }

    #[test]
    fn the_line_begins_with_whether_the_craft_is_steered_and_why_not() {
        let begins = |sending, change: &dyn Fn(&mut serde_json::Value), with: &str| {
            let (mut bridge, link) = bridge_and_link(change);
            bridge.logged = Some(sending);
            let line = bridge.status_line(&link);
            assert!(line.starts_with(with), "{line}");
        };
        begins(
            Sending::Active,
            &|_| {},
            "steering, mode unknown, mpc ok, 0.0 m from",
        );
        let lost = Sending::Stopped(Silence::NoHeartbeat);
        begins(lost, &|_| {}, "NOT STEERING: no heartbeat of the autopilot, ");
        let paused = Sending::Stopped(Silence::MissionPaused);
        begins(paused, &|_| {}, "not steering: the mission is paused, ");
        let deaf = |answer: &mut serde_json::Value| {
            answer["plan"]["warnings"] = json!([{ "code": "heading_does_not_respond" }]);
        };
        begins(Sending::Active, &deaf, "DEGRADED: heading does not respond, ");
        let degraded = |answer: &mut serde_json::Value| answer["plan"]["outcome"] = json!("degraded");
        begins(Sending::Active, &degraded, "DEGRADED: mpc degraded, ");
    }

    #[test]
    fn what_a_plan_said_that_is_too_old_is_not_repeated() {
        let (bridge, link) = bridge_and_link(|answer| {
            answer["age_s"] = json!(40.0);
            answer["plan"]["reference"]["valid_until_s"] = json!(20.0);
        });
        let line = bridge.status_line(&link);
        assert!(line.contains("last plan 40 s ago"), "{line}");
        assert!(!line.contains("goal") && !line.contains("ok"), "{line}");
    }

    #[test]
    fn the_ground_station_is_told_once_a_state_has_lasted_a_second() {
        let (mut bridge, link) = bridge_and_link(|_| {});
        bridge.logged = Some(Sending::Active);
        bridge.tell_ground_station(&link);
        assert_eq!(bridge.steering_told, None);
        bridge.tell_ground_station(&link);
        assert_eq!(bridge.steering_told, Some(Steering::On));
        // One second of silence is not told.
        bridge.logged = Some(Sending::Stopped(Silence::PlanStale));
        bridge.tell_ground_station(&link);
        bridge.logged = Some(Sending::Active);
        bridge.tell_ground_station(&link);
        bridge.tell_ground_station(&link);
        assert_eq!(bridge.steering_told, Some(Steering::On));
    }

    #[test]
    fn the_speed_shown_is_one_that_may_be_sent() {
        let (bridge, link) = bridge_and_link(|_| {});
        let line = bridge.status_line(&link);
        assert!(line.contains(", 1.20 m/s 000°"), "{line}");
    }
}
