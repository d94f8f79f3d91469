//! From bytes to an answer: no body causes a panic, every number of an answer is finite, and the
//! answer is accepted as `previous_plan`, for any stop of the planner.
//!
//! `PILOTFISH_FUZZ_CASES=1000000 cargo test --release -p tests --test claims fuzz -- --nocapture`
//! tries so many, `PILOTFISH_FUZZ_FIRST=N` from case N on.

use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use service::examples::EXAMPLES;
use tests::{
    broken::{BREAKERS, pick},
    fuzz::{Fuzzer, read},
};

use crate::deadline::due_at;

/// Number of cases without `PILOTFISH_FUZZ_CASES`.
const CASES: u64 = 150;
/// Number of looks at the stop signal before it is due: none, in the first program, later, never.
const LOOKS: [usize; 5] = [0, 3, 12, 50, usize::MAX];

/// Value of an environment variable, if it is set.
fn told<T: std::str::FromStr>(name: &str) -> Option<T> {
    let text = std::env::var(name).ok()?;
    let told = text.parse().ok();
    Some(told.unwrap_or_else(|| panic!("{name} is no number: {text}")))
}

#[test]
fn answers_to_any_bytes_are_finite_and_accepted_back() {
    let first: u64 = told("PILOTFISH_FUZZ_FIRST").unwrap_or(0);
    let n_cases = told("PILOTFISH_FUZZ_CASES").unwrap_or(CASES);
    let mut fuzzer = Fuzzer::default();
    for number in first..first + n_cases {
        fuzzer.try_case(number, |rng, answer| {
            answer(&due_at(*pick(rng, &LOOKS)).0);
        });
    }
    let tally = fuzzer.tally;
    println!("{n_cases} cases from {first} on");
    println!("{tally:#?}");
    assert!(tally.values().sum::<u64>() < 4 * tally["planned"], "few are valid: {tally:?}");
}

#[test]
fn a_thousand_broken_bodies_are_refused_at_a_place_and_only_invalid_json_is_no_json() {
    let mut rng = ChaCha8Rng::seed_from_u64(20_260_114);
    let bodies = BREAKERS.iter().cycle().take(1_250);
    let refused = bodies.filter(|break_it| {
        let body = break_it(pick(&mut rng, &EXAMPLES).body, &mut rng);
        read(&body).is_err()
    });
    // Most changes break a request: the reader checks them.
    assert!(1_000 < refused.count());
}
