//! What is around the craft at the stages of a horizon, in its own frame: AUVs to stay in range of, discs, edges.

use nalgebra::Vector2;

use crate::{
    forecast::{AuvForecast, Motion},
    horizon::Horizon,
    policy::Policy,
    program::{Disc, Edge, Member, Range, starboard_of},
    response::Stage,
    snapshot::{Goal, Snapshot, VehicleId},
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
}

impl Surroundings {
    pub(crate) fn new(snapshot: &Snapshot, policy: &Policy, horizon: &Horizon) -> Self {
        let n = horizon.times.len();
        let mut discs: Vec<_> = snapshot
            .keep_outs
            .iter()
            .map(|disc| Disc {
                centres: vec![horizon.local_position(&disc.centre); n],
                radii: vec![disc.radius; n],
                normals: vec![Vector2::new(1.0, 0.0); n],
            })
            .collect();
        discs.sort_by(|a, b| in_order(&a.centres[0], &b.centres[0]));
        let mut tracks: Vec<_> = snapshot
            .auvs
            .iter()
            .zip(snapshot.estimates())
            .map(|(auv, estimate)| {
                let state = &estimate.state;
                let forecast = AuvForecast::new(state, auv.into(), snapshot.forecast, &snapshot.current());
                let position = |time: &f64| horizon.local_position(&forecast.at(*time).position);
                Track {
                    counts: matters(snapshot, &auv.id),
                    doubts: horizon
                        .times
                        .iter()
                        .map(|time| forecast.position_variance(*time).sqrt())
                        .collect(),
                    surfaced: horizon
                        .times
                        .iter()
                        .map(|time| forecast.surfaced(*time))
                        .collect(),
                    member: Member {
                        positions: horizon.times.iter().map(position).collect(),
                        depths: horizon
                            .times
                            .iter()
                            .map(|time| forecast.depth_at(*time))
                            .collect(),
                    },
                }
            })
            .collect();
        // In geometric order, so that nothing depends on who was named first.
        tracks.sort_by(|a, b| in_order(&a.member.positions[0], &b.member.positions[0]));
        if let Some(separation) = snapshot.surfacing_separation {
            discs.extend(tracks.iter().map(|track| track.disc(separation)));
        }
        Self {
            ranges: snapshot
                .range_max
                .map(|range| tracks.iter().map(|track| track.range(range, policy)).collect())
                .unwrap_or_default(),
            discs,
            edges: edges(&snapshot.area, horizon),
            worst: tracks
                .into_iter()
                .filter(|track| track.counts)
                .map(|track| track.member)
                .collect(),
        }
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

    /// The same as a program may be told it, for a craft that gets no farther than `reach` and a goal that is brought
    /// nearer: what is out of reach stays there, but is not so far that rounding counts.
    pub(crate) fn within(&self, reach: f64, goal: &[Motion], near_goal: &[Vector2<f64>]) -> Self {
        let far = 2.0 * reach;
        let mut near = self.clone();
        for range in &mut near.ranges {
            for (centre, radius) in range.centres.iter_mut().zip(&mut range.radii) {
                let beyond = (centre.norm() - far).max(0.0);
                *centre = centre.cap_magnitude(far);
                *radius = (*radius - beyond).clamp(0.0, 2.0 * far);
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
        let spread = self
            .worst
            .iter()
            .flat_map(|member| member.positions.iter().zip(goal));
        let spread = spread.map(|(position, goal)| (position - goal.position).norm());
        let deepest = self.worst.iter().flat_map(|member| &member.depths).copied();
        let shrink = (far / spread.chain(deepest).fold(far, f64::max)).min(1.0);
        for member in &mut near.worst {
            for ((position, goal), near_goal) in member.positions.iter_mut().zip(goal).zip(near_goal) {
                *position = near_goal + (*position - goal.position) * shrink;
            }
            for depth in &mut member.depths {
                *depth *= shrink;
            }
        }
        near
    }

    /// Turns the discs' normals to the side on which `stages` pass each of them.
    pub(crate) fn pass_as(&mut self, stages: &[Stage]) {
        for disc in &mut self.discs {
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

/// An AUV over the horizon.
struct Track {
    /// Whether its range is what the goal is about.
    counts: bool,
    /// Standard deviation of its position over both axes, √(tr P), at the stages, m.
    doubts: Vec<f64>,
    /// Whether it may be at the surface, at the stages.
    surfaced: Vec<bool>,
    member: Member,
}

impl Track {
    /// Horizontal distance to keep within: √(R² − z²) less the doubt.
    fn range(&self, range: f64, policy: &Policy) -> Range {
        let radius = |(depth, doubt): (&f64, &f64)| {
            let across = (range * range - depth * depth).max(0.0).sqrt();
            (across - policy.range_doubt * doubt).max(0.0)
        };
        Range {
            centres: self.member.positions.clone(),
            radii: self.member.depths.iter().zip(&self.doubts).map(radius).collect(),
        }
    }

    /// What to keep out of: a disc that moves with it, and is there while it may be at the surface.
    fn disc(&self, separation: f64) -> Disc {
        let radius = |surfaced: &bool| if *surfaced { separation } else { NOT_THERE };
        Disc {
            centres: self.member.positions.clone(),
            radii: self.surfaced.iter().map(radius).collect(),
            normals: vec![Vector2::new(1.0, 0.0); self.surfaced.len()],
        }
    }
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
fn edges(corners: &[Vector2<f64>], horizon: &Horizon) -> Vec<Edge> {
    let after = corners.iter().cycle().skip(1);
    corners
        .iter()
        .zip(after)
        .map(|(from, to)| {
            // Clockwise seen from above, the area is to starboard of its edge.
            let along = (to - from).normalize();
            let normal = horizon.local_direction(&-starboard_of(along));
            Edge {
                normal,
                offset: normal.dot(&horizon.local_position(from)),
            }
        })
        .collect()
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
