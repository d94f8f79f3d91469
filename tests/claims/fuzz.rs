//! From bytes to an answer: whatever arrives is read and planned for without a panic, every number of the answer is finite, the
//! answer is taken back as `previous_plan`, and the planner stops as soon as it is told to.
//!
//! `PILOTFISH_FUZZ_CASES=1000000 cargo test --release -p tests --test claims fuzz -- --nocapture` tries so many;
//! `PILOTFISH_FUZZ_FIRST=N` begins with case N. How long an answer takes after its deadline: `cargo bench -p tests --bench overrun`.

use std::sync::atomic::Ordering;

use tests::{broken::pick, fuzz::Fuzzer};

use crate::deadline::due_at;

/// How many cases without `PILOTFISH_FUZZ_CASES`.
const CASES: u64 = 150;
/// At which look the planner is told to stop: before anything, within the first program, after some, never.
const LOOKS: [usize; 5] = [0, 3, 12, 50, usize::MAX];
/// How often the planner looks once it is to stop: in the solver, in its SCP iteration, between the iterations.
const LOOKS_AFTER_MAX: usize = 3;

/// What an environment variable says, if it is there.
fn told<T: std::str::FromStr>(name: &str) -> Option<T> {
    let text = std::env::var(name).ok()?;
    let told = text.parse().ok();
    Some(told.unwrap_or_else(|| panic!("{name} is no number: {text}")))
}

#[test]
fn whatever_bytes_arrive_the_answer_is_finite_in_time_and_taken_back() {
    let first: u64 = told("PILOTFISH_FUZZ_FIRST").unwrap_or(0);
    let n_cases = told("PILOTFISH_FUZZ_CASES").unwrap_or(CASES);
    let mut fuzzer = Fuzzer::default();
    let mut most_looks_after = 0;
    for number in first..first + n_cases {
        fuzzer.try_case(number, |rng, answer| {
            let due = *pick(rng, &LOOKS);
            let (stop, looks) = due_at(due);
            answer(&stop);
            most_looks_after = most_looks_after.max(looks.load(Ordering::Relaxed).saturating_sub(due));
        });
    }
    let tally = fuzzer.tally;
    println!("{n_cases} cases from {first} on: {most_looks_after} looks after the signal at most");
    println!("{tally:#?}");
    assert!(most_looks_after <= LOOKS_AFTER_MAX, "{most_looks_after} looks");
    assert!(
        tally.values().sum::<u64>() < 4 * tally["planned"],
        "few are valid: {tally:?}"
    );
}
