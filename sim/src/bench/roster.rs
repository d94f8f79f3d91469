//! Who flies beside the board's usual contenders: for the front of nearness and energy, on another plant, for ablations
//! and for sensitivity.

use planner::{los::LosLaw, policy::Policy};

use super::{
    contender::{AUTO, Contender, Paths, Pilot},
    variation::Twist,
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
pub fn front() -> Vec<Contender> {
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

/// The planner and the laws that may win, all on an Otter in place of a MEDUSA: the planner under its default policy,
/// the laws at gains that are found on the Otter.
#[must_use]
pub fn other_plant() -> Vec<Contender> {
    let laws = LosLaw::ALL.into_iter().filter(|law| law.may_win());
    let flyers = laws
        .map(Contender::law)
        .chain([planner(AUTO, &Policy::default(), None)]);
    let on_an_otter = |contender| Contender {
        twist: Some(Twist::Otter),
        ..contender
    };
    flyers.map(on_an_otter).collect()
}

/// The planner as it is, and without each of its parts in turn. The energy term, whose price is 0 unless asked for, is
/// [`front`]'s.
#[must_use]
pub fn ablations() -> Vec<Contender> {
    let whole = Policy::default();
    let mut contenders = vec![planner(AUTO, &whole, None)];
    for (name, twist) in [
        ("no surge lag", Twist::NoSurgeLag),
        ("no preview of hand-overs", Twist::NoPreview),
    ] {
        contenders.push(planner(name, &whole, Some(twist)));
    }
    let unhurried = Policy {
        heading_rate_max: 10.0,
        ..whole.clone()
    };
    contenders.push(planner("no turn-rate row", &unhurried, Some(Twist::NoTurnRate)));
    let mut without = |name: &str, change: &dyn Fn(&mut Policy)| {
        let mut policy = whole.clone();
        change(&mut policy);
        contenders.push(planner(name, &policy, None));
    };
    without("one pass", &|policy| policy.passes = 1);
    without("no range doubt", &|policy| policy.range_doubt = 0.0);
    without("no doubt of the goal", &|policy| policy.doubtful_share = 1.0);
    without("a law in haste", &|policy| policy.hard_turn_share = 10.0);
    without("no choice by merit", &|policy| policy.merit_decides = false);
    contenders
}

/// Prices of propulsion energy, 1/J: over the default horizon of 78 s, 0.2 m/s take 17 J and a distance of 1 m
/// costs 78.
const ENERGY_WEIGHTS: [f64; 3] = [0.1, 1.0, 10.0];

/// The planner and the two nearest laws under each circumstance; the planner with other horizons, grids and
/// intervals. Another plant is [`other_plant`]'s.
#[must_use]
pub fn sensitivity() -> Vec<Contender> {
    let policy = Policy::default();
    let mut contenders = vec![planner(AUTO, &policy, None)];
    contenders.extend(LAWS.map(Contender::law));
    for (name, twist) in [
        ("hull × 0.7", Twist::Hull(0.7)),
        ("hull × 1.3", Twist::Hull(1.3)),
        ("current wrong by 0.1 m/s north", Twist::WrongCurrent(0.1, 0.0)),
        ("current wrong by 0.1 m/s east", Twist::WrongCurrent(0.0, 0.1)),
        ("clock 5 s ahead", Twist::ClockAhead(5.0)),
        ("fixes 5 s later", Twist::LateReports(5.0)),
    ] {
        contenders.push(planner(name, &policy, Some(twist)));
        contenders.extend(LAWS.map(|law| Contender {
            name: format!("{}, {name}", law.name()),
            twist: Some(twist),
            ..Contender::law(law)
        }));
    }
    contenders.push(planner("asked every 2 s", &policy, Some(Twist::Seldom(2))));
    contenders.push(planner("asked every 5 s", &policy, Some(Twist::Seldom(5))));
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

fn planner(name: &str, policy: &Policy, twist: Option<Twist>) -> Contender {
    Contender {
        pilot: Pilot::Planner {
            policy: Box::new(policy.clone()),
            forecast: None,
        },
        twist,
        ..Contender::planner(name, Paths::AsScenario, None)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn on_another_plant_all_fly_that_and_whoever_may_win_flies() {
        let contenders = other_plant();
        assert!(
            contenders
                .iter()
                .all(|contender| contender.twist == Some(Twist::Otter))
        );
        assert!(contenders.iter().all(Contender::may_win));
        let laws = LosLaw::ALL.into_iter().filter(|law| law.may_win()).count();
        assert_eq!(contenders.len(), laws + 1);
    }

    #[test]
    fn names_are_unique_and_each_part_is_left_out_of_one_contender_only() {
        for contenders in [front(), other_plant(), ablations(), sensitivity()] {
            for (i, contender) in contenders.iter().enumerate() {
                let before = &contenders[..i];
                assert!(
                    before.iter().all(|other| other.name != contender.name),
                    "{}",
                    contender.name
                );
                let same =
                    |other: &Contender| other.pilot == contender.pilot && other.twist == contender.twist;
                assert!(!before.iter().any(same), "{} differs from none", contender.name);
            }
        }
    }
}
