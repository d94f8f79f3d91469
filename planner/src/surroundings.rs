//! What is around the craft at the stages of a horizon, in its own frame: AUVs to stay in range of, discs, edges.

use std::iter::repeat_n;

use nalgebra::Vector2;
use smallvec::SmallVec;

use crate::{
    answer::Subject,
    common_point::{Place, have_a_common_point},
    forecast::{AuvForecast, Motion},
    horizon::Horizon,
    policy::Policy,
    program::{Disc, Edge, Member, Range, starboard_of},
    refilled::refill,
    response::Stage,
    snapshot::{AUVS_MAX, Goal, KEEP_OUTS_MAX, Snapshot, VehicleId},
};

/// Radius of a disc that is not there, m: with any other number below 0 a disc would come and go at another share of
/// the interval in which it does.
const NOT_THERE: f64 = -1.0;

/// Where a craft may go and where the AUVs that bind it are.
#[derive(Clone, Debug, Default)]
pub(crate) struct Surroundings {
    pub(crate) ranges: Vec<Range>,
    pub(crate) discs: Vec<Disc>,
    pub(crate) edges: Vec<Edge>,
    pub(crate) worst: Vec<Member>,
    /// The keep-outs by their place in the snapshot, in the order of the discs, of which they are the first.
    keep_outs: Vec<usize>,
    /// The AUVs by their place in the snapshot, in the order of their ranges and of the discs after the keep-outs: those
    /// that the goal names first.
    auvs: Vec<usize>,
    /// The AUVs whose range cannot be kept, by their place in the snapshot, ascending.
    pub(crate) range_unattainable: Vec<usize>,
}

/// How a limit of acoustic range stands among the others.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Standing {
    /// About an AUV that the goal names.
    Named,
    /// About another.
    Other,
    /// About another, which is told to be broken and costs nothing: it cannot be kept.
    GivenUp,
}

impl Surroundings {
    /// What is around the craft over `horizon`, in place of what was; `forecasts` of all AUVs, in the snapshot's order.
    pub(crate) fn restate(
        &mut self,
        snapshot: &Snapshot,
        policy: &Policy,
        horizon: &Horizon,
        forecasts: &[AuvForecast],
    ) {
        // In geometric order, so that nothing depends on who was named first.
        let centres = snapshot.keep_outs.iter().map(|disc| disc.centre);
        sort(&mut self.keep_outs, centres, horizon);
        let positions = forecasts.iter().map(|forecast| forecast.at(0.0).position);
        sort(&mut self.auvs, positions, horizon);
        // Where one is that was not heard of for long, nothing can be kept to.
        self.auvs
            .retain(|auv| !policy.is_stale(&snapshot.estimates()[*auv]));
        let named = |auv: usize| {
            let id = &snapshot.auvs[auv].id;
            snapshot.goal.vehicles().any(|named| named == id)
        };
        let first = self.auvs.iter().filter(|auv| named(**auv));
        let others = self.auvs.iter().filter(|auv| !named(**auv));
        let order: SmallVec<[usize; AUVS_MAX]> = first.chain(others).copied().collect();
        refill(&mut self.auvs, order);

        self.restate_discs(snapshot, horizon, forecasts);
        let n_ranges = snapshot.range_max.map_or(0, |_| self.auvs.len());
        self.ranges.resize_with(n_ranges, Range::default);
        if let Some(range_max) = snapshot.range_max {
            for (range, auv) in self.ranges.iter_mut().zip(&self.auvs) {
                stay_near(range, &forecasts[*auv], horizon, range_max, policy.range_doubt);
                range.named = named(*auv);
            }
        }
        self.give_up_what_cannot_be_kept(&horizon.goal[0].position);
        refill(&mut self.edges, edges(&snapshot.area, horizon));
        let counting = || {
            self.auvs
                .iter()
                .filter(|auv| matters(snapshot, &snapshot.auvs[**auv].id))
        };
        self.worst.resize_with(counting().count(), Member::default);
        for (member, auv) in self.worst.iter_mut().zip(counting()) {
            let forecast = &forecasts[*auv];
            refill(&mut member.positions, horizon.positions_of(forecast));
            let depths = horizon.times.iter().map(|time| forecast.depth_at(*time));
            refill(&mut member.depths, depths);
        }
    }

    /// Finds out whose range cannot be kept now, and gives up the limits about those of them that the goal does not name:
    /// half-way between what is out of range of either, a craft is no use to any.
    ///
    /// Given up are, of those that the goal names, the ones out of range where the goal is met, if no place is in range of
    /// all; of the others, taken from the nearest to the goal on, each that has no place in range of all kept so far.
    fn give_up_what_cannot_be_kept(&mut self, goal: &Vector2<f64>) {
        let place = |range: &Range| (range.centres[0], range.radii[0]);
        let distance = |range: &Range| (range.centres[0] - goal).norm();
        let n_named = self.ranges.iter().filter(|range| range.named).count();
        let mut kept: SmallVec<[Place; AUVS_MAX]> = self.ranges[..n_named].iter().map(place).collect();
        self.range_unattainable.clear();
        if !have_a_common_point(&kept) {
            let named = self.ranges[..n_named].iter().zip(&self.auvs);
            let out_of_range = named.filter(|(range, _)| range.radii[0] < distance(range));
            self.range_unattainable.extend(out_of_range.map(|(_, auv)| *auv));
        }
        let mut others: SmallVec<[usize; AUVS_MAX]> = (n_named..self.ranges.len()).collect();
        others.sort_by(|a, b| distance(&self.ranges[*a]).total_cmp(&distance(&self.ranges[*b])));
        for i in others {
            kept.push(place(&self.ranges[i]));
            if !have_a_common_point(&kept) {
                kept.pop();
                self.range_unattainable.push(self.auvs[i]);
            }
        }
        self.range_unattainable.sort_unstable();
    }

    /// Keep-outs first, then the AUVs that may be at the surface.
    fn restate_discs(&mut self, snapshot: &Snapshot, horizon: &Horizon, forecasts: &[AuvForecast]) {
        let (n, n_fixed) = (horizon.times.len(), self.keep_outs.len());
        let n_moving = snapshot.surfacing_separation.map_or(0, |_| self.auvs.len());
        self.discs.resize_with(n_fixed + n_moving, Disc::default);
        let (fixed, moving) = self.discs.split_at_mut(n_fixed);
        for (disc, place) in fixed.iter_mut().zip(&self.keep_outs) {
            let keep_out = &snapshot.keep_outs[*place];
            refill(
                &mut disc.centres,
                repeat_n(horizon.local_position(&keep_out.centre), n),
            );
            refill(&mut disc.radii, repeat_n(keep_out.radius, n));
        }
        let Some(separation) = snapshot.surfacing_separation else {
            return;
        };
        for (disc, auv) in moving.iter_mut().zip(&self.auvs) {
            let forecast = &forecasts[*auv];
            let radius = |time: &f64| {
                if forecast.surfaced(*time) {
                    separation
                } else {
                    NOT_THERE
                }
            };
            refill(&mut disc.centres, horizon.positions_of(forecast));
            refill(&mut disc.radii, horizon.times.iter().map(radius));
        }
    }

    /// The same as `other`, in this one's memory.
    pub(crate) fn copy_from(&mut self, other: &Self) {
        self.ranges.resize_with(other.ranges.len(), Range::default);
        for (range, other) in self.ranges.iter_mut().zip(&other.ranges) {
            range.centres.clone_from(&other.centres);
            range.radii.clone_from(&other.radii);
            range.named = other.named;
        }
        self.discs.resize_with(other.discs.len(), Disc::default);
        for (disc, other) in self.discs.iter_mut().zip(&other.discs) {
            disc.centres.clone_from(&other.centres);
            disc.radii.clone_from(&other.radii);
            disc.normals.clone_from(&other.normals);
        }
        self.edges.clone_from(&other.edges);
        self.worst.resize_with(other.worst.len(), Member::default);
        for (member, other) in self.worst.iter_mut().zip(&other.worst) {
            member.positions.clone_from(&other.positions);
            member.depths.clone_from(&other.depths);
        }
        self.keep_outs.clone_from(&other.keep_outs);
        self.auvs.clone_from(&other.auvs);
        self.range_unattainable.clone_from(&other.range_unattainable);
    }

    /// The AUVs whose ranges stand so.
    pub(crate) fn ranges(&self, standing: Standing) -> impl Iterator<Item = (Subject, &Range)> {
        let ranges = self.auvs.iter().zip(&self.ranges);
        let of_it = ranges.filter(move |(auv, range)| self.standing(**auv, range) == standing);
        of_it.map(|(auv, range)| (Subject::Auv(*auv), range))
    }

    fn standing(&self, auv: usize, range: &Range) -> Standing {
        if range.named {
            Standing::Named
        } else if self.range_unattainable.contains(&auv) {
            Standing::GivenUp
        } else {
            Standing::Other
        }
    }

    /// The discs that a snapshot names.
    pub(crate) fn keep_outs(&self) -> impl Iterator<Item = (Subject, &Disc)> {
        let keep_outs = self.keep_outs.iter().copied();
        keep_outs.map(Subject::KeepOut).zip(&self.discs)
    }

    /// The discs about the AUVs that may be at the surface, where a distance is to be kept from them.
    pub(crate) fn separations(&self) -> impl Iterator<Item = (Subject, &Disc)> {
        let moving = self.discs.iter().skip(self.keep_outs.len());
        self.auvs.iter().copied().map(Subject::Auv).zip(moving)
    }

    /// Where the goal is a worst range: its square at stage k less the least possible, m².
    pub(crate) fn excess_of_worst_range(
        &self,
        k: usize,
        position: &Vector2<f64>,
        goal: &Vector2<f64>,
    ) -> Option<f64> {
        let worst = |place: &Vector2<f64>| {
            let range = |member: &Member| {
                (place - member.positions[k]).norm_squared() + member.depths[k] * member.depths[k]
            };
            self.worst.iter().map(range).fold(0.0, f64::max)
        };
        (!self.worst.is_empty()).then(|| (worst(position) - worst(goal)).max(0.0))
    }

    /// Makes it what a program may be told, for a craft that gets no farther than `reach` and a goal that is brought
    /// nearer: what is out of reach stays there, but is not so far that rounding counts.
    pub(crate) fn bring_within(&mut self, reach: f64, goal: &[Motion], near_goal: &[Vector2<f64>]) {
        let far = 2.0 * reach;
        let near = self;
        for (i, range) in near.ranges.iter_mut().enumerate() {
            let given_up = !range.named && near.range_unattainable.contains(&near.auvs[i]);
            for (centre, radius) in range.centres.iter_mut().zip(&mut range.radii) {
                let beyond = (centre.norm() - far).max(0.0);
                *centre = centre.cap_magnitude(far);
                // A row that holds wherever the craft gets.
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
        // Members that are far apart keep their directions from the goal, which tell where the worst range grows.
        let spread = near
            .worst
            .iter()
            .flat_map(|member| member.positions.iter().zip(goal));
        let spread = spread.map(|(position, goal)| (position - goal.position).norm());
        let deepest = near.worst.iter().flat_map(|member| &member.depths).copied();
        let shrink = (far / spread.chain(deepest).fold(far, f64::max)).min(1.0);
        for member in &mut near.worst {
            for ((position, goal), near_goal) in member.positions.iter_mut().zip(goal).zip(near_goal) {
                *position = near_goal + (*position - goal.position) * shrink;
            }
            for depth in &mut member.depths {
                *depth *= shrink;
            }
        }
    }

    /// Makes the keep-outs wider by `margin`, m.
    pub(crate) fn keep_clear(&mut self, margin: f64) {
        let keep_outs = self.discs.iter_mut().take(self.keep_outs.len());
        for radius in keep_outs.flat_map(|disc| &mut disc.radii) {
            *radius += margin;
        }
    }

    /// Turns the discs' normals to the side on which `stages` pass each of them.
    pub(crate) fn pass_as(&mut self, stages: &[Stage]) {
        for disc in &mut self.discs {
            // The first is of no interval.
            disc.normals.resize(stages.len(), Vector2::new(1.0, 0.0));
            for k in 1..stages.len() {
                let (from, to) = (stages[k - 1].position, stages[k].position);
                let nearest = nearest_of_chord(&from, &to, &disc.centres[k]);
                let abeam =
                    || starboard_of((to - from).try_normalize(1e-9).unwrap_or(Vector2::new(1.0, 0.0)));
                disc.normals[k] = (nearest - disc.centres[k])
                    .try_normalize(1e-6)
                    .unwrap_or_else(abeam);
            }
        }
    }
}

/// Places in the snapshot, sorted by where what is there is in the craft frame.
fn sort(places: &mut Vec<usize>, positions: impl Iterator<Item = Vector2<f64>>, horizon: &Horizon) {
    let local = positions.map(|position| horizon.local_position(&position));
    let mut order: SmallVec<[(usize, Vector2<f64>); KEEP_OUTS_MAX]> = local.enumerate().collect();
    order.sort_by(|(_, a), (_, b)| in_order(a, b));
    refill(places, order.into_iter().map(|(place, _)| place));
}

/// Horizontal distance to keep within of an AUV: √(R² − z²) less the doubt, √(tr P) over both axes.
fn stay_near(
    range: &mut Range,
    forecast: &AuvForecast,
    horizon: &Horizon,
    range_max: f64,
    doubt_weight: f64,
) {
    let radius = |time: &f64| {
        let (depth, doubt) = (forecast.depth_at(*time), forecast.position_variance(*time).sqrt());
        let across = (range_max * range_max - depth * depth).max(0.0).sqrt();
        (across - doubt_weight * doubt).max(0.0)
    };
    refill(&mut range.centres, horizon.positions_of(forecast));
    refill(&mut range.radii, horizon.times.iter().map(radius));
}

/// Whether the goal is the worst range, and this AUV's is one of those. Beside the place where it is least, the goal
/// is a place like any other.
fn matters(snapshot: &Snapshot, id: &VehicleId) -> bool {
    let Goal::Range { .. } = &snapshot.goal else {
        return false;
    };
    snapshot.offset.is_none() && snapshot.goal.vehicles().any(|named| named == id)
}

/// Edges of an area whose corners go clockwise.
fn edges(corners: &[Vector2<f64>], horizon: &Horizon) -> impl Iterator<Item = Edge> {
    let after = corners.iter().cycle().skip(1);
    corners.iter().zip(after).map(|(from, to)| {
        // Clockwise seen from above, the area is to starboard of its edge.
        let along = (to - from).normalize();
        let normal = horizon.local_direction(&-starboard_of(along));
        Edge {
            normal,
            offset: normal.dot(&horizon.local_position(from)),
        }
    })
}

fn in_order(a: &Vector2<f64>, b: &Vector2<f64>) -> std::cmp::Ordering {
    a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y))
}

pub(crate) fn nearest_of_chord(
    from: &Vector2<f64>,
    to: &Vector2<f64>,
    centre: &Vector2<f64>,
) -> Vector2<f64> {
    let chord = to - from;
    let length = chord.norm_squared();
    let share = if length > 0.0 {
        ((centre - from).dot(&chord) / length).clamp(0.0, 1.0)
    } else {
        0.0
    };
    from + chord * share
}
