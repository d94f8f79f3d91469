//! What the surface craft is to do.

use std::collections::BTreeMap;

use nalgebra::Vector2;

use crate::facts::auv::VehicleId;

/// What the surface craft is to do.
#[derive(Clone, Debug, PartialEq)]
pub enum Goal {
    /// Stay above one AUV.
    Track {
        /// The AUV to follow.
        auv: VehicleId,
    },
    /// Follow each AUV in turn for a dwell time: the k-th from `epoch + k·dwell` on, half-open.
    Intermittent {
        /// The AUVs to follow, in order.
        auvs: Vec<VehicleId>,
        /// Time spent with each, s.
        dwell: f64,
        /// When the first dwell of the first AUV began, s on the snapshot's clock.
        epoch: f64,
    },
    /// Stay above the mean of several AUVs.
    Midpoint {
        /// The AUVs whose mean to follow.
        auvs: Vec<VehicleId>,
    },
    /// Stay above the weighted mean of several AUVs.
    Weighted {
        /// The AUVs whose mean to follow, and how much each counts, relative to the others; 0 is not at all.
        weights: BTreeMap<VehicleId, f64>,
    },
    /// Stay within a slant range of every one of several AUVs, and where the worst range is least.
    Range {
        /// The AUVs to stay near.
        auvs: Vec<VehicleId>,
        /// The slant range to stay within, m.
        radius: f64,
    },
}

impl Goal {
    /// The AUVs that the goal depends on, in its order.
    pub fn vehicles(&self) -> impl Iterator<Item = &VehicleId> {
        let (listed, weighted) = match self {
            Self::Track { auv } => (std::slice::from_ref(auv), None),
            Self::Intermittent { auvs, .. } | Self::Midpoint { auvs } | Self::Range { auvs, .. } => {
                (auvs.as_slice(), None)
            }
            Self::Weighted { weights } => ([].as_slice(), Some(weights)),
        };
        let heavy = |(id, weight): (_, &f64)| (0.0 < *weight).then_some(id);
        listed
            .iter()
            .chain(weighted.into_iter().flatten().filter_map(heavy))
    }
}

/// Where the surface craft is to be, seen from what its goal follows: the AUV or, of several, their mean or the
/// place nearest to all.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Offset {
    /// Fixed directions: (north, east), m.
    Ned(Vector2<f64>),
    /// Along the course over ground of what is followed, held while that rests: (ahead, starboard), m.
    Target(Vector2<f64>),
    /// Along the tangent of the path where the AUV is that is followed: (ahead, starboard), m.
    Path(Vector2<f64>),
}
