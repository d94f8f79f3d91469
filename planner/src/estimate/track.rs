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

/// What holds a vehicle's motion, and says which reports fit it.
pub(crate) trait Filter {
    /// Takes `report`, not older than the one before, in, if its position is inside the gate; whether it was.
    fn accept(&mut self, report: &Report) -> bool;

    /// The same vehicle, if it was found at `report`, which is not where it was taken to be.
    #[must_use]
    fn found_at(&self, report: &Report) -> Self;
}

/// A filter, and the reports that are in it, each with its number, in order of time.
#[derive(Clone, Debug)]
pub(crate) struct Track<F> {
    pub(crate) filter: F,
    pub(crate) used: Vec<(usize, Report)>,
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
            if track.accept(report) {
                rival = None;
                continue;
            }
            let moved = Self::of_one(track.filter.found_at(&report.1), report);
            let Some(mut earlier) = rival.take() else {
                let afresh = Self::of_one(start(&report.1), report);
                rival = Some(Rival { afresh, moved });
                continue;
            };
            let agrees = earlier.afresh.accept(report);
            if earlier.moved.accept(report) && earlier.moved.used.len() == AGREEING_TO_BE_MOVED {
                track = earlier.moved;
            } else if agrees && earlier.afresh.used.len() == AGREEING_TO_TAKE_OVER {
                track = earlier.afresh;
            } else {
                let afresh = if agrees {
                    earlier.afresh
                } else {
                    Self::of_one(start(&report.1), report)
                };
                rival = Some(Rival { afresh, moved });
            }
        }
        rival
            .map(|rival| rival.afresh)
            .filter(|rival| track.used.len() < rival.used.len())
            .unwrap_or(track)
    }

    fn of_one(filter: F, report: &(usize, Report)) -> Self {
        Self {
            filter,
            used: vec![*report],
        }
    }

    fn accept(&mut self, report: &(usize, Report)) -> bool {
        let accepted = self.filter.accept(&report.1);
        if accepted {
            self.used.push(*report);
        }
        accepted
    }
}
