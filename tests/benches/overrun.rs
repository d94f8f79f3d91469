//! Longest time from the deadline to the answer, over requests of any kind. Reading, estimation
//! from a thousand reports, the law's rollout and writing ignore the deadline.

use std::time::Duration;

use planner::stop::Stop;
use rand::RngExt as _;
use rustix::time::{ClockId, clock_gettime};
use tests::fuzz::Fuzzer;

const CASES: u64 = 5_000;
/// Times until the planner is to stop, ms.
const DEADLINES_MS: [f64; 4] = [1.0, 5.0, 20.0, 100.0];

/// Processor time of this thread, ms. Deadlines by it come as on an idle machine.
fn busy_ms() -> f64 {
    let time = clock_gettime(ClockId::ThreadCPUTime);
    1e3 * Duration::try_from(time).expect("is not negative").as_secs_f64()
}

fn main() {
    let mut fuzzer = Fuzzer::default();
    let mut worst_ms = [f64::NEG_INFINITY; DEADLINES_MS.len()];
    for number in 0..CASES {
        fuzzer.try_case(number, |rng, answer| {
            let k = rng.random_range(0..DEADLINES_MS.len());
            let due_ms = busy_ms() + DEADLINES_MS[k];
            answer(&Stop::when(move || due_ms <= busy_ms()));
            worst_ms[k] = worst_ms[k].max(busy_ms() - due_ms);
        });
    }
    println!("{CASES} cases; the latest answer by deadline:");
    for (deadline_ms, worst_ms) in DEADLINES_MS.iter().zip(worst_ms) {
        println!("{deadline_ms:>4} ms: {worst_ms:+.1} ms");
    }
}
