//! The status line that the bridge logs.

use ::mavlink::dialects::ardupilotmega::MavSeverity;

use super::{Bridge, Sending, steering::Steering};
use crate::{
    Plan,
    mavlink::{Control, HEARTBEAT_AGE_MAX_S},
    mission_link::LinkStatus,
};

/// Warnings of a plan that say that the craft does not do what it is told.
const NOT_FOLLOWED: [&str; 3] = [
    "craft_does_not_follow",
    "heading_does_not_respond",
    "speed_does_not_respond",
];

/// The warning that an AUV has not been heard for a while. Lost messages alone bring it, so that it is told, and is no alarm.
const NOT_HEARD: &str = "stale_report";

/// Between two texts to the ground station, s: of a lasting alarm, and of a cause that changes.
const ALARM_INTERVAL_S: f64 = 30.0;
const CAUSE_INTERVAL_S: f64 = 10.0;

fn has_warning(link: &LinkStatus, code: &str) -> bool {
    let plan = link.plan.as_ref();
    plan.is_some_and(|plan| plan.warnings.iter().any(|given| given == code))
}

/// What `text` says before what follows from it.
fn cause(text: &str) -> String {
    text.split([':', ';']).next().unwrap_or_default().to_owned()
}

impl Bridge {
    /// Whether the craft is steered; none in a dry run. Silence is an alarm only while nothing but the bridge has the craft: armed, in
    /// its guided mode.
    fn steering(&self, link: &LinkStatus) -> Option<Steering> {
        use MavSeverity::{
            MAV_SEVERITY_CRITICAL, MAV_SEVERITY_INFO, MAV_SEVERITY_NOTICE, MAV_SEVERITY_WARNING,
        };
        if self.settings.dry_run {
            return None;
        }
        let (is_on, severity, cause) = match self.logged {
            None => (false, MAV_SEVERITY_NOTICE, "waiting for the craft".to_owned()),
            Some(Sending::Stopped(silence)) => {
                let is_ours = match self.autopilot.control(self.now_s()) {
                    Control::Reported(heard) => {
                        heard.is_some_and(|(heartbeat, _)| heartbeat.is_guided() && heartbeat.is_armed)
                    }
                    Control::Unreported => true,
                };
                let is_alarm = is_ours && !silence.is_meant();
                let severity = if is_alarm {
                    MAV_SEVERITY_CRITICAL
                } else {
                    MAV_SEVERITY_NOTICE
                };
                (false, severity, cause(&silence.to_string()))
            }
            Some(Sending::Active) => match self.causes(link) {
                causes if !causes.is_empty() => (true, MAV_SEVERITY_WARNING, causes.join("; ")),
                _ if has_warning(link, NOT_HEARD) => (true, MAV_SEVERITY_NOTICE, NOT_HEARD.replace('_', " ")),
                _ => (true, MAV_SEVERITY_INFO, String::new()),
            },
        };
        Some(Steering {
            is_on,
            severity,
            cause,
        })
    }

    /// Why references that are sent are not followed, or are not as good as they should be.
    fn causes(&self, link: &LinkStatus) -> Vec<String> {
        let alarms = self.telemetry.craft.alarms();
        let mut causes: Vec<_> = alarms.map(|alarm| cause(&alarm.to_string())).collect();
        if let Some(plan) = &link.plan {
            let codes = plan.warnings.iter().map(String::as_str);
            let not_followed = codes.filter(|code| NOT_FOLLOWED.contains(code));
            let reason = plan.reason.as_deref().filter(|_| !self.settings.line_of_sight);
            causes.extend(not_followed.chain(reason).map(|code| code.replace('_', " ")));
        }
        causes
    }

    /// Tells the ground station whether the craft is steered once that has changed for a second, and again while it is an alarm.
    pub(super) fn tell_ground_station(&mut self, link: &LinkStatus) {
        let (now, steering) = (self.now_s(), self.steering(link));
        let before = self.steering.take();
        self.steering.clone_from(&steering);
        let Some(steering) = steering.filter(|now| {
            before.is_some_and(|before| (before.is_on, before.severity) == (now.is_on, now.severity))
        }) else {
            return;
        };
        let is_due = self.told.as_ref().is_none_or(|(told, at)| {
            let is_alarm = steering.severity == MavSeverity::MAV_SEVERITY_CRITICAL;
            (told.is_on, told.severity) != (steering.is_on, steering.severity)
                || *told != steering && CAUSE_INTERVAL_S <= now - at
                || is_alarm && ALARM_INTERVAL_S <= now - at
        });
        if is_due {
            self.send_texts(&steering);
            self.told = Some((steering, now));
        }
    }

    fn send_texts(&mut self, steering: &Steering) {
        for text in steering.texts() {
            self.autopilot.send_text(steering.severity, &text);
        }
    }

    /// Tells the ground station that the bridge ends, and why.
    pub(super) fn tell_end(&mut self, severity: MavSeverity, cause: &str) {
        if !self.settings.dry_run {
            self.send_texts(&Steering {
                is_on: false,
                severity,
                cause: cause.to_owned(),
            });
        }
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

    /// The plan, with its reference at a speed of `speed_max` at most, m/s: a faster one is not sent. One that is too old to follow shows only
    /// its age.
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
    use clock::Clock;
    use serde_json::json;

    use super::*;
    use crate::{autopilot_link::AutopilotSettings, follow::Settings, mavlink::Silence, wire::Endpoint};

    /// A bridge without a wire, and a plan made now, whose answer is changed.
    fn bridge_and_link(change: impl Fn(&mut serde_json::Value)) -> (Bridge, LinkStatus) {
        let connect = Endpoint::Udp("127.0.0.1:0".to_owned());
        let clock = Clock::simulated(0.0);
        let autopilot = AutopilotSettings::Nmea { connect };
        let bridge = Bridge::open(&clock, autopilot, Settings::default(), |_, _| Box::new(|_| ()));
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

    #[tokio::test(start_paused = true)]
    async fn the_line_begins_with_whether_the_craft_is_steered_and_why_not() {
        let active = Some(Sending::Active);
        let stopped = |silence| Some(Sending::Stopped(silence));
        let warned = |code: &str| json!([{ "code": code }]);
        let deaf = warned("heading_does_not_respond");
        for (sending, member, value, with) in [
            (
                active,
                "reason",
                json!(null),
                "steering, mode unknown, mpc ok, 0.0 m from",
            ),
            (
                stopped(Silence::NoHeartbeat),
                "reason",
                json!(null),
                "NOT STEERING: no heartbeat of the autopilot, ",
            ),
            (
                stopped(Silence::MissionPaused),
                "reason",
                json!(null),
                "not steering: the mission is paused, ",
            ),
            (active, "warnings", deaf, "DEGRADED: heading does not respond, "),
            (
                active,
                "warnings",
                warned("stale_report"),
                "steering: stale report, mode unknown, ",
            ),
            (active, "reason", json!("deadline"), "DEGRADED: deadline, "),
            (
                None,
                "reason",
                json!(null),
                "not steering: waiting for the craft, ",
            ),
        ] {
            let (mut bridge, link) = bridge_and_link(|answer| answer["plan"][member] = value.clone());
            bridge.logged = sending;
            let line = bridge.status_line(&link);
            assert!(line.starts_with(with), "{line}");
        }
    }

    #[tokio::test(start_paused = true)]
    async fn what_a_plan_said_that_is_too_old_is_not_repeated() {
        let (bridge, link) = bridge_and_link(|answer| {
            answer["age_s"] = json!(40.0);
            answer["plan"]["reference"]["valid_until_s"] = json!(20.0);
        });
        let line = bridge.status_line(&link);
        assert!(line.contains("last plan 40 s ago"), "{line}");
        assert!(!line.contains("goal") && !line.contains("ok"), "{line}");
    }

    #[tokio::test(start_paused = true)]
    async fn the_ground_station_is_told_once_a_state_has_lasted_a_second() {
        let (mut bridge, link) = bridge_and_link(|_| {});
        let mut told = |sending| {
            bridge.logged = Some(sending);
            bridge.tell_ground_station(&link);
            bridge
                .told
                .as_ref()
                .map(|(steering, _)| steering.texts().concat())
        };
        assert_eq!(told(Sending::Active), None);
        let steering = Some("Pilotfish steering".to_owned());
        assert_eq!(told(Sending::Active), steering);
        // One second of silence is not told.
        let stale = Sending::Stopped(Silence::PlanStale);
        assert_eq!(told(stale), steering);
        assert_eq!(told(Sending::Active), steering);
        assert_eq!(told(stale), steering);
        assert_eq!(told(stale), Some("Pilotfish off: the plan is too old".to_owned()));
    }

    #[tokio::test(start_paused = true)]
    async fn the_speed_shown_is_one_that_may_be_sent() {
        let (bridge, link) = bridge_and_link(|_| {});
        let line = bridge.status_line(&link);
        assert!(line.contains(", 1.20 m/s 000°"), "{line}");
    }
}
