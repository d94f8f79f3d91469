//! Jobs on several threads, with answers in the order of the jobs.

use std::num::NonZeroUsize;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread;

/// The answers of `jobs` in order, or the error of the first failed job in order. After a failure
/// no further job starts. `done` follows each job, one thread at a time.
pub(super) fn in_parallel<Job: Sync, Answer: Send, Failure: Send>(
    jobs: &[Job],
    threads: NonZeroUsize,
    work: impl Fn(&Job) -> Result<Answer, Failure> + Sync,
    done: &mut (dyn FnMut(&Job, &Result<Answer, Failure>) + Send),
) -> Result<Vec<Answer>, Failure> {
    let next = AtomicUsize::new(0);
    let failed = AtomicBool::new(false);
    let answers: Vec<Mutex<Option<Result<Answer, Failure>>>> =
        jobs.iter().map(|_| Mutex::new(None)).collect();
    let done = Mutex::new(done);
    thread::scope(|scope| {
        for _ in 0..threads.get().min(jobs.len()) {
            scope.spawn(|| {
                while !failed.load(Ordering::Relaxed) {
                    let i = next.fetch_add(1, Ordering::Relaxed);
                    let Some(job) = jobs.get(i) else { break };
                    let answer = work(job);
                    failed.fetch_or(answer.is_err(), Ordering::Relaxed);
                    (*done.lock().expect("showing progress does not panic"))(job, &answer);
                    *answers[i].lock().expect("no job panics while it holds a lock") = Some(answer);
                }
            });
        }
    });
    // Jobs start in order, so missing answers come after the failure.
    let answers = answers.into_iter().map(Mutex::into_inner);
    let answers = answers.filter_map(|answer| answer.expect("no job panics while it holds a lock"));
    answers.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn answers_come_in_the_order_of_the_jobs_on_any_number_of_threads() {
        let jobs: Vec<u64> = (0..100).collect();
        for threads in [1, 2, 7, 200] {
            let mut ended = 0;
            let threads = NonZeroUsize::new(threads).expect("positive");
            let work = |job: &u64| Ok::<_, ()>(job * job);
            let answers = in_parallel(&jobs, threads, work, &mut |_, _| ended += 1);
            assert_eq!(answers, Ok(jobs.iter().map(|job| job * job).collect()));
            assert_eq!(ended, 100);
        }
    }

    #[test]
    fn the_first_failure_in_order_is_returned_and_no_later_job_starts() {
        let jobs: Vec<u64> = (0..1_000).collect();
        let two = NonZeroUsize::new(2).expect("positive");
        let work = |job: &u64| if *job < 5 { Ok(()) } else { Err(*job) };
        let mut ended = 0;
        assert_eq!(in_parallel(&jobs, two, work, &mut |_, _| ended += 1), Err(5));
        assert!(ended < 1_000, "{ended}");
    }
}
