//! One sentence that explains what the craft does about other vessels.

use nalgebra::Vector2;

use crate::avoid::scene::Scene;
use crate::avoid::trial::{Leg, Outcome};
use crate::facts::angle::Heading;
use crate::facts::traffic::EncounterKind;
use crate::snapshot::build::Snapshot;

/// Least turn that is told, rad.
const TOLD: f64 = 0.1;

/// Share of the craft's speed below which its speed is told.
const SLOW: f64 = 0.9;

/// Names the first vessel for which the craft acts, else the first one, and what that leads to.
pub(crate) fn sentence(
    snapshot: &Snapshot,
    scene: &Scene<'_>,
    outcome: &Outcome,
    acts: &[bool],
    leg: Option<&Leg>,
) -> String {
    let met = || (0..acts.len()).filter(|i| scene.others[*i].kind.is_some());
    let Some(first) = met().find(|i| acts[*i]).or_else(|| met().next()) else {
        return String::new();
    };
    let (other, passing) = (&scene.others[first], &outcome.passings[first]);
    let name = snapshot.traffic[other.forecast.vessel].called();
    let does = match other.kind {
        Some(EncounterKind::HeadOn | EncounterKind::CrossingGiveWay | EncounterKind::Overtaking)
            if !acts[first] =>
        {
            format!("will give way to {name}")
        }
        Some(EncounterKind::HeadOn) => format!("meeting {name} head-on"),
        Some(EncounterKind::CrossingGiveWay) => format!("giving way to {name}"),
        Some(EncounterKind::Overtaking) => format!("overtaking {name}"),
        Some(EncounterKind::CrossingStandOn | EncounterKind::Overtaken) if acts[first] => {
            format!("keeping clear of {name}, which does not give way")
        }
        Some(EncounterKind::CrossingStandOn | EncounterKind::Overtaken) => {
            format!("standing on, {name} is to give way")
        }
        Some(EncounterKind::KeepClear) | None => format!("keeping clear of {name}"),
    };
    let turn = leg.and_then(|leg| leg.heading).filter(|turn| TOLD < turn.abs());
    let pace = |speed: f64| {
        if speed < SLOW * scene.craft.limits.speed_max {
            format!(" at {speed:.1} m/s")
        } else {
            String::new()
        }
    };
    let pace = leg.map(|leg| pace(leg.speed)).unwrap_or_default();
    let action = match (turn, leg) {
        (Some(turn), _) => {
            let side = if turn < 0.0 { "port" } else { "starboard" };
            format!(": turns {:.0}° to {side}{pace}", turn.abs().to_degrees())
        }
        (None, Some(leg)) if leg.heading.is_none() => {
            format!(": slows down to {:.1} m/s", leg.speed)
        }
        (None, Some(leg)) => {
            let heading = snapshot.asc.heading().radians() + leg.heading.unwrap_or(0.0);
            format!(": holds {:03.0}°{pace}", Heading::new(heading).compass_degrees().round() % 360.0)
        }
        (None, None) => String::new(),
    };
    let more = match met().count() - 1 {
        0 => String::new(),
        1 => " (and 1 more vessel)".to_owned(),
        more => format!(" (and {more} more vessels)"),
    };
    let side = beside(&passing.place);
    format!("{does}{action}, passes {:.0} m {side}{more}", passing.distance)
}

fn beside(place: &Vector2<f64>) -> &'static str {
    if place.y.abs() < place.x.abs() {
        if place.x < 0.0 { "astern" } else { "ahead" }
    } else if place.y < 0.0 {
        "on the vessel's port side"
    } else {
        "on the vessel's starboard side"
    }
}
