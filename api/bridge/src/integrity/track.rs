//! Innovation gating with a second hypothesis.

/// Time of consistent misses, s, that become the new truth, if nothing fits the prediction.
const SETTLE_S: f64 = 3.0;
/// Time without support after which a second hypothesis is forgotten, s.
const RIVAL_KEPT_S: f64 = 5.0;
/// Least number of measurements of a second hypothesis.
const RIVAL_COUNT_MIN: u32 = 3;
/// Time without a fit that is contested, s: longer than one outlier of a receiver at 1 Hz.
const UNSETTLED_S: f64 = 2.5;

/// The trusted course of a quantity, and a second one that may replace it.
#[derive(Clone, Debug)]
pub(super) struct Track<T> {
    pub(super) trusted: Option<(f64, T)>,
    rival: Option<Rival<T>>,
    seen_s: Option<f64>,
}

#[derive(Clone, Copy, Debug)]
struct Rival<T> {
    since_s: f64,
    count: u32,
    last: (f64, T),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Fit {
    Fits,
    /// It fits the second hypothesis, which is now trusted, and did not fit the first at once.
    Jumped,
    /// Rejected: outside the gate.
    Missed,
}

impl<T> Default for Track<T> {
    fn default() -> Self {
        Self { trusted: None, rival: None, seen_s: None }
    }
}

impl<T: Copy> Track<T> {
    /// Takes a measurement of `t_s`, s. `fits` tests it against the gate of an earlier one.
    pub(super) fn take(&mut self, t_s: f64, value: T, fits: impl Fn(&(f64, T)) -> bool) -> Fit {
        let newest = (t_s, value);
        let is_first_in_a_while = self.seen_s.replace(t_s).is_none_or(|at| t_s - at > UNSETTLED_S);
        // The first measurement, or the clock was set back.
        if self.trusted.is_none_or(|(at, _)| t_s < at - RIVAL_KEPT_S) {
            (self.trusted, self.rival) = (Some(newest), None);
            return Fit::Fits;
        }
        self.rival = self.rival.filter(|rival| t_s - rival.last.0 <= RIVAL_KEPT_S);
        // The gate opens in silence. Among misses it would only admit one of them.
        let may_fit = |(at, _): &(f64, T)| is_first_in_a_while || t_s - at <= UNSETTLED_S;
        if self.trusted.is_some_and(|trusted| may_fit(&trusted) && fits(&trusted)) {
            self.trusted = Some(newest);
            // The opened gate contains both: they are one, which jumped by little more.
            let held = self.rival.take_if(|rival| fits(&rival.last));
            let has_jumped = held.is_some_and(|rival| rival.count >= RIVAL_COUNT_MIN);
            return if has_jumped { Fit::Jumped } else { Fit::Fits };
        }
        let supported = self.rival.filter(|rival| fits(&rival.last));
        let rival = Rival {
            since_s: supported.map_or(t_s, |rival| rival.since_s),
            count: supported.map_or(0, |rival| rival.count) + 1,
            last: newest,
        };
        self.rival = Some(rival);
        let is_alone = self.trusted.is_none_or(|(at, _)| at < rival.since_s);
        if is_alone && t_s - rival.since_s >= SETTLE_S && rival.count >= RIVAL_COUNT_MIN {
            (self.trusted, self.rival) = (Some(newest), None);
            return Fit::Jumped;
        }
        Fit::Missed
    }

    /// `true` during two hypotheses, or without a recent fit, at the measurement of `t_s`, s.
    pub(super) fn is_contested(&self, t_s: f64) -> bool {
        let Some((trusted_s, _)) = self.trusted else {
            return false;
        };
        let is_double = self.rival.is_some_and(|rival| {
            rival.count >= RIVAL_COUNT_MIN && trusted_s > rival.since_s && t_s - rival.last.0 <= RIVAL_KEPT_S
        });
        is_double || t_s - trusted_s > UNSETTLED_S
    }
}
