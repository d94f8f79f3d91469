//! Which reports belong together.

use crate::snapshot::Report;

/// So many reports in a row that the track refuses and that agree with each other are a track of their own: the
/// vehicle is there, and the track was lost, or began with an outlier.
///
/// With 2 % of outliers that are spread over 20 m, three that agree by chance come once in a million.
const AGREEING_TO_TAKE_OVER: usize = 3;

/// What holds a vehicle's motion, and tells which reports fit it.
pub(super) trait Filter {
    /// Takes `report`, not older than the one before, in, if its position is inside the gate; whether it was.
    fn accept(&mut self, report: &Report) -> bool;
}

/// A filter, and the reports that are in it, each with its number, in order of time.
#[derive(Clone, Debug)]
pub(super) struct Track<F> {
    pub(super) filter: F,
    pub(super) used: Vec<(usize, Report)>,
}

impl<F: Filter> Track<F> {
    /// The track through `reports`, at least one, in order of time, with filters that `start` makes of one report.
    ///
    /// What the track refuses may be the beginning of another, which takes over once it holds enough reports with none
    /// in between that the track took, or holds more than the track at the end.
    pub(super) fn through(reports: &[(usize, Report)], start: impl Fn(&Report) -> F) -> Self {
        let start = |numbered: &(usize, Report)| Self {
            filter: start(&numbered.1),
            used: vec![*numbered],
        };
        let (first, later) = reports.split_first().expect("a snapshot's reports are not empty");
        let mut track = start(first);
        let mut rival: Option<Self> = None;
        for report in later {
            if track.accept(report) {
                rival = None;
                continue;
            }
            let next = rival
                .and_then(|mut rival| rival.accept(report).then_some(rival))
                .unwrap_or_else(|| start(report));
            if next.used.len() == AGREEING_TO_TAKE_OVER {
                track = next;
                rival = None;
            } else {
                rival = Some(next);
            }
        }
        rival
            .filter(|rival| track.used.len() < rival.used.len())
            .unwrap_or(track)
    }

    fn accept(&mut self, report: &(usize, Report)) -> bool {
        let accepted = self.filter.accept(&report.1);
        if accepted {
            self.used.push(*report);
        }
        accepted
    }
}
