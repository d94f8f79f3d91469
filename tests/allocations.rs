//! A plan in the steady state allocates nothing but in the solver.

use allocation_counter::{measure, opt_out};
use nalgebra::Vector2;
use planner::{
    plan::{Drafts, Workspace, plan, plan_into_with},
    policy::Policy,
    snapshot::{
        Dive, ForecastChoice, ForecastModel, Goal, KeepOut, Observation, Offset, PreviousPlan, Snapshot,
    },
    solve::{Solution, Solvers},
    stop::Stop,
};
use sim::{
    guide::{Guidance, Guide, GuideError},
    mission,
    scenario::Scenario,
};

/// Long enough for catching up, hand-overs and reports that come in, s.
const MISSION: f64 = 90.0;

/// Of so many snapshots of a mission one is planned for.
const EVERY: usize = 4;

/// Scenarios that differ in goal, evidence, forecast and water.
const SCENARIOS: [&str; 8] = [
    "paper-tracking",
    "paper-midpoint",
    "switching",
    "silence-path",
    "noisy-fixes",
    "crowded",
    "slocum",
    "otter",
];

/// What a situation makes of a snapshot.
type Change = fn(&mut Observation);

/// Situations, by name.
const SITUATIONS: [(&str, Change); 6] = [
    ("as it is", |_| {}),
    ("keep-outs and vehicles at the surface", among_discs),
    ("nearest to all, in an area, in acoustic range", near_all),
    ("beside the first", beside_the_first),
    ("without a previous plan", |seen| seen.previous_plan = None),
    ("constant turns", |seen| {
        seen.forecast = ForecastChoice::Model(ForecastModel::ConstantTurn);
    }),
];

/// The planner, and every snapshot that it was given.
#[derive(Default)]
struct Watched {
    policy: Policy,
    workspace: Workspace,
    previous: Option<PreviousPlan>,
    seen: Vec<Observation>,
}

impl Guide for Watched {
    fn name(&self) -> &'static str {
        "mpc"
    }

    fn guide(&mut self, snapshot: &Snapshot) -> Result<Guidance, GuideError> {
        let seen = Observation {
            previous_plan: self.previous.take(),
            ..Observation::clone(snapshot)
        };
        let answer = plan(
            &Snapshot::try_from(seen.clone())?,
            &self.policy,
            &mut self.workspace,
        );
        self.seen.push(seen);
        self.previous = Some(PreviousPlan::from(&answer));
        Ok(Guidance {
            reference: answer.reference,
            method: answer.method,
            predicted_rms: None,
            solve_time: None,
        })
    }
}

#[test]
fn a_plan_like_one_before_allocates_nothing_outside_the_solver() {
    let policy = Policy::default();
    for name in SCENARIOS {
        let mission = mission_of(name);
        for (what, change) in SITUATIONS {
            let snapshots = changed(&mission, change);
            let (mut drafts, mut solvers) = (Drafts::default(), Solvers::default());
            let mut answer = plan(&snapshots[0], &policy, &mut Workspace::default());
            let stop = Stop::never();
            let mut plan_all = || {
                let mut solve = |program: &_, solution: &mut Solution| {
                    opt_out(|| solvers.solve_into(program, &stop, solution));
                };
                for snapshot in &snapshots {
                    plan_into_with(snapshot, &policy, &mut drafts, &stop, &mut solve, &mut answer);
                }
            };
            plan_all();
            let allocated = measure(plan_all);
            assert_eq!(allocated.count_total, 0, "{name}, {what}: {allocated:?}");
        }
    }
}

/// The planner's snapshots of a mission, the plan before each included.
fn mission_of(name: &str) -> Vec<Observation> {
    let scenario = Scenario::named(name).expect("is built in").lasting(MISSION);
    let mut watched = Watched::default();
    mission::run(&scenario, &mut watched, 1, &mut |_| {}).expect("the planner answers");
    watched.seen
}

fn changed(mission: &[Observation], change: Change) -> Vec<Snapshot> {
    let snapshots = mission.iter().step_by(EVERY).cloned().map(|mut seen| {
        change(&mut seen);
        Snapshot::try_from(seen).expect("the change keeps it valid")
    });
    snapshots.collect()
}

fn among_discs(seen: &mut Observation) {
    let disc = |ahead: f64, radius: f64| KeepOut {
        centre: seen.asc.position + seen.asc.heading.unit() * ahead,
        radius,
    };
    seen.keep_outs = vec![disc(30.0, 4.0), disc(12.0, 3.0), disc(-20.0, 5.0)];
    seen.surfacing_separation = Some(5.0);
    for auv in &mut seen.auvs {
        auv.dive = Some(Dive {
            depth_min: 1.0,
            depth_max: 23.0,
            pitch: 0.87,
            reversal: Dive::REVERSAL_MEDUSA,
            descending: None,
        });
    }
}

fn near_all(seen: &mut Observation) {
    seen.goal = Goal::Range {
        auvs: seen.auvs.iter().map(|auv| auv.id.clone()).collect(),
        radius: 60.0,
    };
    seen.range_max = Some(80.0);
    let corner = |north, east| seen.asc.position + Vector2::new(north, east);
    seen.area = vec![
        corner(-40.0, -40.0),
        corner(-40.0, 40.0),
        corner(40.0, 40.0),
        corner(40.0, -40.0),
    ];
}

fn beside_the_first(seen: &mut Observation) {
    seen.goal = Goal::Track {
        auv: seen.auvs[0].id.clone(),
    };
    seen.offset = Some(Offset::Target(Vector2::new(-5.0, 15.0)));
}
