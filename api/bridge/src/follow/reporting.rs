//! Words for operators: the status line, the mission's state of steering, and STATUSTEXT.

use ::wire::mission::SteeringState;

use crate::autopilot_link::AutopilotLink;
use crate::follow::decision::{Decision, Sending};
use crate::follow::steering::Steering;
use crate::follow::telemetry::{Fixes, Telemetry};
use crate::mavlink::{Control, HEARTBEAT_AGE_MAX_S, Silence};
use crate::mission_link::{LinkStatus, MissionLink};
use crate::{Plan, Rejects};

/// Warnings of a plan that the craft does not respond.
const NOT_FOLLOWED: [&str; 3] =
    ["craft_does_not_follow", "heading_does_not_respond", "speed_does_not_respond"];

/// The warning that an AUV is silent. Lost messages alone cause it: it is told, and is no alarm.
const NOT_HEARD: &str = "stale_report";

/// The reasons for a missing plan, and the time without an answer after which a service is silent,
/// s: one lost request is none.
const SILENT_SERVICE: &str = "the service does not answer";
const NO_NEW_PLAN: &str = "no new plan";
const SILENT_S: f64 = 1.0;

/// Time without a fix of an AUV after which the plan states if that matters (`NOT_HEARD`), s.
const LATE_MAX_S: f64 = 32.0;

/// Time between two reports of the state to the mission, s. After three missing ones it is unknown.
const STATE_INTERVAL_S: f64 = 1.0;

/// Time that an improvement lasts before it is told, s.
const BETTER_S: f64 = 1.0;
/// Time that an improvement after an alarm or a reservation lasts before the ground station is
/// told, s: an alarm that comes and goes is one alarm (as in ISA-18.2).
const CLEAR_S: f64 = 10.0;

/// Time between two texts to the ground station, s: of a lasting alarm, and of a changing cause or
/// an improvement.
const ALARM_INTERVAL_S: f64 = 30.0;
const TEXT_INTERVAL_S: f64 = 10.0;

/// Time between two status lines, s.
pub(super) const LINE_INTERVAL_S: f64 = 5.0;

/// A cause without its numbers: a growing age is the same cause.
fn words(cause: &str) -> Vec<&str> {
    cause.split(' ').filter(|word| word.parse::<f64>().is_err()).collect()
}

/// `text` up to its consequence.
fn cause(text: &str) -> String {
    text.split([':', ';']).next().unwrap_or_default().to_owned()
}

#[derive(Clone, Copy)]
pub(super) struct Facts<'a> {
    /// Time on the bridge's clock, s.
    pub(super) now: f64,
    pub(super) link: &'a LinkStatus,
    pub(super) autopilot: &'a AutopilotLink,
    pub(super) telemetry: &'a Telemetry,
    pub(super) decision: &'a Decision,
}

impl<'a> Facts<'a> {
    /// Decides the state of the steering, for every display; `None` in a dry run. Silence is an
    /// alarm only while the craft is armed and in the guided mode: then nobody else steers.
    pub(super) fn steering(self) -> Option<Steering> {
        if self.decision.dry_run {
            return None;
        }
        let (state, cause) = match self.decision.sending {
            None => (SteeringState::Waiting, "waiting for the craft".to_owned()),
            Some(Sending::Stopped(silence)) => {
                let is_ours = match self.autopilot.control(self.now) {
                    Control::Reported(heard) => {
                        heard.is_some_and(|(heartbeat, _)| heartbeat.may_be_steered())
                    }
                    Control::Unreported => true,
                };
                let state = match silence {
                    Silence::TakenOver | Silence::NotGuided => SteeringState::Person,
                    _ if is_ours && !silence.is_meant() => SteeringState::NotSteering,
                    _ => SteeringState::Waiting,
                };
                let lacks_plan = matches!(silence, Silence::NoPlan | Silence::PlanStale);
                // A silent service is why.
                let is_silent = lacks_plan && self.link.trouble.is_some();
                let silence = silence.to_string();
                (state, cause(if is_silent { SILENT_SERVICE } else { &silence }))
            }
            Some(Sending::Active) => match self.causes() {
                causes if causes.is_empty() => (SteeringState::Steering, self.unconfirmed().join("; ")),
                causes => (SteeringState::Degraded, causes.join("; ")),
            },
        };
        Some(Steering { state, cause })
    }

    fn alarms(self) -> impl Iterator<Item = String> + 'a {
        self.telemetry.craft.integrity.alarms().map(|alarm| cause(&alarm.to_string()))
    }

    /// The reasons that references have less effect than they should.
    fn causes(self) -> Vec<String> {
        let mut causes: Vec<_> = self.alarms().collect();
        if let Some(plan) = &self.link.plan {
            let not_followed = plan.warnings().filter(|code| NOT_FOLLOWED.contains(code));
            let reason = plan.answer.plan.reason.as_deref();
            let reason = reason.filter(|_| !self.decision.line_of_sight);
            causes.extend(not_followed.chain(reason).map(|code| code.replace('_', " ")));
        }
        let avoided = self.decision.limiter.avoided.iter();
        causes.extend(avoided.map(|vessel| format!("keeps clear of {vessel} against the plan")));
        causes
    }

    /// The parts without which steering is unconfirmed: new plans, observed motion, heard AUVs.
    fn unconfirmed(self) -> Vec<String> {
        let now = self.now;
        let silent_s = self.link.troubled_s.map_or(0.0, |since_s| now - since_s);
        let lacks_plan = self.link.plans.as_ref().is_some_and(|plans| plans.is_overdue(now));
        let service = match (SILENT_S <= silent_s, lacks_plan) {
            (true, _) => Some(SILENT_SERVICE),
            (false, true) => Some(NO_NEW_PLAN),
            (false, false) => None,
        };
        let service = service.into_iter().map(str::to_owned);
        let craft = self.decision.unconfirmed(now).map(str::to_owned);
        let fixes = self.telemetry.fixes.iter();
        let late = fixes.filter(|(_, Fixes { arrivals, .. })| {
            arrivals.is_overdue(now) && now - arrivals.newest_s <= LATE_MAX_S
        });
        let late = late.map(|(auv, _)| format!("no new fix of {auv}"));
        let warnings = self.link.plan.iter().flat_map(|plan| &plan.answer.plan.warnings);
        let not_heard = warnings.filter(|warning| warning.code == NOT_HEARD);
        let not_heard = not_heard.map(|warning| cause(&warning.detail));
        service.chain(craft).chain(late).chain(not_heard).collect()
    }

    /// Steering, mode, plan, reference, fixes and rejected input in one line.
    pub(super) fn line(self, steering: Option<&Steering>) -> String {
        let (now, link) = (self.now, self.link);
        let mode = match self.autopilot.control(now) {
            Control::Reported(Some((heartbeat, age))) if age <= HEARTBEAT_AGE_MAX_S => {
                heartbeat.mode.to_string()
            }
            Control::Reported(Some((_, age))) => format!("autopilot heard {age:.0} s ago"),
            Control::Reported(None) => "no autopilot".to_owned(),
            Control::Unreported => "mode unknown".to_owned(),
        };
        let steering = steering.map(ToString::to_string);
        let is_new = |words: &String| !steering.iter().any(|said| said.contains(words.as_str()));
        let mut parts = vec![steering.clone().unwrap_or_else(|| "dry run".to_owned()), mode];
        if let Some(plan) = &link.plan {
            parts.extend(self.plan_parts(plan).into_iter().filter(is_new));
        }
        parts.extend(self.telemetry.craft.missing(now).map(str::to_owned));
        let alarms = self.alarms().filter(is_new);
        parts.extend(alarms.map(|alarm| format!("WARNING {alarm}")));
        let fixes = self.telemetry.fixes.iter();
        parts.extend(fixes.map(|(auv, Fixes { arrivals, count, .. })| {
            let fixes = if *count == 1 { "fix" } else { "fixes" };
            let age = now - arrivals.newest_s;
            let plan = link.plan.as_ref().filter(|plan| self.decision.reference(plan, now).is_some());
            let away = plan.and_then(|plan| plan.distance_to(auv));
            let away = away.map_or_else(String::new, |away| format!("{away:.0} m away, "));
            format!("{auv} heard {age:.0} s ago, {away}{count} {fixes}")
        }));
        let vessels = self.telemetry.vessels_near(now);
        parts.extend(vessels.first().map(|(distance, nearest)| {
            let count =
                if vessels.len() == 1 { "1 vessel".to_owned() } else { format!("{} vessels", vessels.len()) };
            format!("{count} heard, {} {distance:.0} m away", nearest.called())
        }));
        let rejected = link.rejected.iter();
        parts.extend(rejected.map(|(count, why)| format!("{count} reports rejected ({why})")));
        let counted =
            |what: &str, counts: &Rejects| (counts.total() > 0).then(|| format!("{what}: {counts}"));
        parts.extend(counted("values clamped", &link.clamped));
        let wires = std::iter::once(self.autopilot.rejects()).chain(self.telemetry.rejects());
        parts.extend(wires.filter_map(|rejects| counted("input rejected", rejects)));
        parts.extend(counted("references limited", &self.decision.limiter.changes));
        parts.join(", ")
    }

    /// The plan in words, with the reference as it is sent; its age alone if it is too old.
    fn plan_parts(self, plan: &Plan) -> Vec<String> {
        let age = self.now - plan.planned.planned_s;
        let mut parts = Vec::new();
        if let Some(reference) = self.decision.reference(plan, self.now) {
            let heading = reference.heading.to_degrees().rem_euclid(360.0);
            let limits = self.decision.output_limits(self.link, &self.telemetry.parameters);
            let speed = reference.speed.min(limits.speed_max);
            parts.extend([
                plan.method(),
                format!("{:.1} m from the goal", plan.distance_m),
                format!("plan {age:.1} s old"),
                format!("{speed:.2} m/s {heading:03.0}°"),
                plan.current(),
            ]);
            let others = plan.warnings().filter(|code| *code != NOT_HEARD);
            parts.extend(others.map(|code| code.replace('_', " ")));
        } else {
            parts.push(format!("last plan {age:.0} s ago"));
        }
        let waits_for = &plan.answer.waits_for;
        if !waits_for.is_empty() {
            parts.push(format!("waits for {}", waits_for.join(" and ")));
        }
        parts
    }
}

/// Tells log, mission and ground station the state of the steering; remembers what was told.
#[derive(Debug, Default)]
pub(super) struct Reporting {
    /// The state in the last status line, and its time, s.
    pub(super) lined: Option<(Option<Steering>, f64)>,
    /// Time since which the state is better than the ground station's, s.
    better_since_s: Option<f64>,
    /// The last texts to the ground station, and their time, s.
    pub(super) texted: Option<(Steering, f64)>,
    /// The last state and reason for the mission, and their time, s.
    posted: Option<(SteeringState, String, f64)>,
}

impl Reporting {
    /// `true` if a status line is due at `now`, s: at once after a worse state, else in a second.
    pub(super) fn takes_line(&mut self, now: f64, steering: Option<&Steering>) -> bool {
        let is_due = self.lined.as_ref().is_none_or(|(said, at)| {
            let [is_worse, is_other] = match said.as_ref().zip(steering) {
                Some((said, now)) => [now.is_worse_than(said), !now.is_like(said)],
                None => [false, said.as_ref() != steering],
            };
            let elapsed = now - at;
            is_worse || is_other && BETTER_S <= elapsed || LINE_INTERVAL_S <= elapsed
        });
        if is_due {
            self.lined = Some((steering.cloned(), now));
        }
        is_due
    }

    /// Tells the state at `now`, s, to mission and ground station; none in a dry run.
    pub(super) fn tell(
        &mut self,
        now: f64,
        steering: Option<Steering>,
        mission: Option<&MissionLink>,
        autopilot: &mut AutopilotLink,
    ) {
        if let Some(mission) = mission {
            self.post(now, steering.as_ref(), mission);
        }
        if let Some(steering) = steering {
            self.text(now, steering, autopilot);
        }
    }

    /// Posts the state once a second, and at every change.
    fn post(&mut self, now: f64, steering: Option<&Steering>, mission: &MissionLink) {
        let dry_run = (SteeringState::Waiting, "a dry run");
        let (state, why) = steering.map_or(dry_run, |steering| (steering.state, &steering.cause));
        let is_posted = self.posted.as_ref().is_some_and(|(before, because, at)| {
            (*before, &**because) == (state, why) && now - at < STATE_INTERVAL_S
        });
        if !is_posted {
            mission.report_steering(now, state, why);
            self.posted = Some((state, why.to_owned(), now));
        }
    }

    /// Sends texts of a worse state at once, of a better one that lasts, and again during an alarm.
    fn text(&mut self, now: f64, steering: Steering, autopilot: &mut AutopilotLink) {
        let told = self.texted.as_ref();
        let is_told = told.is_some_and(|(told, _)| !told.is_worse_than(&steering));
        self.better_since_s = (!is_told).then(|| self.better_since_s.unwrap_or(now));
        let better_s = self.better_since_s.map_or(0.0, |since_s| now - since_s);
        let is_due = match told {
            None => BETTER_S <= better_s,
            Some((told, _)) if steering.is_worse_than(told) => true,
            Some((told, at)) if steering.is_like(told) => {
                let is_alarm = steering.state == SteeringState::NotSteering;
                let is_new = words(&told.cause) != words(&steering.cause);
                is_new && TEXT_INTERVAL_S <= now - at || is_alarm && ALARM_INTERVAL_S <= now - at
            }
            Some((told, at)) => {
                let is_end = told.is_alarm() || told.is_on() && steering.is_good();
                let lasts_s = if is_end { CLEAR_S } else { BETTER_S };
                lasts_s <= better_s && TEXT_INTERVAL_S <= now - at
            }
        };
        if is_due {
            send_texts(&steering, autopilot);
            self.texted = Some((steering, now));
        }
    }
}

pub(super) fn send_texts(steering: &Steering, autopilot: &mut AutopilotLink) {
    for text in steering.texts() {
        autopilot.text(steering.severity(), &text);
    }
}
