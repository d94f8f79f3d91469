//! Limits of position at the stages, in the craft's frame: ranges, discs, edges and minimax AUVs.

use std::iter::repeat_n;

use nalgebra::Vector2;
use smallvec::SmallVec;

use crate::coast::sides::nearest_on;
use crate::craft::response::Stage;
use crate::facts::angle::starboard_of;
use crate::facts::auv::VehicleId;
use crate::facts::bounds::KeepOut;
use crate::facts::goal::Goal;
use crate::facts::ranges::{AUVS_MAX, KEEP_OUTS_MAX};
use crate::predict::forecast::AuvForecast;
use crate::predict::goal::GoalForecast;
use crate::predict::motion::Motion;
use crate::predict::vessel::VesselForecast;
use crate::problem::common_point::{Circle, have_a_common_point};
use crate::problem::frame::Frame;
use crate::problem::limits::{AcousticRange, Disc, Edge, MinimaxRange};
use crate::problem::parameters::Parameters;
use crate::problem::violation::Subject;
use crate::snapshot::build::Snapshot;

/// Radius of an inactive disc, m. Its value decides at which share of an interval a disc appears.
const NOT_THERE: f64 = -1.0;

/// Most vessels in a program. Fewer are filled up to a power of two, for few shapes.
const VESSELS_MOST: usize = 8;

/// Limits of the craft's position, and the AUVs of a minimax range.
#[derive(Clone, Debug)]
pub(crate) struct StageConstraints {
    pub(crate) ranges: Vec<AcousticRange>,
    pub(crate) discs: Vec<Disc>,
    pub(crate) edges: Vec<Edge>,
    pub(crate) minimax: Vec<MinimaxRange>,
    /// Snapshot indices of the keep-outs, which are the first discs, in their order.
    keep_outs: Vec<usize>,
    /// Snapshot indices of the AUVs, in the order of their ranges and discs; first the goal's own.
    auvs: Vec<usize>,
    /// Snapshot indices of the vessels that may come near, and the place of the first one's disc.
    vessels: Vec<usize>,
    first_vessel: usize,
    /// Snapshot indices of the AUVs whose range cannot be kept, ascending.
    pub(crate) range_unattainable: Vec<usize>,
}

/// Priority of a limit of acoustic range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum RangePriority {
    /// For an AUV that the goal names.
    Named,
    /// For another AUV.
    Other,
    /// For another AUV, and unattainable: reported as violated, without cost.
    GivenUp,
}

impl StageConstraints {
    /// The constraints at `times` after the snapshot, for a `goal` that is now at `goal_now`.
    pub(crate) fn new(
        snapshot: &Snapshot,
        parameters: &Parameters,
        frame: &Frame,
        times: &[f64],
        goal_now: &Vector2<f64>,
        goal: &GoalForecast,
    ) -> Self {
        let forecasts = goal.auvs();
        // In geometric order, so that the order of names has no effect.
        let centres = snapshot.keep_outs.iter().map(KeepOut::centre);
        let keep_outs = sorted(centres, frame);
        let positions = forecasts.iter().map(|forecast| forecast.at(0.0).position);
        let mut auvs = sorted(positions, frame);
        // Stale AUVs impose no limits.
        auvs.retain(|auv| !parameters.is_stale(&snapshot.estimates()[*auv]));
        let named = |auv: usize| {
            let id = &snapshot.auvs[auv].id;
            snapshot.goal.goal.vehicles().any(|named| named == id)
        };
        let (first, others): (Vec<_>, Vec<_>) = auvs.into_iter().partition(|auv| named(*auv));
        // Those that other craft serve last: they limit no range.
        let (others, of_others): (Vec<_>, Vec<_>) =
            others.into_iter().partition(|auv| !snapshot.is_of_another(*auv));
        let auvs = [first, others, of_others].concat();

        let sampling = Sampling { frame, times };
        let mut discs: Vec<Disc> = keep_outs
            .iter()
            .map(|place| {
                let keep_out = &snapshot.keep_outs[*place];
                sampling.fixed_disc(&keep_out.centre(), keep_out.radius_m)
            })
            .collect();
        let stand_off = match &snapshot.goal.goal {
            Goal::Localise(localise) => localise.stand_off_m,
            _ => 0.0,
        };
        let separation = snapshot.surfacing_separation_m;
        if separation.is_some() || 0.0 < stand_off {
            let moving = |auv: &usize| {
                let always = if named(*auv) { stand_off } else { 0.0 };
                sampling.separation_disc(&forecasts[*auv], separation.unwrap_or(0.0), always)
            };
            discs.extend(auvs.iter().map(moving));
        }
        let (vessels, first_vessel) = (sampling.near_vessels(goal.vessels(), snapshot), discs.len());
        discs.extend(vessels.iter().map(|vessel| sampling.vessel_disc(vessel)));
        let filled = vessels.len().next_power_of_two().min(VESSELS_MOST);
        discs.extend((vessels.len()..filled).filter(|_| !vessels.is_empty()).map(|_| sampling.no_disc()));
        let ranges = snapshot.range_max().map_or_else(Vec::new, |range_max| {
            let range = |auv: &usize| AcousticRange {
                named: named(*auv),
                ..sampling.acoustic_range(&forecasts[*auv], range_max, parameters.range_back_off)
            };
            auvs.iter().filter(|auv| !snapshot.is_of_another(**auv)).map(range).collect()
        });
        let counting = auvs.iter().filter(|auv| is_minimax(snapshot, &snapshot.auvs[**auv].id));
        let minimax = counting.map(|auv| sampling.minimax_range(&forecasts[*auv]));
        let mut constraints = Self {
            minimax: minimax.collect(),
            edges: edges(&snapshot.area, frame).collect(),
            ranges,
            discs,
            keep_outs,
            auvs,
            vessels: vessels.iter().map(|vessel| vessel.vessel).collect(),
            first_vessel,
            range_unattainable: Vec::new(),
        };
        constraints.give_up_unattainable_ranges(goal_now);
        constraints
    }

    /// Finds the ranges that cannot be kept now, and gives up those of AUVs that the goal does not
    /// name: half-way between two AUVs out of range, a craft serves neither.
    ///
    /// Among the named AUVs, if no point is in range of all: those out of range at the goal. Among
    /// the others, from the nearest to the goal: each without a common point with all kept so far.
    fn give_up_unattainable_ranges(&mut self, goal: &Vector2<f64>) {
        let circle = |range: &AcousticRange| (range.centres[0], range.radii[0]);
        let distance = |range: &AcousticRange| (range.centres[0] - goal).norm();
        let n_named = self.ranges.iter().filter(|range| range.named).count();
        let mut kept: SmallVec<[Circle; AUVS_MAX]> = self.ranges[..n_named].iter().map(circle).collect();
        if !have_a_common_point(&kept) {
            let named = self.ranges[..n_named].iter().zip(&self.auvs);
            let out_of_range = named.filter(|(range, _)| range.radii[0] < distance(range));
            self.range_unattainable.extend(out_of_range.map(|(_, auv)| *auv));
        }
        let mut others: SmallVec<[usize; AUVS_MAX]> = (n_named..self.ranges.len()).collect();
        others.sort_by(|a, b| distance(&self.ranges[*a]).total_cmp(&distance(&self.ranges[*b])));
        for i in others {
            kept.push(circle(&self.ranges[i]));
            if !have_a_common_point(&kept) {
                kept.pop();
                self.range_unattainable.push(self.auvs[i]);
            }
        }
        self.range_unattainable.sort_unstable();
    }

    /// The AUVs whose ranges have this priority.
    pub(crate) fn ranges(&self, priority: RangePriority) -> impl Iterator<Item = (Subject, &AcousticRange)> {
        let ranges = self.auvs.iter().zip(&self.ranges);
        let of_it = ranges.filter(move |(auv, range)| self.priority(**auv, range) == priority);
        of_it.map(|(auv, range)| (Subject::Auv(*auv), range))
    }

    fn priority(&self, auv: usize, range: &AcousticRange) -> RangePriority {
        if range.named {
            RangePriority::Named
        } else if self.range_unattainable.contains(&auv) {
            RangePriority::GivenUp
        } else {
            RangePriority::Other
        }
    }

    pub(crate) fn keep_outs(&self) -> impl Iterator<Item = (Subject, &Disc)> {
        let keep_outs = self.keep_outs.iter().copied();
        keep_outs.map(Subject::KeepOut).zip(&self.discs)
    }

    /// The discs about AUVs that may be at the surface, if a distance is to be kept.
    pub(crate) fn separations(&self) -> impl Iterator<Item = (Subject, &Disc)> {
        let moving = &self.discs[self.keep_outs.len()..self.first_vessel];
        self.auvs.iter().copied().map(Subject::Auv).zip(moving)
    }

    /// The discs about vessels that may come near.
    pub(crate) fn vessels(&self) -> impl Iterator<Item = (Subject, &Disc)> {
        self.vessels.iter().copied().map(Subject::Vessel).zip(&self.discs[self.first_vessel..])
    }

    /// For a minimax goal: the squared range at stage k minus the least possible one, m².
    pub(crate) fn minimax_excess(
        &self,
        k: usize,
        position: &Vector2<f64>,
        goal: &Vector2<f64>,
    ) -> Option<f64> {
        let worst = |place: &Vector2<f64>| {
            let range = |member: &MinimaxRange| {
                (place - member.positions[k]).norm_squared() + member.depths[k] * member.depths[k]
            };
            self.minimax.iter().map(range).fold(0.0, f64::max)
        };
        (!self.minimax.is_empty()).then(|| (worst(position) - worst(goal)).max(0.0))
    }

    /// Bounds the numbers for a program whose craft gets no farther than `reach`, with a goal moved
    /// nearer: distant objects remain out of reach without loss of precision.
    pub(crate) fn limit_to_reach(&mut self, reach: f64, goal: &[Motion], near_goal: &[Vector2<f64>]) {
        let far = 2.0 * reach;
        let near = self;
        for (i, range) in near.ranges.iter_mut().enumerate() {
            let given_up = !range.named && near.range_unattainable.contains(&near.auvs[i]);
            for (centre, radius) in range.centres.iter_mut().zip(&mut range.radii) {
                let beyond = (centre.norm() - far).max(0.0);
                *centre = centre.cap_magnitude(far);
                // A row that holds wherever the craft can be.
                let at_least = if given_up { 2.0 * far } else { 0.0 };
                *radius = (*radius - beyond).clamp(at_least, 2.0 * far);
            }
        }
        for disc in &mut near.discs {
            for (centre, radius) in disc.centres.iter_mut().zip(&mut disc.radii) {
                let beyond = (centre.norm() - far).max(0.0);
                *centre = centre.cap_magnitude(far);
                *radius = (*radius - beyond).clamp(-far, far);
            }
        }
        for edge in &mut near.edges {
            edge.offset = edge.offset.clamp(-far, far);
        }
        // Distant members keep their directions from the goal, along which the largest range grows.
        let spread = near.minimax.iter().flat_map(|member| member.positions.iter().zip(goal));
        let spread = spread.map(|(position, goal)| (position - goal.position).norm());
        let deepest = near.minimax.iter().flat_map(|member| &member.depths).copied();
        let shrink = (far / spread.chain(deepest).fold(far, f64::max)).min(1.0);
        for member in &mut near.minimax {
            for ((position, goal), near_goal) in member.positions.iter_mut().zip(goal).zip(near_goal) {
                *position = near_goal + (*position - goal.position) * shrink;
            }
            for depth in &mut member.depths {
                *depth *= shrink;
            }
        }
    }

    /// Makes the keep-outs wider by `margin`, m.
    pub(crate) fn widen_keep_outs(&mut self, margin: f64) {
        let keep_outs = self.discs.iter_mut().take(self.keep_outs.len());
        for radius in keep_outs.flat_map(|disc| &mut disc.radii) {
            *radius += margin;
        }
    }

    /// Points the discs' normals to the side on which `stages` pass.
    pub(crate) fn set_normals(&mut self, stages: &[Stage]) {
        for disc in &mut self.discs {
            // Index 0 belongs to no interval.
            disc.normals.resize(stages.len(), Vector2::new(1.0, 0.0));
            for k in 1..stages.len() {
                let (from, to) = (stages[k - 1].position, stages[k].position);
                let nearest = nearest_on(&from, &to, &disc.centres[k]);
                let abeam =
                    || starboard_of((to - from).try_normalize(1e-9).unwrap_or(Vector2::new(1.0, 0.0)));
                disc.normals[k] = (nearest - disc.centres[k]).try_normalize(1e-6).unwrap_or_else(abeam);
            }
        }
    }
}

/// Snapshot indices sorted by position in the craft's frame.
fn sorted(positions: impl Iterator<Item = Vector2<f64>>, frame: &Frame) -> Vec<usize> {
    let local = positions.map(|position| frame.position(&position));
    let mut order: SmallVec<[(usize, Vector2<f64>); KEEP_OUTS_MAX]> = local.enumerate().collect();
    order.sort_by(|(_, a), (_, b)| in_order(a, b));
    order.into_iter().map(|(place, _)| place).collect()
}

/// Samples limits at the stages, in the craft's frame.
#[derive(Clone, Copy)]
struct Sampling<'a> {
    frame: &'a Frame,
    times: &'a [f64],
}

impl Sampling<'_> {
    fn fixed_disc(&self, centre: &Vector2<f64>, radius: f64) -> Disc {
        let n = self.times.len();
        Disc {
            centres: repeat_n(self.frame.position(centre), n).collect(),
            radii: repeat_n(radius, n).collect(),
            normals: Vec::new(),
        }
    }

    /// The disc about an AUV, of the radius `always`, m, or `surfaced` where it may surface.
    fn separation_disc(&self, forecast: &AuvForecast, surfaced: f64, always: f64) -> Disc {
        let radius = |time: &f64| {
            let surfaced = if forecast.surfaced(*time) { surfaced } else { 0.0 };
            let radius = always.max(surfaced);
            if 0.0 < radius { radius } else { NOT_THERE }
        };
        Disc {
            centres: self.positions_of(forecast),
            radii: self.times.iter().map(radius).collect(),
            normals: Vec::new(),
        }
    }

    /// The nearest of `vessels` to which the craft could come too near, in geometric order.
    fn near_vessels<'v>(
        &self,
        vessels: &'v [VesselForecast],
        snapshot: &Snapshot,
    ) -> Vec<&'v VesselForecast> {
        let speed = snapshot.speed_most() + snapshot.current().norm();
        let gap = |vessel: &VesselForecast| {
            let at = |time: &f64| {
                let distance = self.frame.position(&vessel.at(*time)).norm();
                distance - vessel.radius(*time) - speed * time
            };
            self.times.iter().map(at).fold(f64::INFINITY, f64::min)
        };
        let mut near: Vec<_> = vessels.iter().map(|vessel| (gap(vessel), vessel)).collect();
        near.retain(|(gap, _)| *gap < 0.0);
        let place = |vessel: &VesselForecast| self.frame.position(&vessel.position);
        near.sort_by(|(a, one), (b, other)| {
            a.total_cmp(b).then_with(|| in_order(&place(one), &place(other)))
        });
        near.truncate(VESSELS_MOST);
        near.into_iter().map(|(_, vessel)| vessel).collect()
    }

    fn vessel_disc(&self, vessel: &VesselForecast) -> Disc {
        Disc {
            centres: self.times.iter().map(|time| self.frame.position(&vessel.at(*time))).collect(),
            radii: self.times.iter().map(|time| vessel.radius(*time)).collect(),
            normals: Vec::new(),
        }
    }

    fn no_disc(&self) -> Disc {
        let n = self.times.len();
        Disc { centres: vec![Vector2::zeros(); n], radii: vec![NOT_THERE; n], normals: Vec::new() }
    }

    /// Largest horizontal distance to an AUV: √(R² − z²) minus `deviations` times √(tr P).
    fn acoustic_range(&self, forecast: &AuvForecast, range_max: f64, deviations: f64) -> AcousticRange {
        let radius = |time: &f64| {
            let (depth, sigma) = (forecast.depth_at(*time), forecast.position_variance(*time).sqrt());
            let across = (range_max * range_max - depth * depth).max(0.0).sqrt();
            (across - deviations * sigma).max(0.0)
        };
        AcousticRange {
            centres: self.positions_of(forecast),
            radii: self.times.iter().map(radius).collect(),
            named: false,
        }
    }

    fn minimax_range(&self, forecast: &AuvForecast) -> MinimaxRange {
        let depth = |time: &f64| forecast.depth_at(*time);
        MinimaxRange {
            positions: self.positions_of(forecast),
            depths: self.times.iter().map(depth).collect(),
        }
    }

    fn positions_of(&self, auv: &AuvForecast) -> Vec<Vector2<f64>> {
        let position = |time: &f64| self.frame.position(&auv.at(*time).position);
        self.times.iter().map(position).collect()
    }
}

/// `true` if the goal is a minimax range with this AUV; with an offset it is a position.
fn is_minimax(snapshot: &Snapshot, id: &VehicleId) -> bool {
    let Goal::Range { .. } = &snapshot.goal.goal else {
        return false;
    };
    snapshot.goal.offset.is_none() && snapshot.goal.goal.vehicles().any(|named| named == id)
}

/// Edges of an area whose corners go clockwise.
fn edges(corners: &[[f64; 2]], frame: &Frame) -> impl Iterator<Item = Edge> {
    let corner = corners.iter().copied().map(Vector2::from);
    let after = corner.clone().cycle().skip(1);
    corner.zip(after).map(|(from, to)| {
        // Seen from above, the area is to starboard of a clockwise edge.
        let along = (to - from).normalize();
        let normal = frame.vector(&-starboard_of(along));
        Edge { normal, offset: normal.dot(&frame.position(&from)) }
    })
}

fn in_order(a: &Vector2<f64>, b: &Vector2<f64>) -> std::cmp::Ordering {
    a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y))
}
