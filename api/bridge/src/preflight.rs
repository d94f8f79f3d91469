//! Checks before departure, each with a verdict and a remedy. A check needs evidence to pass.

use std::fmt;

use planner::angle::{angle_of, wrap};

use crate::MeasuredState;
use crate::follow::{Bridge, CLOCK_ERROR_MAX_S, Fixes};
use crate::mavlink::{Autopilot, Control, HEARTBEAT_AGE_MAX_S, Silence};
use crate::plan::speed_to;

/// Result of a check.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// The result is right.
    Passes,
    /// It cannot be checked, or needs attention.
    Warns,
    /// Do not depart.
    Fails,
}

/// One check.
#[derive(Clone, Debug, PartialEq)]
pub struct Check {
    /// The subject of the check.
    pub name: &'static str,
    /// The result.
    pub verdict: Verdict,
    /// The observation and the remedy.
    pub detail: String,
}

impl fmt::Display for Check {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let verdict = match self.verdict {
            Verdict::Passes => "ok  ",
            Verdict::Warns => "warn",
            Verdict::Fails => "FAIL",
        };
        write!(f, "{verdict} {:<22} {}", self.name, self.detail)
    }
}

/// Slowest speed at which the course tells about the heading, m/s.
const SPEED_FOR_COURSE: f64 = 0.5;
/// Largest angle between heading and course, rad: beyond it a compass or its mounting is wrong.
const COURSE_ERROR_MAX: f64 = 0.6;
/// Currents beyond this are rarer than wrong compasses, m/s.
const CURRENT_MAX: f64 = 2.0;
/// Greatest standard deviation of an observed current, m/s: half of the initial one.
const CURRENT_SIGMA_MAX: f64 = 0.15;
/// Time after which the next fix is overdue, s.
const FIX_AGE_MAX_S: f64 = 60.0;

type Finding = (Verdict, String);

/// All checks of a bridge's received data, with fixes of `auvs`.
pub fn checks(bridge: &Bridge, auvs: &[String]) -> Vec<Check> {
    let mut findings = vec![
        ("autopilot", autopilot(bridge)),
        ("parameters", parameters(bridge)),
        ("position", position(bridge)),
        ("navigation", navigation(bridge)),
        ("clocks", clocks(bridge)),
    ];
    findings.extend(fixes(bridge, auvs).into_iter().map(|finding| ("fixes", finding)));
    findings.extend([
        ("heading against course", heading(bridge)),
        ("current", current(bridge)),
        ("vessels", vessels(bridge)),
        ("input", input(bridge)),
        ("plans", plans(bridge)),
    ]);
    let check = |(name, (verdict, detail))| Check { name, verdict, detail };
    findings.into_iter().map(check).collect()
}

fn passes(detail: impl Into<String>) -> Finding {
    (Verdict::Passes, detail.into())
}

fn warns(detail: impl Into<String>) -> Finding {
    (Verdict::Warns, detail.into())
}

fn fails(detail: impl Into<String>) -> Finding {
    (Verdict::Fails, detail.into())
}

fn autopilot(bridge: &Bridge) -> Finding {
    match bridge.control() {
        Control::Unreported => warns(
            "this wire reports no mode: check yourself that the autopilot follows references, and how to take over",
        ),
        Control::Reported(None) => {
            fails("no heartbeat: check --connect, the baud rate and the cable, or that the helm runs")
        }
        Control::Reported(Some((_, age))) if age > HEARTBEAT_AGE_MAX_S => {
            fails(format!("no heartbeat for {age:.0} s"))
        }
        Control::Reported(Some((heartbeat, _))) => {
            let armed = if heartbeat.is_armed { "armed" } else { "not armed" };
            let seen = format!("{:?}, {}, {armed}", heartbeat.autopilot, heartbeat.mode);
            match (heartbeat.mode.is_guided, heartbeat.is_armed) {
                (true, true) => passes(seen),
                (true, false) => warns(format!("{seen}: {}", Silence::NotArmed)),
                (false, _) => warns(format!("{seen}: {}", Silence::NotGuided)),
            }
        }
    }
}

fn parameters(bridge: &Bridge) -> Finding {
    let is_helm =
        matches!(bridge.control(), Control::Reported(Some((heard, _))) if heard.autopilot == Autopilot::Helm);
    if is_helm || bridge.control() == Control::Unreported {
        return warns("this wire carries none: set limits and craft in --setup");
    }
    if let Some(dune) = bridge.dune() {
        return match &dune.reader.takes_plan {
            Some(Ok(())) => passes("DUNE takes FollowReference; set limits and craft in --setup"),
            Some(Err(why)) => fails(format!(
                "DUNE refuses FollowReference ({why}): enable the task Maneuver.FollowReference"
            )),
            None => warns(
                "DUNE does not say whether it takes FollowReference: it is asked in the mode SERVICE, and never with --headings",
            ),
        };
    }
    let contradictions = bridge.contradictions();
    if !contradictions.is_empty() {
        return fails(joined(contradictions.iter().map(ToString::to_string)));
    }
    let parameters = &bridge.telemetry.parameters;
    let Some(speed) = parameters.speed_max() else {
        return warns("no answer for WP_SPEED: set limits.speed_max_mps yourself");
    };
    let seen = format!("references are clipped at {speed:.2} m/s (WP_SPEED)");
    let missing = joined(parameters.missing().map(str::to_owned));
    let missing = (!missing.is_empty()).then(|| format!("no answer for {missing}: check them yourself"));
    let remarks = joined(parameters.failsafes().chain(missing));
    if remarks.is_empty() { passes(seen) } else { warns(format!("{seen}; {remarks}")) }
}

fn position(bridge: &Bridge) -> Finding {
    let telemetry = &bridge.telemetry;
    match telemetry.craft.newest() {
        Some(_) if telemetry.position_known == Some(false) => {
            fails("the autopilot does not trust its position: wait for GNSS and its filter")
        }
        Some(MeasuredState { position, .. }) => {
            passes(format!("{:.6}°, {:.6}°", position.lat_deg, position.lon_deg))
        }
        None => match telemetry.craft.distrusted() {
            Some(alarm) => fails(alarm.to_string()),
            None => fails(joined(telemetry.craft.missing(bridge.now_s()).map(str::to_owned))),
        },
    }
}

/// The alarms about position, velocity and heading; see `docs/at-sea.md#doubts`.
fn navigation(bridge: &Bridge) -> Finding {
    let telemetry = &bridge.telemetry;
    let seen = joined(telemetry.alarms_seen.iter().map(ToString::to_string));
    if telemetry.alarms_seen.iter().any(|alarm| alarm.stops()) {
        fails(seen)
    } else if !seen.is_empty() {
        warns(seen)
    } else if telemetry.craft.newest().is_none() {
        fails("no state of the craft")
    } else {
        passes("position, velocity and heading agree")
    }
}

fn clocks(bridge: &Bridge) -> Finding {
    match bridge.telemetry.clock_ahead_s {
        Some(ahead) if ahead.abs() <= CLOCK_ERROR_MAX_S => {
            passes(format!("the autopilot's is {ahead:+.2} s ahead of this machine's"))
        }
        Some(ahead) => fails(format!(
            "the autopilot's (GNSS) is {ahead:+.1} s ahead of this machine's: run chrony or ntpd here, or fixes get wrong times"
        )),
        None => warns("the autopilot sends no time: it has no fix yet, or sends no SYSTEM_TIME"),
    }
}

fn fixes(bridge: &Bridge, auvs: &[String]) -> Vec<Finding> {
    let fixes = &bridge.telemetry.fixes;
    let now = bridge.now_s();
    let finding = |(auv, fixes): (&String, &Fixes)| {
        let age = now - fixes.arrivals.newest_s;
        let sigma = fixes.newest.sigma_m.map(|sigma| format!(", ±{sigma:.1} m")).unwrap_or_default();
        let detail = format!("{auv}: {}, the newest {age:.0} s ago{sigma}", fixes.count);
        if age <= FIX_AGE_MAX_S { passes(detail) } else { fails(detail) }
    };
    let unheard = auvs.iter().filter(|auv| !fixes.contains_key(*auv));
    let unheard = unheard.map(|auv| fails(format!("{auv}: none; check --auv and --modem, and ping it")));
    let findings: Vec<Finding> = fixes.iter().map(finding).chain(unheard).collect();
    if findings.is_empty() {
        let none = "no reports from any AUV: check --auv and --modem, and ping one";
        return vec![fails(none)];
    }
    findings
}

fn heading(bridge: &Bridge) -> Finding {
    let Some(state) = bridge.telemetry.craft.newest() else {
        return warns("no state of the craft");
    };
    let velocity = state.ground_velocity;
    let Some(velocity) = velocity.filter(|velocity| velocity.norm() >= SPEED_FOR_COURSE) else {
        let slow = "the craft is too slow: drive straight ahead";
        return warns(format!("{slow} at {SPEED_FOR_COURSE} m/s or more, and check again"));
    };
    let off = wrap(angle_of(&velocity) - state.heading);
    let seen = format!("{:+.0}°", off.to_degrees());
    if off.abs() <= COURSE_ERROR_MAX {
        passes(seen)
    } else {
        fails(format!("{seen}: the compass is wrong or turned in its mount, or the craft goes astern"))
    }
}

fn current(bridge: &Bridge) -> Finding {
    let craft = &bridge.telemetry.craft;
    if craft.newest().is_none() {
        return warns("no state of the craft");
    }
    if craft.water_velocity.is_some() {
        return warns("not estimated beside a speed log: the planner takes it from your mission");
    }
    let (current, sigma) = (craft.current.current, craft.current.sigma());
    let seen = speed_to(&current);
    if current.norm() > CURRENT_MAX {
        fails(format!("{seen} is not plausible: check the compass and the speed log"))
    } else if sigma > CURRENT_SIGMA_MAX {
        warns(format!(
            "{seen} so far, ±{sigma:.2} m/s along one axis: drive on two headings, and check again"
        ))
    } else {
        passes(seen)
    }
}

fn vessels(bridge: &Bridge) -> Finding {
    let near = bridge.telemetry.vessels_near(bridge.now_s());
    match near.first() {
        Some((distance, nearest)) => {
            passes(format!("{} heard, {} is {distance:.0} m away", near.len(), nearest.called()))
        }
        None => {
            warns("none heard: nothing keeps the craft clear of vessels without an AIS receiver (--nmea)")
        }
    }
}

fn input(bridge: &Bridge) -> Finding {
    let pieces = bridge.wires().zip(&bridge.telemetry.pieces);
    let silent = pieces.filter(|(_, count)| **count == 0);
    let silent: Vec<String> = silent.map(|(wire, _)| wire).collect();
    if !silent.is_empty() {
        return fails(format!("nothing from {}", silent.join(", ")));
    }
    let rejects = bridge.rejects().filter(|rejects| rejects.total() > 0);
    let rejects = joined(rejects.map(ToString::to_string));
    if rejects.is_empty() { passes("nothing rejected") } else { warns(format!("rejected: {rejects}")) }
}

fn plans(bridge: &Bridge) -> Finding {
    let link = bridge.link();
    if let Some(trouble) = link.trouble {
        return fails(format!("the service: {trouble}"));
    }
    if let Some((count, why)) = link.rejected {
        return fails(format!("{count} reports rejected, the last one because {why}"));
    }
    let Some(plan) = link.plan else {
        return fails("none yet: the mission needs the craft and every AUV of its goal");
    };
    let (lags, current) = (plan.lags(), plan.current());
    let seen = format!("{}, {:.1} m from the goal, {lags}, {current}", plan.method(), plan.distance_m);
    let codes: Vec<_> = plan.warnings().map(|code| code.replace('_', " ")).collect();
    if plan.warnings().any(|code| code == "craft_does_not_follow") {
        let remedy = "the craft does not follow its references: identify it (docs/commissioning.md)";
        fails(format!("{seen}; {remedy}"))
    } else if codes.is_empty() {
        passes(seen)
    } else {
        warns(format!("{seen}; {}", codes.join(", ")))
    }
}

fn joined(texts: impl Iterator<Item = String>) -> String {
    texts.collect::<Vec<_>>().join("; ")
}

#[cfg(test)]
mod tests {
    use clock::Clock;

    use super::*;
    use crate::{autopilot_link::AutopilotSettings, follow::Settings, wire::Endpoint};

    #[tokio::test(start_paused = true)]
    async fn checks_without_evidence_do_not_pass() {
        let wire = || Endpoint::Udp("127.0.0.1:0".to_owned());
        let settings = Settings { nmea: vec![wire()], ..Settings::default() };
        let autopilot = AutopilotSettings::Mavlink {
            connect: wire(),
            system: None,
            auvs: [(2, "auv-1".to_owned())].into(),
        };
        let clock = Clock::simulated(0.0);
        let bridge = Bridge::open(&clock, autopilot, settings, |_, _| Box::new(|_| ()));
        let checks = checks(&bridge, &["auv-1".to_owned()]);
        for check in &checks {
            assert_ne!(check.verdict, Verdict::Passes, "{check}");
        }
        let failed =
            |name: &str| checks.iter().any(|check| check.name == name && check.verdict == Verdict::Fails);
        for name in ["autopilot", "position", "navigation", "fixes", "input", "plans"] {
            assert!(failed(name), "{name}");
        }
    }
}
