//! The decision of each tick: the plan's reference, or the reason that nothing is sent.

use planner::snapshot::{VESSEL_SEPARATION_DEFAULT, Vessel};

use crate::confirmation::Confirmation;
use crate::follow::mission_log::MissionLog;
use crate::follow::telemetry::Telemetry;
use crate::mavlink::{Action, Authority, Conditions, Control, Parameters, Silence};
use crate::mission_link::LinkStatus;
use crate::output_limiter::{Other, OutputLimiter, OutputLimits};
use crate::reference::Reference;
use crate::{MeasuredState, Plan};

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Sending {
    Active,
    Stopped(Silence),
}

#[derive(Debug, Default)]
pub(super) struct Decision {
    authority: Authority,
    pub(super) limiter: OutputLimiter,
    pub(super) line_of_sight: bool,
    pub(super) dry_run: bool,
    /// Limits that the body of the new mission states; none for a mission that the bridge joins.
    pub(super) limits: Option<OutputLimits>,
    /// Distance to keep from other vessels, m.
    pub(super) separation: f64,
    has_planned: bool,
    /// The last logged use of references.
    pub(super) sending: Option<Sending>,
    confirmation: Option<Confirmation>,
}

impl Decision {
    pub(super) fn new(take_control: bool, line_of_sight: bool, dry_run: bool) -> Self {
        Self {
            authority: Authority::new(take_control),
            line_of_sight,
            dry_run,
            separation: VESSEL_SEPARATION_DEFAULT,
            ..Self::default()
        }
    }

    /// The action at `now`, s, of a craft under `control`; logs changes.
    pub(super) fn decide(
        &mut self,
        now: f64,
        control: Control,
        telemetry: &Telemetry,
        link: &LinkStatus,
        log: &MissionLog,
    ) -> Action {
        self.has_planned |= link.plan.is_some();
        let plan = link.plan.as_deref();
        let known = Conditions {
            control,
            distrust: telemetry.craft.distrusted(),
            state_age: telemetry.state().map(|state| now - state.t_s),
            reference: plan.and_then(|plan| self.reference(plan, now)),
            has_planned: self.has_planned,
            is_paused: link.is_paused,
        };
        let action = self.authority.decide(now, &known);
        if !matches!(action, Action::Send(_)) {
            self.confirmation = None;
        }
        match action {
            Action::Send(_) => self.log_once(Sending::Active, log),
            Action::Offer(_) => self.log_once(Sending::Stopped(Silence::NotGuided), log),
            Action::Silent(silence) => self.log_once(Sending::Stopped(silence), log),
            Action::OrderGuided(_) | Action::OrderArm => {}
        }
        action
    }

    pub(super) fn is_sending(&self) -> bool {
        self.sending == Some(Sending::Active) && !self.dry_run
    }

    pub(super) fn is_steering(&self) -> bool {
        self.is_sending() && !self.line_of_sight && self.limiter.avoided.is_none()
    }

    /// The reference of `plan` at `now`, s; `None` if it is too old.
    pub(super) fn reference(&self, plan: &Plan, now: f64) -> Option<Reference> {
        let planned = plan.planned.at(now)?;
        let reference = if self.line_of_sight { plan.line_of_sight } else { planned };
        OutputLimiter::may_follow(plan.arrived_s, now).then_some(reference)
    }

    /// `reference` of `now`, s, or another that keeps clear of other vessels near the craft in
    /// `state`.
    pub(super) fn clear_of_vessels(
        &mut self,
        now: f64,
        reference: &Reference,
        telemetry: &Telemetry,
        plan: &Plan,
        limits: &OutputLimits,
    ) -> Reference {
        let Some(state) = telemetry.state() else { return *reference };
        let near = telemetry.vessels.near(now, &state.position);
        let seen = |(_, vessel): &(f64, Vessel)| {
            Other::seen(vessel, now, &state.position, self.separation, &plan.answer.plan)
        };
        let others: Vec<Other> = near.iter().filter_map(seen).collect();
        let follows_plan = !self.line_of_sight;
        let asked = |later: f64| plan.planned.at(now + later).filter(|_| follows_plan).unwrap_or(*reference);
        self.limiter.clear_of(now, asked, &others, limits)
    }

    /// Limits `reference` for the craft in `state`, which later confirms that it follows.
    pub(super) fn limited(
        &mut self,
        now: f64,
        reference: &Reference,
        state: &MeasuredState,
        limits: &OutputLimits,
    ) -> Option<Reference> {
        let craft = Reference { speed: state.speed(), heading: state.heading };
        let sent = self.limiter.limit(now, reference, &craft, limits)?;
        let begin = || Confirmation::begin(now, state);
        let confirmation = self.confirmation.get_or_insert_with(begin);
        confirmation.take(now, state, &sent);
        Some(sent)
    }

    /// The limits of output: the lowest ones of mission and autopilot.
    pub(super) fn output_limits(&self, link: &LinkStatus, parameters: &Parameters) -> OutputLimits {
        let of_the_mission = || {
            let limits = link.setting.limits.flatten().unwrap_or_default();
            let craft = link.setting.craft.clone().flatten().unwrap_or_default();
            OutputLimits::declared(&limits, &craft)
        };
        self.limits.unwrap_or_else(of_the_mission).within(parameters)
    }

    /// The motions that are not confirmed at `now`, s, in words.
    pub(super) fn unconfirmed(&self, now: f64) -> impl Iterator<Item = &'static str> {
        self.confirmation.iter().flat_map(move |seen| seen.missing(now))
    }

    /// Logs changes between sending and the reasons for silence.
    fn log_once(&mut self, sending: Sending, log: &MissionLog) {
        if self.sending.replace(sending) == Some(sending) {
            return;
        }
        match sending {
            Sending::Stopped(silence) if silence.is_meant() => log.info(&silence.to_string()),
            Sending::Stopped(silence) => log.warn(&silence.to_string()),
            Sending::Active if self.dry_run => log.info("references would be sent: this is a dry run"),
            Sending::Active => log.info("references are sent"),
        }
    }
}
