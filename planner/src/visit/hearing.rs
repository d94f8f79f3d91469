//! Silence of AUVs, counted while the craft is where it heard them before.

use crate::facts::evidence::Report;
use crate::predict::forecast::{BETWEEN_MIN, SURFACED_DEPTH};
use crate::snapshot::build::Snapshot;
use crate::tuned::VisitNumbers;

/// Fewest reports for an estimate of their intervals.
const REPORTS_MIN: usize = 5;

/// Hearing of an AUV, from plan to plan.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Hearing {
    /// Largest horizontal distance from the craft while its reports arrived, m.
    pub within: f64,
    /// Time spent within that distance since its newest report, s.
    pub unheard: f64,
}

/// Present evidence of an AUV.
#[derive(Clone, Copy, Debug)]
pub struct Heard<'a> {
    tuned: &'a VisitNumbers,
    reports: &'a [Report],
    /// Age of its newest report, s, and its horizontal distance from the craft, m.
    age: f64,
    distance: f64,
}

impl<'a> Heard<'a> {
    /// Evidence of the snapshot's AUV `auv`, at a horizontal `distance` from the craft, m.
    pub fn of(snapshot: &'a Snapshot, auv: usize, distance: f64) -> Self {
        Self {
            tuned: &snapshot.tuned().visit,
            reports: snapshot.auvs[auv].reports.as_deref().unwrap_or_default(),
            age: snapshot.estimates()[auv].state.age_s,
            distance,
        }
    }

    /// Mean and longest interval of its reports, s, if enough; simultaneous ones count once.
    fn intervals(&self) -> Option<[f64; 2]> {
        let mut times: Vec<_> = self.reports.iter().map(|report| report.t_s).collect();
        times.sort_by(f64::total_cmp);
        times.dedup_by(|later, earlier| *later - *earlier < BETWEEN_MIN);
        if times.len() < REPORTS_MIN {
            return None;
        }
        let gaps = times.windows(2).map(|pair| pair[1] - pair[0]);
        let mean = gaps.clone().sum::<f64>() / (times.len() - 1) as f64;
        Some([mean, gaps.fold(0.0, f64::max)])
    }

    fn surfaced(&self) -> bool {
        let times = self.reports.iter().map(|report| report.t_s);
        let newest = times.fold(f64::NEG_INFINITY, f64::max);
        let at_surface = |report: &Report| report.depth_m.is_some_and(|depth| depth <= SURFACED_DEPTH);
        let mut reports = self.reports.iter();
        reports.any(|report| newest - report.t_s < BETWEEN_MIN && at_surface(report))
    }

    /// Time without a report until silence, s; endless for an AUV last heard at the surface.
    fn silence(&self) -> f64 {
        match self.intervals() {
            Some([mean, longest]) if !self.surfaced() => (self.tuned.silent_intervals * mean)
                .max(self.tuned.silent_gaps * longest)
                .max(self.tuned.silence_min),
            _ => f64::INFINITY,
        }
    }
}

impl Hearing {
    /// The hearing `elapsed` s later. A distance without reports is not in range.
    #[must_use]
    pub fn later(mut self, elapsed: f64, heard: &Heard) -> Self {
        if heard.distance <= self.within {
            self.unheard += elapsed.min(heard.tuned.listened_max);
        }
        self.unheard = self.unheard.min(heard.age);
        if heard.intervals().is_some_and(|[mean, _]| heard.age <= mean) {
            self.within = self.within.max(heard.distance);
        }
        self
    }

    /// `true` if the AUV is silent where it was heard, or anywhere for longer than `age_max`, s.
    pub fn is_silent(&self, heard: &Heard, age_max: f64) -> bool {
        heard.silence() < self.unheard || age_max < heard.age
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector2;

    use super::*;

    const AGE_MAX: f64 = 900.0;
    /// Interval between plans, s.
    const STEP: f64 = 1.0;
    const TUNED: &VisitNumbers = &VisitNumbers::DEFAULT;

    /// A report each 10 s until 0 s, without the `lost` ones; the newest is number 0.
    fn reports(depth_m: Option<f64>, lost: impl Fn(u32) -> bool) -> Vec<Report> {
        let at = |k| Report { depth_m, ..Report::new(-10.0 * f64::from(k), Vector2::zeros(), 1.5) };
        (0..40).filter(|k| !lost(*k)).map(at).collect()
    }

    /// First age, s, at which an AUV is silent, with the craft at `distance` at each age.
    fn silent_at(reports: &[Report], distance: impl Fn(f64) -> f64) -> f64 {
        let (mut hearing, mut age) = (Hearing::default(), 0.0);
        loop {
            let heard = Heard { tuned: TUNED, reports, age, distance: distance(age) };
            hearing = hearing.later(STEP, &heard);
            if hearing.is_silent(&heard, AGE_MAX) {
                return age;
            }
            age += STEP;
        }
    }

    #[test]
    fn an_auv_is_silent_after_eight_intervals_in_range_or_the_largest_age_anywhere() {
        let all = reports(Some(8.0), |_| false);
        assert_eq!(silent_at(&all, |_| 300.0), 81.0);
        // While reports arrive, the hearing range extends to the craft's distance.
        assert_eq!(silent_at(&all, |age| 300.0 + age.min(11.0)), AGE_MAX + STEP);
        assert_eq!(silent_at(&[], |_| 0.0), AGE_MAX + STEP);
        // Away from an age of 21 s for ten minutes, then back: 61 s more make 81.
        let away = |age: f64| f64::from(u8::from((20.5..620.5).contains(&age)));
        assert_eq!(silent_at(&all, |age| 250.0 + 900.0 * away(age)), 681.0);
    }

    #[test]
    fn a_silent_auv_stays_silent_until_a_report_arrives() {
        let all = reports(Some(8.0), |_| false);
        let (within, unheard) = (300.0, 81.0);
        for (age, expected) in [(700.0, true), (3.0, false)] {
            let heard = Heard { tuned: TUNED, reports: &all, age, distance: 5000.0 };
            let hearing = Hearing { within, unheard }.later(STEP, &heard);
            assert_eq!(hearing.is_silent(&heard, AGE_MAX), expected);
        }
    }

    #[test]
    fn lost_or_repeated_reports_pauses_and_dives_are_no_silence() {
        let never = AGE_MAX + STEP;
        let once = |depth, lost: fn(u32) -> bool| reports(depth, lost);
        let twice = |lost| once(Some(8.0), lost).into_iter().flat_map(|report| [report; 2]).collect();
        for (reports, expected) in [
            (once(Some(8.0), |k| k % 2 == 1), 161.0),
            // After 200 s without a report, as many are no silence.
            (once(Some(8.0), |k| (10..29).contains(&k)), 401.0),
            (once(Some(1.0), |_| false), never),
            (once(None, |_| false), 81.0),
            (twice(|_| false), 81.0),
            // Four reports show no interval.
            (twice(|k| 3 < k), never),
        ] {
            assert_eq!(silent_at(&reports, |_| 10.0), expected);
        }
    }
}
