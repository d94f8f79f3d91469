//! Association of reports to a track.

use crate::{facts::evidence::Report, tuned::EstimateNumbers};

/// Number of successive agreeing refused reports that replace a track (lost, or from an outlier).
/// With 2 % of outliers spread over 20 m, three agree by chance once in a million.
const AGREEING_TO_TAKE_OVER: usize = 3;

/// The same if the track's velocity leads from the first to the second, rarely by chance.
const AGREEING_TO_BE_MOVED: usize = 2;

/// A filter of a vehicle's motion with a gate.
pub(crate) trait Filter {
    fn tuned(&self) -> &EstimateNumbers;

    /// Updates with `report`, not older than the previous one, if its position is inside the gate.
    fn accept(&mut self, report: &Report) -> Innovation;

    fn found_at(&self, report: &Report) -> Self;
}

/// Innovation of a report's position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Innovation {
    pub(crate) accepted: bool,
    /// Its square, normalised by its covariance.
    pub(crate) normalised: f64,
    /// Its probability density without outliers, 1/m².
    pub(crate) density: f64,
    /// Its square, m².
    pub(crate) square: f64,
    /// Geometric mean of its variances along two axes, m².
    pub(crate) variance: f64,
}

impl Innovation {
    /// Innovation of a report without any remaining hypothesis.
    pub(crate) const REFUSED: Self = Self {
        accepted: false,
        normalised: f64::INFINITY,
        density: 0.0,
        square: f64::INFINITY,
        variance: 0.0,
    };

    /// Logarithm of its probability density, 1/m².
    ///
    /// Outliers have Student's distribution: a distant one is no less probable than a few others.
    pub(crate) fn log_likelihood(&self, tuned: &EstimateNumbers) -> f64 {
        let variance = tuned.outlier_scale * tuned.outlier_scale + self.variance;
        let student = (1.0 + 0.5 * self.square / variance).powi(-2) / (std::f64::consts::TAU * variance);
        (self.density + tuned.outlier_share * student).ln()
    }
}

/// A filter with its accepted reports, numbered and in order of time.
#[derive(Clone, Debug)]
pub(crate) struct Track<F> {
    pub(crate) filter: F,
    pub(crate) used: Vec<(usize, Report)>,
    /// Innovations of all reports but the first, accepted or not.
    pub(crate) innovations: Vec<Innovation>,
}

/// A candidate track of refused reports.
struct Rival<F> {
    /// A new track of these alone.
    afresh: Track<F>,
    /// The vehicle of the track, moved to the last of them.
    moved: Track<F>,
}

impl<F: Filter> Track<F> {
    /// The track through `reports`, at least one, in order of time, with filters from `start`.
    ///
    /// Refused reports may begin a rival track. It takes over once it has enough reports without
    /// one of the track in between, or more than the track at the end.
    pub(crate) fn through(reports: &[(usize, Report)], start: impl Fn(&Report) -> F) -> Self {
        Self::while_promising(reports, start, |_| true).expect("is always promising")
    }

    /// The same, or `None` as soon as an innovation is not `promising`.
    pub(crate) fn while_promising(
        reports: &[(usize, Report)],
        start: impl Fn(&Report) -> F,
        mut promising: impl FnMut(&Innovation) -> bool,
    ) -> Option<Self> {
        let (first, later) = reports.split_first().expect("a snapshot's reports are not empty");
        let mut track = Self::of_one(start(&first.1), first);
        let mut rival: Option<Rival<F>> = None;
        for report in later {
            let innovation = track.accept(report);
            if !promising(&innovation) {
                return None;
            }
            track.innovations.push(innovation);
            if innovation.accepted {
                rival = None;
                continue;
            }
            let moved = Self::of_one(track.filter.found_at(&report.1), report);
            let Some(mut earlier) = rival.take() else {
                let afresh = Self::of_one(start(&report.1), report);
                rival = Some(Rival { afresh, moved });
                continue;
            };
            let agrees = earlier.afresh.accept(report).accepted;
            if earlier.moved.accept(report).accepted && earlier.moved.used.len() == AGREEING_TO_BE_MOVED {
                track = track.followed_by(earlier.moved);
            } else if agrees && earlier.afresh.used.len() == AGREEING_TO_TAKE_OVER {
                track = track.followed_by(earlier.afresh);
            } else {
                let afresh = if agrees { earlier.afresh } else { Self::of_one(start(&report.1), report) };
                rival = Some(Rival { afresh, moved });
            }
        }
        Some(match rival {
            Some(rival) if track.used.len() < rival.afresh.used.len() => track.followed_by(rival.afresh),
            Some(_) | None => track,
        })
    }

    /// Log-likelihoods of the reports but the first.
    pub(crate) fn log_likelihoods(&self) -> impl Iterator<Item = f64> {
        let tuned = self.filter.tuned();
        self.innovations.iter().map(|innovation| innovation.log_likelihood(tuned))
    }

    /// Log-likelihood of all reports but the first.
    pub(crate) fn log_likelihood(&self) -> f64 {
        self.log_likelihoods().sum()
    }

    /// `true` if the reports contradict the motion, or their claimed accuracies.
    pub(crate) fn is_inconsistent(&self) -> bool {
        let accepted = self.innovations.iter().filter(|innovation| innovation.accepted);
        let normalised = mean(accepted.map(|innovation| 0.5 * innovation.normalised));
        self.filter.tuned().normalised_max < normalised || !self.hardly_rejects()
    }

    /// `true` if hardly any report, without the first, is outside the gate.
    pub(crate) fn hardly_rejects(&self) -> bool {
        let refused = |innovation: &Innovation| f64::from(u8::from(!innovation.accepted));
        mean(self.innovations.iter().map(refused)) <= self.filter.tuned().rejected_max
    }

    /// The `rival` in place of this track.
    fn followed_by(self, rival: Self) -> Self {
        Self { innovations: self.innovations, ..rival }
    }

    fn of_one(filter: F, report: &(usize, Report)) -> Self {
        Self { filter, used: vec![*report], innovations: Vec::new() }
    }

    fn accept(&mut self, report: &(usize, Report)) -> Innovation {
        let innovation = self.filter.accept(&report.1);
        if innovation.accepted {
            self.used.push(*report);
        }
        innovation
    }
}

/// The mean, or 0 for an empty iterator.
pub(crate) fn mean(numbers: impl Iterator<Item = f64>) -> f64 {
    let (count, sum) = numbers.fold((0.0, 0.0), |(count, sum), number| (count + 1.0, sum + number));
    if count > 0.0 { sum / count } else { 0.0 }
}
