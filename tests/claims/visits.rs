//! Goals that visit AUVs, in random snapshots from the accepted range.
//!
//! `FLEETS=10000 cargo test --release -p tests --test claims visits -- --nocapture` tries that many
//! and prints how often the next visit changes.

use std::collections::BTreeMap;

use planner::{
    parameters::Parameters,
    plan::{Workspace, plan},
    snapshot::{Goal, PlanRequest, PreviousPlan, Reduce, Schedule, Snapshot, VehicleId, VisitCost, Visits},
};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tests::random;

fn n_fleets() -> u64 {
    std::env::var("FLEETS").map_or(150, |n| n.parse().expect("FLEETS is a number"))
}

/// A random cost, with any of the optional members.
fn visits(auvs: Vec<VehicleId>, now: f64, rng: &mut impl Rng) -> Visits {
    let of_some = |rng: &mut _, value: f64| -> BTreeMap<VehicleId, f64> {
        let named = auvs.iter().filter(|_| RngExt::random::<f64>(rng) < 0.3);
        named.map(|id| (id.clone(), value)).collect()
    };
    let cost = match rng.random_range(0..3) {
        0 => VisitCost::Age,
        1 => VisitCost::Uncertainty {
            growth_m2ps: 10_f64.powf(rng.random_range(-3.0..1.0)),
            sigma_m: 1.5,
            sigma_rad: 0.02,
            interval_s: 10.0,
        },
        _ => VisitCost::Data {
            growth_kbps: rng.random_range(0.0..5.0),
            upload_kbps: rng.random_range(1.0..50.0),
            range_max_m: rng.random_range(20.0..2000.0),
        },
    };
    let deadline = now + rng.random_range(0.0..3000.0);
    let present = rng.random_range(0.0..1e4);
    Visits {
        serve_by_s: of_some(rng, deadline),
        costs_now: of_some(rng, present),
        weights: of_some(rng, 3.0),
        within_m: rng.random_range(5.0..100.0),
        reduce: if rng.random::<f64>() < 0.5 {
            Reduce::Mean
        } else {
            Reduce::Max
        },
        cost,
        ..Visits::new(auvs)
    }
}

/// Checks properties of any schedule.
fn check(schedule: &Schedule, request: &PlanRequest, seed: u64) {
    let numbers = [schedule.cost, schedule.bound, schedule.gap];
    assert!(
        numbers.iter().all(|number| number.is_finite()),
        "{seed}: {numbers:?}"
    );
    assert!((0.0..=1.0).contains(&schedule.gap), "{seed}: {}", schedule.gap);
    assert!(
        schedule.bound <= schedule.cost * (1.0 + 1e-9),
        "{seed}: {numbers:?}"
    );
    assert!(!schedule.sentence.is_empty(), "{seed}");
    let mut free = f64::NEG_INFINITY;
    for visit in &schedule.visits {
        assert!(request.auv(&visit.auv).is_some(), "{seed}");
        assert!(
            free <= visit.arrive_s && visit.arrive_s <= visit.leave_s,
            "{seed}: {visit:?}"
        );
        free = visit.leave_s;
    }
    let left_out = schedule.costs.iter().filter(|cost| cost.left_out.is_some());
    for cost in left_out {
        assert!(
            schedule.visits.iter().all(|visit| visit.auv != cost.auv),
            "{seed}"
        );
    }
}

#[test]
fn schedules_of_random_fleets_are_finite_ordered_and_repeatable() {
    let (parameters, mut workspace) = (Parameters::default(), Workspace::default());
    let (mut planned, mut changed, mut refused) = (0, 0, 0);
    for seed in 0..n_fleets() {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut request = random::observation(seed);
        let auvs: Vec<_> = request.auvs.iter().map(|auv| auv.id.clone()).collect();
        request.goal = Goal::Visit(visits(auvs, request.t_s, &mut rng)).into();
        let Ok(snapshot) = Snapshot::try_from(request.clone()) else {
            refused += 1;
            continue;
        };
        let first = plan(&snapshot, &parameters, &mut workspace);
        let again = plan(&snapshot, &parameters, &mut Workspace::default());
        assert_eq!(first.schedule, again.schedule, "{seed}");
        assert!(
            first.reference.speed.is_finite() && first.predicted.cost.is_finite(),
            "{seed}"
        );
        let schedule = first
            .schedule
            .as_ref()
            .expect("a goal that visits has a schedule");
        check(schedule, &request, seed);
        // A second later everything is the same.
        request.t_s += 1.0;
        request.previous_plan = Some(PreviousPlan::from(&first));
        let Ok(snapshot) = Snapshot::try_from(request.clone()) else {
            continue;
        };
        let later = plan(&snapshot, &parameters, &mut workspace);
        let later = later.schedule.as_ref().expect("as before");
        check(later, &request, seed);
        // A visit under way may be over.
        if schedule
            .visits
            .first()
            .is_some_and(|visit| request.t_s < visit.arrive_s)
        {
            planned += 1;
            changed += u64::from(schedule.next() != later.next());
        }
    }
    println!(
        "{planned} schedules with the craft on its way, {changed} with another next visit a second later, {refused} refused"
    );
    assert!(
        10 * refused < n_fleets(),
        "{refused} refused: the generator is off"
    );
    assert!(
        20 * changed <= planned,
        "{changed} of {planned} next visits changed"
    );
}
