//! From bytes to an answer: any body is read and answered without a panic, every number of the answer is finite, and the answer is
//! accepted as `previous_plan`, at whatever moment the planner is stopped.
//!
//! `PILOTFISH_FUZZ_CASES=1000000 cargo test --release -p tests --test claims fuzz -- --nocapture` tries so many;
//! `PILOTFISH_FUZZ_FIRST=N` begins with case N. How long an answer takes after its deadline: `cargo bench -p tests --bench overrun`.

use tests::{broken::pick, fuzz::Fuzzer};

use crate::deadline::due_at;

/// Number of cases without `PILOTFISH_FUZZ_CASES`.
const CASES: u64 = 150;
/// Number of looks at the stop signal before it says stop: at once, in the first program, after some, never.
const LOOKS: [usize; 5] = [0, 3, 12, 50, usize::MAX];

/// What an environment variable says, if it is there.
fn told<T: std::str::FromStr>(name: &str) -> Option<T> {
    let text = std::env::var(name).ok()?;
    let told = text.parse().ok();
    Some(told.unwrap_or_else(|| panic!("{name} is no number: {text}")))
}

#[test]
fn whatever_bytes_arrive_the_answer_is_finite_and_taken_back() {
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
    assert!(
        tally.values().sum::<u64>() < 4 * tally["planned"],
        "few are valid: {tally:?}"
    );
}
