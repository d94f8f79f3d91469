//! Checks of goals that localise AUVs, and of returned figures.

use super::Check;
use crate::facts::{
    localise::{Figure, Localise},
    ranges::{FIGURE, GOAL_LOCALISE, VISIT_COST, WEIGHT},
};

impl Check {
    pub(super) fn localise(&mut self, localise: &Localise) {
        let values = [
            localise.growth_m2ps,
            localise.sigma_m,
            localise.sigma_rad,
            localise.interval_s,
            localise.stand_off_m,
        ];
        self.numbers("/goal", &GOAL_LOCALISE, values);
        self.each_named("weights", &localise.weights, &localise.auvs, &WEIGHT);
        self.each_named("costs_now", &localise.costs_now, &localise.auvs, &VISIT_COST);
        if localise.auvs.iter().all(|id| localise.weight(id) == 0.0) {
            self.no_weight();
        }
    }

    pub(super) fn figure(&mut self, figure: &Figure) {
        let values = [
            figure.north_m,
            figure.east_m,
            figure.axis_rad,
            figure.ahead_m,
            figure.starboard_m,
            figure.semi_ahead_m,
            figure.semi_starboard_m,
            figure.rate_radps,
            figure.phase_rad,
        ];
        self.numbers("/previous_plan/figure", &FIGURE, values);
    }
}
