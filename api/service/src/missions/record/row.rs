//! What events tell, as rows of the table.

use std::time::Duration;

use ::record::table::{Row, SURFACE_CRAFT};
use sim::record::method_name;

use crate::missions::{
    clock::Clock,
    event::{Event, Planned},
};
use wire::{
    Outcome, Report,
    mission::{AscReport, TrueVehicle, Truth},
};

pub(super) fn outcome(outcome: Outcome) -> &'static str {
    match outcome {
        Outcome::Ok => "ok",
        Outcome::Degraded => "degraded",
    }
}

/// What a mission's clock showed, learnt from its events in order.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Timeline {
    /// A live mission's runs by itself.
    live: Option<Clock>,
    /// A simulated one's stands still from one plan to the next: when the last was made, s since the start.
    planned: f64,
}

impl Timeline {
    /// What it showed at the event, s.
    pub(super) fn take_up(&mut self, event: &Event) -> f64 {
        let at_s = match event {
            Event::Planned(plan) => {
                self.planned = plan.t_s;
                return plan.t_s;
            }
            Event::Created { at_s, mission } => {
                let live = mission.live.as_ref();
                self.live = live.map(|live| Clock::new(*at_s, Some(live)));
                *at_s
            }
            Event::Ran { at_s, .. }
            | Event::Paused { at_s }
            | Event::Changed { at_s, .. }
            | Event::Reported { at_s, .. }
            | Event::ClockSet { at_s, .. }
            | Event::Finished { at_s }
            | Event::Failed { at_s, .. } => *at_s,
        };
        match self.live {
            None => self.planned,
            // To the bit, where the mission's clock is the service's.
            Some(Clock { rate: 1.0, .. }) => at_s,
            Some(clock) => clock.at(at_s),
        }
    }
}

/// What the event numbered `sequence` tells, when the mission's clock showed `time`.
pub(super) fn rows(sequence: u64, time: f64, event: &Event) -> Vec<Row<'_>> {
    let row = Row {
        sequence: Some(sequence),
        kind: Some(event.kind()),
        t_s: Some(time),
        ..Row::default()
    };
    match event {
        Event::Created { at_s, .. }
        | Event::Ran { at_s, .. }
        | Event::Paused { at_s }
        | Event::Changed { at_s, .. }
        | Event::ClockSet { at_s, .. }
        | Event::Finished { at_s } => vec![Row {
            received_s: Some(*at_s),
            ..row
        }],
        Event::Failed { at_s, reason } => vec![Row {
            received_s: Some(*at_s),
            reason: Some(reason),
            ..row
        }],
        Event::Reported { heard, .. } => {
            let row = Row {
                received_s: Some(heard.received_s.unwrap_or(time)),
                ..row
            };
            let states = heard.asc.iter().map(|state| asc_state(&row, state));
            let fixes = heard
                .auvs
                .iter()
                .flat_map(|(id, fixes)| fixes.iter().map(move |report| fix(&row, id, report)));
            states.chain(fixes).collect()
        }
        Event::Planned(plan) => {
            let truths = plan.truth.iter().flat_map(|truth| truths(&row, truth));
            [planned(&row, plan)].into_iter().chain(truths).collect()
        }
    }
}

fn asc_state<'a>(row: &Row<'a>, report: &AscReport) -> Row<'a> {
    Row {
        kind: Some("asc_state"),
        t_s: Some(report.t_s),
        vehicle: Some(SURFACE_CRAFT),
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
    Row {
        kind: Some("fix"),
        t_s: Some(report.t_s),
        vehicle: Some(id),
        north_m: Some(report.north_m),
        east_m: Some(report.east_m),
        depth_m: report.depth_m,
        course_rad: report.course_rad,
        speed_mps: report.speed_mps,
        yaw_rate_radps: report.turn_rate_radps,
        sigma_m: Some(report.sigma_m),
        ..*row
    }
}

fn planned<'a>(row: &Row<'a>, plan: &'a Planned) -> Row<'a> {
    Row {
        reference_speed_mps: Some(plan.reference.speed_mps),
        reference_heading_rad: Some(plan.reference.heading_rad),
        outcome: Some(outcome(plan.outcome)),
        method: Some(method_name(plan.method.into())),
        reason: plan.reason.as_deref(),
        solve_ms: Some(Duration::from_nanos(plan.solve_time_ns).as_secs_f64() * 1e3),
        late_s: Some(plan.late_s),
        ..*row
    }
}

/// The surface craft with its goal, and the AUVs.
fn truths<'a>(row: &Row<'a>, truth: &'a Truth) -> impl Iterator<Item = Row<'a>> {
    let craft = Row {
        energy_j: Some(truth.energy_j),
        goal_north_m: Some(truth.goal_north_m),
        goal_east_m: Some(truth.goal_east_m),
        goal_distance_m: Some(truth.distance_m),
        ..is_at(row, SURFACE_CRAFT, &truth.asc)
    };
    let (auvs, row) = (truth.auvs.iter(), *row);
    [craft]
        .into_iter()
        .chain(auvs.map(move |(id, auv)| is_at(&row, id, auv)))
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
