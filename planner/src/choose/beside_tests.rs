//! Flights beside a planner that foresees what does not come.

use crate::{
    Parameters,
    craft::CraftEstimate,
    plan::{Workspace, plan},
    tests::prelude::*,
    tuned::Tuned,
};

/// A craft of 1.5 m/s with first-order loops behind an AUV of speed `auv`, m/s, on a straight line
/// or, with `weave`, rad, on a wave. The client gives its exact state each second, with a rate of
/// turn that is wrong by `wrong`, rad/s, so that the planner foresees turns that do not come.
struct Flight {
    auv: f64,
    weave: f64,
    wrong: f64,
    evidence: f64,
}

/// A flight's moment: craft, AUV and the previous answer.
#[derive(Clone)]
struct Moment {
    second: u32,
    place: Vector2<f64>,
    heading: f64,
    speed: f64,
    auv: Vector2<f64>,
    previous: Option<PreviousPlan>,
}

impl Flight {
    fn start(&self) -> Moment {
        let (place, auv) = (Vector2::new(-8.0, 3.0), Vector2::zeros());
        Moment { second: 0, place, heading: 0.0, speed: self.auv, auv, previous: None }
    }

    /// A second of the flight: the distance from the AUV, m, and who steers.
    fn after(&self, moment: &mut Moment, workspace: &mut Workspace) -> (f64, usize) {
        let mut tuned = Tuned::DEFAULT;
        tuned.craft.beside_evidence = self.evidence;
        let time = f64::from(moment.second);
        let course = self.weave * (time / 25.0).sin();
        let mut state = moving(moment.auv.x, moment.auv.y, 5.0, course, self.auv);
        state.turn_rate_radps = self.weave * (time / 25.0).cos() / 25.0 + self.wrong;
        let asc = Asc::new(moment.place, Heading::new(moment.heading), moment.speed);
        let goal = Goal::Track { auv: "auv".into() };
        let mut request = PlanRequest::new(time, asc, vec![Auv::new("auv", state)], goal);
        request.limits = Some(Limits::MEDUSA.into());
        request.previous_plan = moment.previous.take();
        let snapshot = Snapshot::with(request, &tuned, &|| false).expect("is valid");
        let answer = plan(&snapshot, &Parameters::default(), workspace);
        let flown = ((moment.place - moment.auv).norm(), answer.craft.trial.real());
        for _ in 0..10 {
            let turn = wrap(answer.reference.heading.radians() - moment.heading).clamp(-0.3, 0.3);
            let gain = ((answer.reference.speed - moment.speed) / 2.5).clamp(-0.09, 0.09);
            moment.heading = wrap(moment.heading + 0.1 * turn);
            moment.speed += 0.1 * gain;
            moment.place += direction(moment.heading) * (0.1 * moment.speed);
            moment.auv += direction(course) * (0.1 * self.auv);
        }
        (moment.second, moment.previous) = (moment.second + 1, Some(PreviousPlan::from(&answer)));
        flown
    }

    fn flown(&self, seconds: u32) -> Vec<(f64, usize)> {
        let (mut moment, mut workspace) = (self.start(), Workspace::default());
        (0..seconds).map(|_| self.after(&mut moment, &mut workspace)).collect()
    }
}

/// Evidence by which another one steers, s; none is ever enough without a trial.
const USUAL: f64 = Tuned::DEFAULT.craft.beside_evidence;
const NO_TRIAL: f64 = 1e9;

fn rms(flown: &[(f64, usize)]) -> f64 {
    let n = f64::from(u32::try_from(flown.len()).expect("is short"));
    (flown.iter().map(|(distance, _)| distance * distance).sum::<f64>() / n).sqrt()
}

#[test]
fn a_law_steers_within_two_minutes_if_the_planner_foresees_turns_that_do_not_come() {
    let flight = Flight { auv: 1.2, weave: 0.0, wrong: 0.1, evidence: NO_TRIAL };
    let alone = flight.flown(240);
    let beside = Flight { evidence: USUAL, ..flight }.flown(240);
    let first = beside.iter().position(|(_, steers)| 0 < *steers).expect("a law steers");
    assert!(first <= 120, "after {first} s");
    assert!(rms(&beside[150..]) < 0.3 * rms(&alone[150..]));
}

#[test]
fn the_planner_steers_again_by_the_evidence_for_its_simulated_craft_once_the_hold_is_over() {
    let flight = Flight { auv: 1.2, weave: 0.0, wrong: 0.1, evidence: USUAL };
    let (mut moment, mut workspace) = (flight.start(), Workspace::default());
    while flight.after(&mut moment, &mut workspace).1 == 0 {}
    let mut steers = |evidence: f64, since: f64| {
        let mut moment = moment.clone();
        let known = moment.previous.as_mut().and_then(|previous| previous.craft_estimate.as_mut());
        let memory = &mut known.expect("it has one").memory;
        let mut craft = CraftEstimate::from_memory(memory).expect("was just written");
        (craft.trial.crafts[0].evidence, craft.trial.since) = (evidence, since);
        *memory = craft.memory().to_vec();
        flight.after(&mut moment, &mut workspace).1
    };
    assert_eq!(steers(1.5 * USUAL, 1e3), 0);
    assert_ne!(steers(1.5 * USUAL, 10.0), 0);
    assert_ne!(steers(0.5 * USUAL, 1e3), 0);
}

#[test]
fn the_planner_steers_while_no_law_is_much_nearer() {
    for (auv, weave) in [(0.4, 1.0), (1.2, 1.0)] {
        let flown = Flight { auv, weave, wrong: 0.0, evidence: USUAL }.flown(400);
        assert!(flown.iter().all(|(_, steers)| *steers == 0));
    }
}
