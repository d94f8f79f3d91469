//! Contenders beside the usual ones: for the Pareto front of nearness and energy, on another plant, for ablations
//! and for sensitivity.

use planner::{los::LosLaw, policy::Policy};

use super::{
    contender::{AUTO, Contender, Paths, Pilot},
    variation::Variation,
};
use crate::tuning::grid;

/// Scenarios in which the goal is known and jumps, turns about or stops, so that nearness has a price in energy.
pub const TRANSIENTS: [&str; 6] = [
    "switching",
    "switching-opposed",
    "about-face",
    "anti-phase",
    "target-stops",
    "paper-intermittent",
];

/// The planner at several prices of energy, and every law that may win at all gains of its grid.
#[must_use]
pub fn pareto_front() -> Vec<Contender> {
    let whole = Policy::default();
    let mut contenders = vec![planner(AUTO, &whole, None)];
    for weight in ENERGY_WEIGHTS {
        let mut policy = whole.clone();
        policy.weights.energy = weight;
        contenders.push(planner(&format!("energy at {weight}/J"), &policy, None));
    }
    let laws = LosLaw::ALL.into_iter().filter(|law| law.may_win());
    contenders.extend(laws.flat_map(grid).map(|tuning| Contender {
        name: format!(
            "{} {} / {} / {}",
            tuning.law.name(),
            tuning.gains.look_ahead,
            tuning.gains.along_track_gain,
            tuning.integral_gain
        ),
        pilot: Pilot::Tuned(tuning),
        ..Contender::law(tuning.law)
    }));
    contenders
}

/// The planner and the laws that may win, all on an Otter instead of a MEDUSA: the planner under its default policy,
/// the laws at gains that are found on the Otter.
#[must_use]
pub fn other_plant() -> Vec<Contender> {
    let laws = LosLaw::ALL.into_iter().filter(|law| law.may_win());
    let flyers = laws
        .map(Contender::law)
        .chain([planner(AUTO, &Policy::default(), None)]);
    let on_an_otter = |contender| Contender {
        variation: Some(Variation::Otter),
        ..contender
    };
    flyers.map(on_an_otter).collect()
}

/// The planner as it is, and without each of its parts in turn. The energy term, whose price is 0 unless asked for, is
/// [`pareto_front`]'s.
#[must_use]
pub fn ablations() -> Vec<Contender> {
    let whole = Policy::default();
    let mut contenders = vec![planner(AUTO, &whole, None)];
    for (name, variation) in [
        ("no surge lag", Variation::NoSurgeLag),
        ("no preview of hand-overs", Variation::NoPreview),
    ] {
        contenders.push(planner(name, &whole, Some(variation)));
    }
    let unhurried = Policy {
        heading_rate_max: 10.0,
        ..whole.clone()
    };
    contenders.push(planner(
        "no turn-rate row",
        &unhurried,
        Some(Variation::NoTurnRate),
    ));
    let mut without = |name: &str, change: &dyn Fn(&mut Policy)| {
        let mut policy = whole.clone();
        change(&mut policy);
        contenders.push(planner(name, &policy, None));
    };
    without("one SCP iteration", &|policy| policy.scp_iterations = 1);
    without("no range back-off", &|policy| policy.range_back_off = 0.0);
    without("no goal uncertainty", &|policy| {
        policy.uncertain_goal_share = 1.0;
    });
    without("a law in haste", &|policy| policy.hard_turn_share = 10.0);
    without("no choice by predicted cost", &|policy| {
        policy.cost_decides = false;
    });
    contenders
}

/// Prices of propulsion energy, 1/J: over the default horizon of 78 s, 0.2 m/s take 17 J and a distance of 1 m
/// costs 78.
const ENERGY_WEIGHTS: [f64; 3] = [0.1, 1.0, 10.0];

/// The planner and the two best-tuned laws under each circumstance; the planner with other horizons, grids and
/// intervals. Another plant is [`other_plant`]'s.
#[must_use]
pub fn sensitivity() -> Vec<Contender> {
    let policy = Policy::default();
    let mut contenders = vec![planner(AUTO, &policy, None)];
    contenders.extend(LAWS.map(Contender::law));
    for (name, variation) in [
        ("hull × 0.7", Variation::Hull(0.7)),
        ("hull × 1.3", Variation::Hull(1.3)),
        (
            "current wrong by 0.1 m/s north",
            Variation::WrongCurrent(0.1, 0.0),
        ),
        ("current wrong by 0.1 m/s east", Variation::WrongCurrent(0.0, 0.1)),
        ("clock 5 s ahead", Variation::ClockAhead(5.0)),
        ("fixes 5 s later", Variation::LateReports(5.0)),
    ] {
        contenders.push(planner(name, &policy, Some(variation)));
        contenders.extend(LAWS.map(|law| Contender {
            name: format!("{}, {name}", law.name()),
            variation: Some(variation),
            ..Contender::law(law)
        }));
    }
    contenders.push(planner("asked every 2 s", &policy, Some(Variation::Seldom(2))));
    contenders.push(planner("asked every 5 s", &policy, Some(Variation::Seldom(5))));
    for (name, parts) in GRIDS {
        let steps = parts.iter().flat_map(|(n, step)| vec![*step; *n]).collect();
        contenders.push(planner(
            name,
            &Policy {
                steps,
                ..policy.clone()
            },
            None,
        ));
    }
    contenders
}

/// The laws beside which the planner is set under circumstances.
const LAWS: [LosLaw; 2] = [LosLaw::SaturatedLos, LosLaw::TrackerFrame];

type Grid = (&'static str, &'static [(usize, f64)]);

/// Intervals: how many, and of how many seconds. The default is 6 of 1 s, 12 of 2 s and 12 of 4 s.
const GRIDS: [Grid; 4] = [
    ("horizon 42 s", &[(6, 1.0), (12, 2.0), (3, 4.0)]),
    ("horizon 126 s", &[(6, 1.0), (12, 2.0), (24, 4.0)]),
    ("grid half as fine", &[(3, 2.0), (6, 4.0), (6, 8.0)]),
    ("grid twice as fine", &[(12, 0.5), (24, 1.0), (24, 2.0)]),
];

fn planner(name: &str, policy: &Policy, variation: Option<Variation>) -> Contender {
    Contender {
        pilot: Pilot::Planner {
            policy: Box::new(policy.clone()),
            forecast: None,
        },
        variation,
        ..Contender::planner(name, Paths::AsScenario, None)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn on_another_plant_all_fly_that_and_all_that_may_win_fly() {
        let contenders = other_plant();
        assert!(
            contenders
                .iter()
                .all(|contender| contender.variation == Some(Variation::Otter))
        );
        assert!(contenders.iter().all(Contender::may_win));
        let laws = LosLaw::ALL.into_iter().filter(|law| law.may_win()).count();
        assert_eq!(contenders.len(), laws + 1);
    }

    #[test]
    fn names_are_unique_and_each_part_is_left_out_of_one_contender_only() {
        for contenders in [pareto_front(), other_plant(), ablations(), sensitivity()] {
            for (i, contender) in contenders.iter().enumerate() {
                let before = &contenders[..i];
                assert!(
                    before.iter().all(|other| other.name != contender.name),
                    "{}",
                    contender.name
                );
                let same = |other: &Contender| {
                    other.pilot == contender.pilot && other.variation == contender.variation
                };
                assert!(!before.iter().any(same), "{} differs from none", contender.name);
            }
        }
    }
}
