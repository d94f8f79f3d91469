//! Which reports belong together.

use crate::facts::evidence::Report;

/// So many reports in a row that the track refuses and that agree with each other are a track of their own: the
/// vehicle is there, and the track was lost, or began with an outlier.
///
/// With 2 % of outliers that are spread over 20 m, three that agree by chance come once in a million.
const AGREEING_TO_TAKE_OVER: usize = 3;

/// As many, where the second is where the vehicle gets to from the first with the velocity that it had: it found out
/// where it is when it surfaced.
///
/// Two of those outliers are so near to each other, 8 m, once in 25 pairs; one refused report in sixty thousand.
const AGREEING_TO_BE_MOVED: usize = 2;

/// Share of fixes outside the gate above which a track does not fit them.
pub(crate) const REJECTED_MAX: f64 = 0.1;

/// Mean normalised innovation squared of an axis above which fixes contradict what they claim; 1 if that is true.
const NORMALISED_MAX: f64 = 1.5;

/// What holds a vehicle's motion, and says which reports fit it.
pub(crate) trait Filter {
    /// Takes `report`, not older than the one before, in, if its position is inside the gate.
    fn accept(&mut self, report: &Report) -> Innovation;

    /// The same vehicle, if it was found at `report`, which is not where it was taken to be.
    #[must_use]
    fn found_at(&self, report: &Report) -> Self;
}

/// How a report's position compares with the one expected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Innovation {
    /// Whether it is inside the gate.
    pub(crate) accepted: bool,
    /// Its square, normalised by its covariance.
    pub(crate) normalised: f64,
    /// Its probability density, 1/m², if it is no outlier.
    pub(crate) density: f64,
    /// Its square, m².
    pub(crate) square: f64,
    /// Geometric mean of its variances along two axes, m².
    pub(crate) variance: f64,
}

/// Share of fixes that are outliers, and their scale along an axis, m. Assumption: multipath in shallow water.
const OUTLIER_SHARE: f64 = 0.02;

/// As above.
const OUTLIER_SCALE: f64 = 20.0;

impl Innovation {
    /// Of a report for which no hypothesis is left.
    pub(crate) const REFUSED: Self = Self {
        accepted: false,
        normalised: f64::INFINITY,
        density: 0.0,
        square: f64::INFINITY,
        variance: 0.0,
    };

    /// Logarithm of its probability density, 1/m².
    ///
    /// Outliers have Student's distribution with two degrees of freedom: one that is far off is improbable, and no more so
    /// than a few fixes of a wrong accuracy.
    pub(crate) fn log_likelihood(&self) -> f64 {
        let variance = OUTLIER_SCALE * OUTLIER_SCALE + self.variance;
        let student = (1.0 + 0.5 * self.square / variance).powi(-2) / (std::f64::consts::TAU * variance);
        (self.density + OUTLIER_SHARE * student).ln()
    }
}

/// A filter, and the reports that are in it, each with its number, in order of time.
#[derive(Clone, Debug)]
pub(crate) struct Track<F> {
    pub(crate) filter: F,
    pub(crate) used: Vec<(usize, Report)>,
    /// Those of all reports but the first, each as it came, whether it is in the filter or not.
    pub(crate) innovations: Vec<Innovation>,
}

/// What reports that a track refused come to.
struct Rival<F> {
    /// Nothing known of the vehicle but these.
    afresh: Track<F>,
    /// From the last of them on, the vehicle of the track.
    moved: Track<F>,
}

impl<F: Filter> Track<F> {
    /// The track through `reports`, at least one, in order of time, with filters that `start` makes of one report.
    ///
    /// What the track refuses may be the beginning of another, which takes over once it holds enough reports with none
    /// in between that the track took, or holds more than the track at the end.
    pub(crate) fn through(reports: &[(usize, Report)], start: impl Fn(&Report) -> F) -> Self {
        let (first, later) = reports.split_first().expect("a snapshot's reports are not empty");
        let mut track = Self::of_one(start(&first.1), first);
        let mut rival: Option<Rival<F>> = None;
        for report in later {
            let innovation = track.accept(report);
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
                let afresh = if agrees {
                    earlier.afresh
                } else {
                    Self::of_one(start(&report.1), report)
                };
                rival = Some(Rival { afresh, moved });
            }
        }
        match rival {
            Some(rival) if track.used.len() < rival.afresh.used.len() => track.followed_by(rival.afresh),
            Some(_) | None => track,
        }
    }

    /// Logarithm of the probability density of all reports but the first.
    pub(crate) fn log_likelihood(&self) -> f64 {
        self.innovations.iter().map(Innovation::log_likelihood).sum()
    }

    /// Whether the reports contradict what holds the motion, or their claims of accuracy.
    pub(crate) fn misfits(&self) -> bool {
        let accepted = self.innovations.iter().filter(|innovation| innovation.accepted);
        let normalised = mean(accepted.map(|innovation| 0.5 * innovation.normalised));
        REJECTED_MAX < self.rejected_share() || NORMALISED_MAX < normalised
    }

    /// Share of the reports but the first that are outside the gate.
    pub(crate) fn rejected_share(&self) -> f64 {
        mean(
            self.innovations
                .iter()
                .map(|innovation| f64::from(u8::from(!innovation.accepted))),
        )
    }

    /// `rival` instead of this track.
    fn followed_by(self, rival: Self) -> Self {
        Self {
            innovations: self.innovations,
            ..rival
        }
    }

    fn of_one(filter: F, report: &(usize, Report)) -> Self {
        Self {
            filter,
            used: vec![*report],
            innovations: Vec::new(),
        }
    }

    fn accept(&mut self, report: &(usize, Report)) -> Innovation {
        let innovation = self.filter.accept(&report.1);
        if innovation.accepted {
            self.used.push(*report);
        }
        innovation
    }
}

/// 0 of none.
pub(crate) fn mean(numbers: impl Iterator<Item = f64>) -> f64 {
    let (count, sum) = numbers.fold((0.0, 0.0), |(count, sum), number| (count + 1.0, sum + number));
    if count > 0.0 { sum / count } else { 0.0 }
}
