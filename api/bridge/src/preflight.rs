//! What to look at before departure: one verdict a check, each with what to do.

use std::fmt;

use nalgebra::Vector2;

use crate::{
    follow::Bridge,
    mavlink::{Control, Silence},
    reference::wrapped,
};

/// What a check came to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// As it should be.
    Passes,
    /// Could not be looked at, or is worth a look.
    Warns,
    /// Do not depart.
    Fails,
}

/// One check.
#[derive(Clone, Debug, PartialEq)]
pub struct Check {
    /// What was looked at.
    pub name: &'static str,
    /// What it came to.
    pub verdict: Verdict,
    /// What was seen, and what to do about it.
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

/// Clocks farther apart than this date fixes wrongly by a craft's length, s.
const CLOCK_ERROR_MAX_S: f64 = 0.5;
/// Below this speed the course says nothing of the heading, m/s.
const SPEED_FOR_COURSE: f64 = 0.5;
/// A larger angle between heading and course is a compass that is wrong or mounted wrongly, rad.
const COURSE_ERROR_MAX: f64 = 0.6;
/// Currents beyond this are rarer than wrong compasses, m/s.
const CURRENT_MAX: f64 = 2.0;
/// A fix older than this says that the next one is overdue, s.
const FIX_AGE_MAX_S: f64 = 60.0;

/// All checks, on what a bridge has seen so far.
#[must_use]
pub fn checks(bridge: &Bridge) -> Vec<Check> {
    let mut checks = vec![
        autopilot(bridge),
        parameters(bridge),
        position(bridge),
        clock(bridge),
    ];
    checks.extend(fixes(bridge));
    checks.extend([heading(bridge), current(bridge), wires(bridge), service(bridge)]);
    checks
}

fn check(name: &'static str, verdict: Verdict, detail: impl Into<String>) -> Check {
    Check {
        name,
        verdict,
        detail: detail.into(),
    }
}

fn autopilot(bridge: &Bridge) -> Check {
    const NAME: &str = "autopilot";
    let (heartbeat, age) = match bridge.control() {
        Control::Unreported => {
            let detail = "this wire tells no mode: see yourself that the autopilot takes references, and how to take over";
            return check(NAME, Verdict::Warns, detail);
        }
        Control::Reported(None) => {
            let detail = "not heard: look at --connect, the baud rate and the cable";
            return check(NAME, Verdict::Fails, detail);
        }
        Control::Reported(Some(heard)) => heard,
    };
    if age > 3.0 {
        return check(NAME, Verdict::Fails, format!("silent for {age:.0} s"));
    }
    let armed = if heartbeat.is_armed { "armed" } else { "not armed" };
    let seen = format!("{:?}, {}, {armed}", heartbeat.autopilot, heartbeat.mode_name());
    if heartbeat.is_guided() && heartbeat.is_armed {
        check(NAME, Verdict::Passes, seen)
    } else {
        let missing = if heartbeat.is_guided() {
            Silence::NotArmed
        } else {
            Silence::NotGuided
        };
        check(NAME, Verdict::Warns, format!("{seen}: {missing}"))
    }
}

fn parameters(bridge: &Bridge) -> Check {
    const NAME: &str = "parameters";
    if bridge.control() == Control::Unreported {
        return check(
            NAME,
            Verdict::Warns,
            "this wire tells none: say limits and craft in --setup",
        );
    }
    let contradictions = bridge.contradictions();
    if !contradictions.is_empty() {
        let said: Vec<String> = contradictions.iter().map(ToString::to_string).collect();
        return check(NAME, Verdict::Fails, said.join("; "));
    }
    let parameters = &bridge.seen().parameters;
    match parameters.speed_max() {
        Some(speed) => check(
            NAME,
            Verdict::Passes,
            format!("references are clipped at {speed:.2} m/s (WP_SPEED)"),
        ),
        None => check(
            NAME,
            Verdict::Warns,
            "WP_SPEED was not answered: set limits.speed_max_mps yourself",
        ),
    }
}

fn position(bridge: &Bridge) -> Check {
    const NAME: &str = "position";
    let seen = bridge.seen();
    match seen.craft.newest() {
        Some(_) if seen.position_known == Some(false) => check(
            NAME,
            Verdict::Fails,
            "the autopilot does not trust its position: wait for GNSS and its filter",
        ),
        Some(state) => check(
            NAME,
            Verdict::Passes,
            format!("{:.6}°, {:.6}°", state.position.lat_deg, state.position.lon_deg),
        ),
        None => check(
            NAME,
            Verdict::Fails,
            "position, heading and velocity have not all been heard",
        ),
    }
}

fn clock(bridge: &Bridge) -> Check {
    const NAME: &str = "clocks";
    match bridge.seen().clock_ahead_s {
        Some(ahead) if ahead.abs() <= CLOCK_ERROR_MAX_S => check(
            NAME,
            Verdict::Passes,
            format!("the autopilot's is {ahead:+.2} s ahead of this machine's"),
        ),
        Some(ahead) => check(
            NAME,
            Verdict::Fails,
            format!(
                "the autopilot's (GNSS) is {ahead:+.1} s ahead of this machine's: run chrony or ntpd here, or fixes are dated wrongly"
            ),
        ),
        None => check(
            NAME,
            Verdict::Warns,
            "the autopilot did not tell the time: it has no fix yet, or sends no SYSTEM_TIME",
        ),
    }
}

fn fixes(bridge: &Bridge) -> Vec<Check> {
    const NAME: &str = "fixes";
    let now = bridge.now_s();
    let heard = &bridge.seen().fixes;
    if heard.is_empty() {
        let detail = "none of any AUV: look at --auv and --modem, and ping one";
        return vec![check(NAME, Verdict::Fails, detail)];
    }
    let one = |(auv, (fix, at, count)): (&String, &(crate::AuvFix, f64, u64))| {
        let age = now - at;
        let sigma = fix
            .sigma_m
            .map_or_else(String::new, |sigma| format!(", ±{sigma:.1} m"));
        let verdict = if age <= FIX_AGE_MAX_S {
            Verdict::Passes
        } else {
            Verdict::Fails
        };
        check(
            NAME,
            verdict,
            format!("{auv}: {count}, the newest {age:.0} s ago{sigma}"),
        )
    };
    heard.iter().map(one).collect()
}

fn heading(bridge: &Bridge) -> Check {
    const NAME: &str = "heading against course";
    let Some(state) = bridge.seen().craft.newest() else {
        return check(NAME, Verdict::Warns, "no state of the craft");
    };
    let Some(velocity) = state
        .ground_velocity
        .filter(|velocity| velocity.norm() >= SPEED_FOR_COURSE)
    else {
        let detail = format!(
            "the craft is too slow to tell: drive straight ahead at {SPEED_FOR_COURSE} m/s or more, and look again"
        );
        return check(NAME, Verdict::Warns, detail);
    };
    let off = wrapped(velocity.y.atan2(velocity.x) - state.heading);
    let seen = format!("{:+.0}°", off.to_degrees());
    if off.abs() <= COURSE_ERROR_MAX {
        check(NAME, Verdict::Passes, seen)
    } else {
        check(
            NAME,
            Verdict::Fails,
            format!("{seen}: the compass is wrong, or turned in its mount, or the craft goes astern"),
        )
    }
}

fn current(bridge: &Bridge) -> Check {
    const NAME: &str = "current";
    let current: Vector2<f64> = bridge.seen().craft.current();
    let seen = format!(
        "{:.2} m/s to {:03.0}°",
        current.norm(),
        current.y.atan2(current.x).to_degrees().rem_euclid(360.0)
    );
    if current.norm() <= CURRENT_MAX {
        check(
            NAME,
            Verdict::Passes,
            format!("{seen}, as far as the craft's headings have shown it"),
        )
    } else {
        check(
            NAME,
            Verdict::Fails,
            format!("{seen} is more than a sea has: look at the compass and at the speed log"),
        )
    }
}

fn wires(bridge: &Bridge) -> Check {
    const NAME: &str = "understood";
    let said: Vec<String> = bridge
        .refused()
        .filter(|refused| refused.total() > 0)
        .map(ToString::to_string)
        .collect();
    if said.is_empty() {
        check(NAME, Verdict::Passes, "all that the wires said")
    } else {
        check(NAME, Verdict::Warns, format!("not this: {}", said.join("; ")))
    }
}

fn service(bridge: &Bridge) -> Check {
    const NAME: &str = "plans";
    let link = bridge.link();
    if let Some(trouble) = link.trouble {
        return check(NAME, Verdict::Fails, format!("the service: {trouble}"));
    }
    if let Some((count, why)) = link.refused {
        return check(
            NAME,
            Verdict::Fails,
            format!("{count} reports refused, the last one because {why}"),
        );
    }
    let Some(plan) = link.plan else {
        return check(
            NAME,
            Verdict::Fails,
            "none yet: the mission has not heard of the craft and of every AUV of its goal",
        );
    };
    let seen = format!(
        "{}, {:.1} m from the goal, {}",
        plan.method, plan.distance_m, plan.learnt
    );
    if plan.warnings.iter().any(|code| code == "craft_does_not_follow") {
        check(
            NAME,
            Verdict::Fails,
            format!("{seen}; the craft does not follow its references: identify it (docs/commissioning.md)"),
        )
    } else if plan.warnings.is_empty() {
        check(NAME, Verdict::Passes, seen)
    } else {
        check(
            NAME,
            Verdict::Warns,
            format!("{seen}; {}", plan.warnings.join(", ")),
        )
    }
}
