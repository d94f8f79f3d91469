//! Rows of the table, from events.

use std::{collections::BTreeMap, time::Duration};

use ::record::table::{ESTIMATED, KNOWN, Row, SURFACE_CRAFT, VESSEL};
use sim::record::method_name;

use crate::missions::clock::MissionClock;
use crate::missions::event::{Event, Planned};
use wire::mission::{AscReport, TrueVehicle, Truth};
use wire::{Outcome, PredictedAuv, Report, Vessel};

pub(super) fn outcome(outcome: Outcome) -> &'static str {
    match outcome {
        Outcome::Ok => "ok",
        Outcome::Degraded => "degraded",
    }
}

/// A mission's clock, from its events in order.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Timeline {
    /// A live mission's clock, which runs by itself.
    live: Option<MissionClock>,
    /// A simulated mission's clock: the time of the last plan, s since the start.
    planned: f64,
}

/// The state before an event on which its rows depend.
#[derive(Clone, Debug, Default)]
pub(super) struct RowContext {
    pub(super) timeline: Timeline,
    pub(super) refused: Refused,
}

impl RowContext {
    /// Applies an event without rows.
    pub(super) fn apply(&mut self, event: &Event) {
        let time = self.timeline.apply(event);
        rows(0, time, event, &mut self.refused);
    }
}

impl Timeline {
    /// Applies an event, and returns the clock's time then, s.
    pub(super) fn apply(&mut self, event: &Event) -> f64 {
        let at_s = match event {
            Event::Planned(plan) => {
                self.planned = plan.t_s;
                return plan.t_s;
            }
            Event::Created { at_s, mission } => {
                let live = mission.live.as_ref();
                self.live = live.map(|live| MissionClock::new(*at_s, Some(live)));
                *at_s
            }
            Event::Ran { at_s, .. }
            | Event::Paused { at_s }
            | Event::Changed { at_s, .. }
            | Event::Reported { at_s, .. }
            | Event::ClockSet { at_s, .. }
            | Event::Finished { at_s }
            | Event::Failed { at_s, .. } => *at_s,
            Event::Assigned(assigned) => return assigned.t_s,
        };
        match self.live {
            None => self.planned,
            // Exact to the bit for missions on the service's clock.
            Some(MissionClock { rate: 1.0, .. }) => at_s,
            Some(clock) => clock.at(at_s),
        }
    }
}

/// The fixes that the last plan refused: their times by vehicle, s.
pub(super) type Refused = BTreeMap<String, Vec<f64>>;

/// The rows of event `sequence` at `time` on the mission's clock. A refused fix has one row.
pub(super) fn rows<'a>(sequence: u64, time: f64, event: &'a Event, refused: &mut Refused) -> Vec<Row<'a>> {
    let row = Row { sequence: Some(sequence), kind: Some(event.kind()), t_s: Some(time), ..Row::default() };
    match event {
        Event::Created { at_s, .. }
        | Event::Ran { at_s, .. }
        | Event::Paused { at_s }
        | Event::Changed { at_s, .. }
        | Event::ClockSet { at_s, .. }
        | Event::Finished { at_s } => vec![Row { received_s: Some(*at_s), ..row }],
        Event::Failed { at_s, reason } => vec![Row { received_s: Some(*at_s), reason: Some(reason), ..row }],
        Event::Reported { heard, .. } => {
            let row = Row { received_s: Some(heard.received_s.unwrap_or(time)), ..row };
            let craft = heard.craft.as_deref().unwrap_or(SURFACE_CRAFT);
            let states = heard.asc.iter().map(move |state| asc_state(&row, craft, state));
            let fixes = heard
                .auvs
                .iter()
                .flat_map(|(id, fixes)| fixes.iter().map(move |report| fix(&row, id, report)));
            let notes = heard.notes.iter().map(|note| Row {
                kind: Some("note"),
                t_s: Some(note.t_s),
                reason: Some(&note.text),
                ..row
            });
            let vessels = heard.traffic.iter().map(|seen| vessel(&row, seen));
            states.chain(fixes).chain(vessels).chain(notes).collect()
        }
        // A row for each AUV that a craft serves.
        Event::Assigned(assigned) => {
            let parts = assigned.assignment.craft.iter();
            let served = parts.flat_map(|craft| craft.auvs.iter().map(move |auv| (craft, auv)));
            served
                .map(|(craft, auv)| Row { vehicle: Some(&auv.0), reason: Some(&craft.id.0), ..row })
                .collect()
        }
        Event::Planned(plan) => {
            let truths = plan.truth.iter().flat_map(|truth| truths(&row, truth));
            let auvs = plan.prediction.iter().flat_map(|prediction| &prediction.auvs);
            let beliefs = auvs.flat_map(|auv| {
                let belief = match plan.truth {
                    Some(_) => Some(known_of(&row, auv)),
                    None => estimated(&row, auv),
                };
                belief.into_iter().chain(newly_refused(&row, auv, refused))
            });
            let (own, plan) = (&plan.own_craft, [planned(&row, plan)].into_iter());
            let own = own.vessels.iter().map(|seen| vessel(&row, seen));
            plan.chain(truths).chain(beliefs).chain(own).collect()
        }
    }
}

fn asc_state<'a>(row: &Row<'a>, craft: &'a str, report: &AscReport) -> Row<'a> {
    Row {
        kind: Some("asc_state"),
        t_s: Some(report.t_s),
        vehicle: Some(craft),
        north_m: Some(report.state.north_m),
        east_m: Some(report.state.east_m),
        heading_rad: Some(report.state.heading_rad),
        speed_mps: Some(report.state.speed_mps),
        sway_mps: Some(report.state.sway_mps),
        yaw_rate_radps: Some(report.state.yaw_rate_radps),
        ..*row
    }
}

fn fix<'a>(row: &Row<'a>, id: &'a str, report: &Report) -> Row<'a> {
    let [north_m, east_m] = report.position().into();
    Row {
        kind: Some(if report.range_m.is_some() { "range" } else { "fix" }),
        t_s: Some(report.t_s),
        vehicle: Some(id),
        north_m: Some(north_m),
        east_m: Some(east_m),
        range_m: report.range_m,
        depth_m: report.depth_m,
        course_rad: report.course_rad,
        speed_mps: report.speed_mps,
        yaw_rate_radps: report.turn_rate_radps,
        sigma_m: Some(report.sigma_m),
        ..*row
    }
}

fn vessel<'a>(row: &Row<'a>, vessel: &'a Vessel) -> Row<'a> {
    Row {
        kind: Some(VESSEL),
        t_s: vessel.t_s.or(row.t_s),
        vehicle: Some(&vessel.id.0),
        north_m: Some(vessel.north_m),
        east_m: Some(vessel.east_m),
        heading_rad: vessel.heading_rad,
        course_rad: vessel.course_rad,
        speed_mps: vessel.speed_mps,
        sigma_m: vessel.sigma_m,
        length_m: vessel.length_m,
        ..*row
    }
}

fn planned<'a>(row: &Row<'a>, plan: &'a Planned) -> Row<'a> {
    let prediction = plan.prediction.as_deref();
    let goal = prediction.filter(|_| plan.truth.is_none());
    let goal = goal.and_then(|prediction| Some((*prediction.goal.first()?, *prediction.asc.first()?)));
    Row {
        vehicle: plan.craft.as_deref(),
        goal_north_m: goal.map(|(goal, _)| goal[0]),
        goal_east_m: goal.map(|(goal, _)| goal[1]),
        goal_distance_m: goal.map(|(goal, asc)| (goal[0] - asc[0]).hypot(goal[1] - asc[1])),
        predicted_rms_m: prediction.map(|prediction| prediction.rms_m),
        reference_speed_mps: Some(plan.reference.speed_mps),
        reference_heading_rad: Some(plan.reference.heading_rad),
        outcome: Some(outcome(plan.outcome)),
        method: Some(method_name(plan.method)),
        reason: plan.reason.as_deref(),
        solve_ms: Some(Duration::from_nanos(plan.solve_time_ns).as_secs_f64() * 1e3),
        late_s: Some(plan.late_s),
        ..*row
    }
}

/// The last fix of an AUV of a simulated mission, as the plan knew it: its time, and its position
/// if reported. It counts even if the estimate refuses it: position and age belong together.
fn known_of<'a>(row: &Row<'a>, auv: &'a PredictedAuv) -> Row<'a> {
    let since_sent = |sent_s: f64| row.t_s.map(|now| now - sent_s);
    Row {
        kind: Some(KNOWN),
        vehicle: Some(&auv.id),
        north_m: auv.heard.map(|heard| heard.north_m),
        east_m: auv.heard.map(|heard| heard.east_m),
        age_s: auv.heard.map_or(Some(auv.age_s), |heard| since_sent(heard.t_s)),
        ..*row
    }
}

fn estimated<'a>(row: &Row<'a>, auv: &'a PredictedAuv) -> Option<Row<'a>> {
    auv.positions.first().map(|&[north_m, east_m]| Row {
        kind: Some(ESTIMATED),
        vehicle: Some(&auv.id),
        north_m: Some(north_m),
        east_m: Some(east_m),
        depth_m: auv.depths_m.first().copied(),
        age_s: Some(auv.age_s),
        ..*row
    })
}

/// The fixes of an AUV that this plan refuses and the previous one did not.
fn newly_refused<'a>(
    row: &Row<'a>,
    auv: &'a PredictedAuv,
    refused: &mut Refused,
) -> impl Iterator<Item = Row<'a>> + use<'a> {
    let before = refused.insert(auv.id.clone(), auv.refused_t_s.clone()).unwrap_or_default();
    let row = *row;
    let news = auv.refused_t_s.iter().filter(move |time| !before.contains(time));
    news.map(move |&time| Row { kind: Some("refused"), t_s: Some(time), vehicle: Some(&auv.id), ..row })
}

/// The true states of the surface craft, with its goal, of the AUVs and of other vessels.
fn truths<'a>(row: &Row<'a>, truth: &'a Truth) -> impl Iterator<Item = Row<'a>> {
    let craft = Row {
        energy_j: Some(truth.energy_j),
        goal_north_m: Some(truth.goal_north_m),
        goal_east_m: Some(truth.goal_east_m),
        goal_distance_m: Some(truth.distance_m),
        ..is_at(row, SURFACE_CRAFT, &truth.asc)
    };
    let (auvs, row) = (truth.auvs.iter(), *row);
    let auvs = auvs.map(move |(id, auv)| is_at(&row, id, auv));
    let vessels = truth.vessels.iter().map(move |(id, vessel)| Row {
        kind: Some(VESSEL),
        vehicle: Some(id),
        north_m: Some(vessel.north_m),
        east_m: Some(vessel.east_m),
        course_rad: Some(vessel.course_rad),
        speed_mps: Some(vessel.speed_mps),
        length_m: Some(vessel.length_m),
        ..row
    });
    [craft].into_iter().chain(auvs).chain(vessels)
}

fn is_at<'a>(row: &Row<'a>, id: &'a str, vehicle: &TrueVehicle) -> Row<'a> {
    Row {
        kind: Some("truth"),
        vehicle: Some(id),
        north_m: Some(vehicle.north_m),
        east_m: Some(vehicle.east_m),
        depth_m: Some(vehicle.depth_m),
        heading_rad: Some(vehicle.heading_rad),
        speed_mps: Some(vehicle.speed_mps),
        ..*row
    }
}
