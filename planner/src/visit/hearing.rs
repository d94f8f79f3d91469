//! Whether an AUV is still heard: its silence counts where it was heard before.

use crate::{
    facts::evidence::{AuvState, Report},
    predict::forecast::SURFACED_DEPTH,
};

/// Mean intervals between reports after which an AUV is silent: with every second report lost, one silence in 65,000 is by chance.
const INTERVALS: f64 = 8.0;

/// Longest gaps between reports after which it is: one that reports in bursts, as at the surface, pauses as long again.
const GAPS: f64 = 2.0;

/// The shortest silence that counts, s.
const SILENCE_MIN: f64 = 60.0;

/// Fewest reports that show at which intervals they come.
const REPORTS_MIN: usize = 5;

/// How an AUV is heard, from plan to plan.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Hearing {
    /// The farthest that it was from the craft when it was heard, horizontal, m.
    pub within: f64,
    /// Whether it is not heard any more.
    pub silent: bool,
}

impl Hearing {
    /// The same at a later plan, for an AUV of which `reports` are known, whose newest made its `state`, taken to be at a `distance`
    /// from the craft, m. Silence of `age_max`, s, counts anywhere, a shorter one no farther away than it was heard before. One that is
    /// silent is so until it is heard.
    #[must_use]
    pub fn later(self, reports: &[Report], state: &AuvState, distance: f64, age_max: f64) -> Self {
        if state.age_s <= silence(reports, state).min(age_max) {
            return Self {
                within: self.within.max(distance),
                silent: false,
            };
        }
        Self {
            silent: self.silent || distance <= self.within || age_max < state.age_s,
            ..self
        }
    }
}

/// The silence, s, that says that an AUV is not heard any more. One that was at the surface has dived: none says it.
fn silence(reports: &[Report], state: &AuvState) -> f64 {
    if reports.len() < REPORTS_MIN || state.depth_m <= SURFACED_DEPTH {
        return f64::INFINITY;
    }
    let mut times: Vec<_> = reports.iter().map(|report| report.t_s).collect();
    times.sort_by(f64::total_cmp);
    let gaps = times.windows(2).map(|pair| pair[1] - pair[0]);
    let longest = gaps.fold(0.0, f64::max);
    #[expect(clippy::cast_precision_loss, reason = "64 reports at most")]
    let mean = (times[times.len() - 1] - times[0]) / (times.len() - 1) as f64;
    (INTERVALS * mean).max(GAPS * longest).max(SILENCE_MIN)
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector2;

    use super::*;
    use crate::facts::angle::Course;

    const AGE_MAX: f64 = 900.0;

    fn state(age_s: f64, depth: f64) -> AuvState {
        AuvState {
            age_s,
            ..AuvState::new(Vector2::zeros(), depth, Course::new(0.0), 0.5)
        }
    }

    /// A report each 10 s, but for those of which `lost` says that they were lost.
    fn reports(lost: impl Fn(u32) -> bool) -> Vec<Report> {
        let kept = (0..40).filter(|k| !lost(*k));
        kept.map(|k| Report::new(10.0 * f64::from(k), Vector2::zeros(), 1.5))
            .collect()
    }

    #[test]
    fn silence_counts_where_an_auv_was_heard_and_until_it_is_heard_again() {
        let all = reports(|_| false);
        let look = |before: Hearing, age, distance| before.later(&all, &state(age, 8.0), distance, AGE_MAX);
        let heard = look(Hearing::default(), 4.0, 300.0);
        assert_eq!(
            heard,
            Hearing {
                within: 300.0,
                silent: false
            }
        );
        assert!(
            !look(heard, 80.0, 100.0).silent,
            "eight intervals are no silence yet"
        );
        assert!(!look(heard, 81.0, 301.0).silent, "so far away it was never heard");
        let silent = look(heard, 81.0, 299.0);
        assert!(silent.silent && look(silent, 82.0, 900.0).silent);
        assert!(!look(silent, 3.0, 250.0).silent);
        assert!(look(heard, AGE_MAX + 1.0, 5000.0).silent);
    }

    #[test]
    fn lost_reports_pauses_and_dives_are_no_silence() {
        let heard = Hearing {
            within: 300.0,
            silent: false,
        };
        let look =
            |reports: &[Report], age, depth| heard.later(reports, &state(age, depth), 10.0, AGE_MAX).silent;
        let every_second = reports(|k| k % 2 == 1);
        assert!(!look(&every_second, 159.0, 8.0) && look(&every_second, 161.0, 8.0));
        // 200 s without a report are followed by as many without surprise.
        let pauses = reports(|k| (10..29).contains(&k));
        assert!(!look(&pauses, 399.0, 8.0) && look(&pauses, 401.0, 8.0));
        assert!(!look(&reports(|_| false), 600.0, 1.0), "it dived");
        assert!(
            !look(&reports(|k| 3 < k), 600.0, 8.0),
            "four reports show no interval"
        );
    }
}
