//! The status line that the bridge logs.

use ::mavlink::dialects::ardupilotmega::MavSeverity;

use super::{Bridge, Fixes, Sending, steering::Steering};
use crate::{
    Plan,
    mavlink::{Control, HEARTBEAT_AGE_MAX_S, Silence},
    mission_link::LinkStatus,
};

/// Warnings of a plan that the craft does not respond.
const NOT_FOLLOWED: [&str; 3] = [
    "craft_does_not_follow",
    "heading_does_not_respond",
    "speed_does_not_respond",
];

/// The warning that an AUV is silent. Lost messages alone cause it: it is told, and is no alarm.
const NOT_HEARD: &str = "stale_report";

/// The reason for a missing plan of a silent service.
const SILENT_SERVICE: &str = "the service does not answer";

/// Time without a fix of an AUV after which the plan states if that matters (`NOT_HEARD`), s.
const LATE_MAX_S: f64 = 32.0;

/// Time between two words to the mission, s. After three missing ones the steering is unknown.
const WORD_INTERVAL_S: f64 = 1.0;

/// Time that a state lasts before the ground station is told, s; and time without an alarm before
/// its end is told: an alarm that comes and goes is one alarm (as in ISA-18.2).
const CHANGED_S: f64 = 1.0;
const CLEAR_S: f64 = 10.0;

/// Time between two texts to the ground station, s: of a lasting alarm, and of a changing cause.
const ALARM_INTERVAL_S: f64 = 30.0;
const CAUSE_INTERVAL_S: f64 = 10.0;

/// A cause without its numbers: a growing age is the same cause.
fn words(cause: &str) -> Vec<&str> {
    cause
        .split(' ')
        .filter(|word| word.parse::<f64>().is_err())
        .collect()
}

/// The AUVs that have been silent for a while, in words.
fn not_heard(link: &LinkStatus) -> Option<String> {
    let warnings = link.plan.iter().flat_map(|plan| &plan.warnings);
    let details = warnings
        .filter(|[code, _]| code == NOT_HEARD)
        .map(|[_, detail]| cause(detail));
    let details: Vec<_> = details.collect();
    (!details.is_empty()).then(|| details.join("; "))
}

/// `text` up to its consequence.
fn cause(text: &str) -> String {
    text.split([':', ';']).next().unwrap_or_default().to_owned()
}

impl Bridge {
    /// The state of the steering; `None` in a dry run. Silence is an alarm only while the craft is
    /// armed and in the guided mode, so that no one else steers it.
    pub(super) fn steering(&self, link: &LinkStatus) -> Option<Steering> {
        use MavSeverity::{
            MAV_SEVERITY_CRITICAL, MAV_SEVERITY_INFO, MAV_SEVERITY_NOTICE, MAV_SEVERITY_WARNING,
        };
        if self.settings.dry_run {
            return None;
        }
        let mut is_a_persons = false;
        let (is_on, severity, cause) = match self.logged {
            None => (false, MAV_SEVERITY_NOTICE, "waiting for the craft".to_owned()),
            Some(Sending::Stopped(silence)) => {
                let is_ours = match self.autopilot.control(self.now_s()) {
                    Control::Reported(heard) => {
                        heard.is_some_and(|(heartbeat, _)| heartbeat.may_be_steered())
                    }
                    Control::Unreported => true,
                };
                is_a_persons = matches!(silence, Silence::TakenOver | Silence::NotGuided);
                let is_alarm = is_ours && !silence.is_meant();
                let severity = if is_alarm {
                    MAV_SEVERITY_CRITICAL
                } else {
                    MAV_SEVERITY_NOTICE
                };
                let cause = match &link.trouble {
                    // That is why.
                    Some(_) if matches!(silence, Silence::NoPlan | Silence::PlanStale) => {
                        SILENT_SERVICE.to_owned()
                    }
                    _ => cause(&silence.to_string()),
                };
                (false, severity, cause)
            }
            Some(Sending::Active) => match (self.causes(link), self.unconfirmed(link)) {
                (causes, _) if !causes.is_empty() => (true, MAV_SEVERITY_WARNING, causes.join("; ")),
                (_, missing) if !missing.is_empty() => (true, MAV_SEVERITY_NOTICE, missing.join("; ")),
                _ => (true, MAV_SEVERITY_INFO, String::new()),
            },
        };
        Some(Steering {
            is_on,
            is_a_persons,
            severity,
            cause,
        })
    }

    /// The reasons that references have less effect than they should.
    fn causes(&self, link: &LinkStatus) -> Vec<String> {
        let alarms = self.telemetry.craft.alarms();
        let mut causes: Vec<_> = alarms.map(|alarm| cause(&alarm.to_string())).collect();
        if let Some(plan) = &link.plan {
            let codes = plan.warnings.iter().map(|[code, _]| code.as_str());
            let not_followed = codes.filter(|code| NOT_FOLLOWED.contains(code));
            let reason = plan.reason.as_deref().filter(|_| !self.settings.line_of_sight);
            causes.extend(not_followed.chain(reason).map(|code| code.replace('_', " ")));
        }
        causes
    }

    /// The parts without which steering is unconfirmed: the service, observed motion, heard AUVs.
    fn unconfirmed(&self, link: &LinkStatus) -> Vec<String> {
        let now = self.now_s();
        let service = link.trouble.as_ref().map(|_| SILENT_SERVICE.to_owned());
        let craft = self.confirmation.iter().flat_map(|seen| seen.missing(now));
        let fixes = self.telemetry.fixes.iter();
        let late = fixes.filter(|(_, fixes)| fixes.is_overdue(now) && now - fixes.at_s <= LATE_MAX_S);
        let late = late.map(|(auv, _)| format!("no new fix of {auv}"));
        let unheard = not_heard(link);
        service
            .into_iter()
            .chain(craft.map(str::to_owned))
            .chain(late)
            .chain(unheard)
            .collect()
    }

    /// Tells mission and ground station the state of the steering.
    pub(super) fn tell(&mut self, link: &LinkStatus) {
        let (now, steering) = (self.now_s(), self.steering(link));
        self.tell_mission(now, steering.as_ref());
        if let Some(steering) = steering {
            self.tell_ground_station(now, steering);
        }
    }

    /// Once a second, and at every change.
    fn tell_mission(&mut self, now: f64, steering: Option<&Steering>) {
        let Some(mission) = &self.link else { return };
        let (state, why) = steering.map_or(("waiting", "a dry run"), |now| (now.state(), &now.cause));
        let is_said = self.said.as_ref().is_some_and(|((before, because), at)| {
            (*before, &**because) == (state, why) && now - at < WORD_INTERVAL_S
        });
        if !is_said {
            mission.report_steering(now, state, why);
            self.said = Some(((state, why.to_owned()), now));
        }
    }

    /// After a second of change, or `CLEAR_S` of improvement, and repeatedly during an alarm.
    fn tell_ground_station(&mut self, now: f64, steering: Steering) {
        let is_same = |other: &Steering| (other.is_on, other.severity) == (steering.is_on, steering.severity);
        let since = match &self.steering {
            Some((before, since)) if is_same(before) => *since,
            _ => now,
        };
        self.steering = Some((steering.clone(), since));
        let is_told = self.told.as_ref().is_some_and(|(told, _)| is_same(told));
        self.untold_s = (!is_told).then(|| self.untold_s.unwrap_or(now));
        let is_due = match &self.told {
            Some((told, at)) if is_same(told) => {
                let is_alarm = steering.severity == MavSeverity::MAV_SEVERITY_CRITICAL;
                let is_new = words(&told.cause) != words(&steering.cause);
                is_new && CAUSE_INTERVAL_S <= now - at || is_alarm && ALARM_INTERVAL_S <= now - at
            }
            Some((told, _)) if told.is_alarm() && !steering.is_alarm() => CLEAR_S <= now - since,
            Some((told, _)) if told.is_on && steering.is_good() => CLEAR_S <= now - since,
            _ => self.untold_s.is_some_and(|untold_s| CHANGED_S <= now - untold_s),
        };
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

    /// Tells the ground station that the bridge ends, and the reason.
    pub(super) fn tell_end(&mut self, severity: MavSeverity, cause: &str) {
        if !self.settings.dry_run {
            self.send_texts(&Steering {
                is_on: false,
                is_a_persons: false,
                severity,
                cause: cause.to_owned(),
            });
        }
    }

    /// Steering, mode, plan, reference, fixes and rejected input in one line.
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
        let said = steering.clone().unwrap_or_default();
        let is_new = |words: &String| !said.contains(words.as_str());
        let mut parts: Vec<_> = dry_run.into_iter().chain(steering).collect();
        parts.push(mode);
        if let Some(plan) = &link.plan {
            let status = self.plan_status(plan, now, self.output_limits(link).speed_max);
            parts.extend(status.into_iter().filter(is_new));
        }
        let craft = &self.telemetry.craft;
        parts.extend(craft.missing(now).map(str::to_owned));
        let alarms = craft.alarms().map(|alarm| cause(&alarm.to_string()));
        parts.extend(alarms.filter(is_new).map(|alarm| format!("WARNING {alarm}")));
        let fixes = self.telemetry.fixes.iter();
        parts.extend(fixes.map(|(auv, Fixes { at_s, count, .. })| {
            let fixes = if *count == 1 { "fix" } else { "fixes" };
            format!("{auv} heard {:.0} s ago, {count} {fixes}", now - at_s)
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

    /// The plan, with its reference limited to `speed_max`, m/s, as it is sent. A plan that is too
    /// old to follow has only its age.
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
                plan.current.clone(),
            ]);
            let others = plan.warnings.iter().filter(|[code, _]| code != NOT_HEARD);
            parts.extend(others.map(|[code, _]| code.replace('_', " ")));
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
    use std::time::Duration;

    use clock::Clock;
    use serde_json::json;

    use super::{
        super::{LINE_BYTES, lines},
        *,
    };
    use crate::{autopilot_link::AutopilotSettings, follow::Settings, mavlink::Silence, wire::Endpoint};

    /// A bridge without a wire, and a present plan, whose answer `change` modifies.
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
    async fn the_line_begins_with_the_state_of_the_steering_and_its_reason() {
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
                json!([{ "code": "stale_report", "detail": "auv-1 was last heard of 40 s ago; its forecast starts there" }]),
                "steering: auv-1 was last heard of 40 s ago, mode unknown, ",
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
    async fn contents_of_an_outdated_plan_are_not_shown() {
        let (bridge, link) = bridge_and_link(|answer| {
            answer["age_s"] = json!(40.0);
            answer["plan"]["reference"]["valid_until_s"] = json!(20.0);
        });
        let line = bridge.status_line(&link);
        assert!(line.contains("last plan 40 s ago"), "{line}");
        assert!(!line.contains("goal") && !line.contains("ok"), "{line}");
    }

    #[tokio::test(start_paused = true)]
    async fn the_ground_station_is_told_what_lasts_a_second_and_that_an_alarm_is_over_when_it_has_not_returned()
     {
        let (mut bridge, link) = bridge_and_link(|_| {});
        let clock = bridge.clock.machine.clone();
        let mut texts = vec![];
        let stale = Sending::Stopped(Silence::PlanStale);
        // Tenths of a second. One second of silence is not told; intermittent silence twice a
        // minute.
        let comes_and_goes = [(stale, 13), (Sending::Active, 30)].repeat(14);
        let course = [(Sending::Active, 12), (stale, 8), (Sending::Active, 20)];
        for (sending, tenths) in course
            .into_iter()
            .chain(comes_and_goes)
            .chain([(Sending::Active, 80)])
        {
            for _ in 0..tenths {
                clock.sleep(Duration::from_millis(100)).await;
                bridge.logged = Some(sending);
                bridge.tell(&link);
                let told = bridge
                    .told
                    .as_ref()
                    .map(|(steering, at)| (steering.texts().concat(), *at));
                if told != texts.last().cloned() {
                    texts.extend(told);
                }
            }
        }
        let texts: Vec<_> = texts.iter().map(|(text, _)| text.as_str()).collect();
        let (on, off) = ("Pilotfish steering", "Pilotfish off: the plan is too old");
        assert_eq!(texts, [on, off, off, on]);
    }

    #[tokio::test(start_paused = true)]
    async fn status_lines_have_at_most_160_characters_and_keep_every_word() {
        let warned = json!([
            { "code": "craft_unknown" }, { "code": "heading_does_not_respond" }, { "code": "reported_accuracy_contradicted" },
            { "code": "reference_below_speed_min" }, { "code": "goal_unreachable" }, { "code": "stale_report", "detail": "auv-9 was last heard of 31 s ago" },
        ]);
        let (mut bridge, mut link) = bridge_and_link(|answer| answer["plan"]["warnings"] = warned.clone());
        link.rejected = Some((
            7,
            "asc/0/state/position/lat_deg: is not in the range from -90 to 90".to_owned(),
        ));
        for reason in [
            "beyond the API's range of headings",
            "beyond the API's range of speeds",
        ] {
            link.clamped.count(reason);
        }
        for sending in [
            None,
            Some(Sending::Active),
            Some(Sending::Stopped(Silence::NotGuided)),
        ] {
            bridge.logged = sending;
            let whole = bridge.status_line(&link);
            let shown = lines(&whole, LINE_BYTES);
            assert!(
                LINE_BYTES < whole.len() && shown.iter().all(|line| line.len() <= LINE_BYTES),
                "{shown:?}"
            );
            assert_eq!(shown.join(" ").replace(" ... ", " "), whole);
            assert_eq!(whole.matches("heading does not respond").count(), 1, "{whole}");
        }
    }

    #[tokio::test(start_paused = true)]
    async fn the_shown_speed_is_within_the_limits() {
        let (bridge, link) = bridge_and_link(|_| {});
        let line = bridge.status_line(&link);
        assert!(line.contains(", 1.20 m/s 000°"), "{line}");
    }
}
