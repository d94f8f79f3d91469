//! The tried gains of line-of-sight laws: the planner is compared with strong laws.

use planner::FixedFigure;
use planner::los::{LawGains, LosGains, LosLaw, LosTuning};
use planner::parameters::Parameters;
use planner::snapshot::FigureKind;
use serde::{Deserialize, Serialize};

/// Look-ahead distances tried, m.
const LOOK_AHEADS: [f64; 5] = [1.0, 3.0, 5.0, 10.0, 20.0];
/// Along-track gains tried, 1/s.
const ALONG_TRACK_GAINS: [f64; 5] = [0.05, 0.1, 0.15, 0.3, 0.6];
/// Integral gains tried, m/s. Behind an AUV at 0.193 m/s, the cross-track damping is 2.2, 1.3, 0.7.
const INTEGRAL_GAINS: [f64; 3] = [0.01, 0.03, 0.1];

/// Radii, m, of figures that AUVs are localised from, and shares of the speed, tried.
const RADII: [f64; 9] = [15.0, 22.0, 30.0, 45.0, 65.0, 95.0, 140.0, 200.0, 290.0];
const SPEED_SHARES: [f64; 2] = [0.7, 1.0];

/// A point of a grid.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Setting {
    pub(crate) gains: Option<LawGains>,
    /// Time of a rule's turn, or of its stay beyond the goal's least time, s.
    pub(crate) dwell_s: Option<f64>,
    /// The only figure that the planner may sail.
    #[serde(default)]
    pub(crate) figure: Option<FixedFigure>,
}

impl Setting {
    /// All gains with all times and figures; an empty list counts as one unset value.
    pub(crate) fn grid(laws: &[LosTuning], dwells: &[f64], figures: &[FixedFigure]) -> Vec<Self> {
        fn some_or_none<T>(all: impl Iterator<Item = T>) -> Vec<Option<T>> {
            let all: Vec<_> = all.map(Some).collect();
            if all.is_empty() { vec![None] } else { all }
        }
        let laws = some_or_none(laws.iter().copied().map(LawGains::from));
        let dwells = some_or_none(dwells.iter().copied());
        let figures = some_or_none(figures.iter().copied());
        let mut grid = vec![];
        for gains in laws {
            for &dwell_s in &dwells {
                grid.extend(figures.iter().map(|&figure| Self { gains, dwell_s, figure }));
            }
        }
        grid
    }
}

/// Grid of a figure: radii × shares of the speed.
pub(crate) fn figures(kind: FigureKind) -> Vec<FixedFigure> {
    if kind == FigureKind::Above {
        return vec![FixedFigure { kind, radius_m: 0.0, speed_share: 1.0 }];
    }
    let all = SPEED_SHARES.iter().flat_map(|&speed_share| RADII.map(|radius_m| (radius_m, speed_share)));
    all.map(|(radius_m, speed_share)| FixedFigure { kind, radius_m, speed_share }).collect()
}

/// `law` with these gains, and the planner's default integral gain if they have none.
pub(crate) fn tuned(law: LosLaw, gains: LawGains) -> LosTuning {
    gains.tuning(law, Parameters::default().integral_gain)
}

/// Grid of `law`: look-aheads × along-track gains, × integral gains for [`LosLaw::Integral`].
pub(crate) fn grid(law: LosLaw) -> Vec<LosTuning> {
    let default = [Parameters::default().integral_gain];
    let integral_gains: &[f64] = match law {
        LosLaw::Integral => &INTEGRAL_GAINS,
        LosLaw::SaturatedLos | LosLaw::TrackerFrame | LosLaw::WaypointBox => &default,
    };
    let mut grid = vec![];
    for &integral_gain in integral_gains {
        for look_ahead in LOOK_AHEADS {
            for along_track_gain in ALONG_TRACK_GAINS {
                grid.push(LosTuning { law, gains: LosGains { look_ahead, along_track_gain }, integral_gain });
            }
        }
    }
    grid
}
