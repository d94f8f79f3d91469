//! Trajectories around obstacles: on either side of one disc, or of a wall of them.

use nalgebra::Vector2;

use crate::coast::sides::nearest_on;
use crate::craft::response::Stage;
use crate::facts::angle::{angle_of, starboard_of, wrap};
use crate::facts::path::curve::Side;
use crate::problem::limits::Disc;

/// Clearance of a detour from a disc, m.
const CLEARANCE: f64 = 1.0;

/// Largest turn of a detour around a wall, rad; beyond it, the wall surrounds the craft.
const DETOUR_MAX: f64 = 2.8;

/// Overlapping discs without a passage: passed one by one they might require different sides.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Wall {
    /// A bit for each of its discs.
    members: u64,
}

impl Wall {
    /// `true` if more than one disc at once stops `stages`.
    pub(crate) fn is_across(discs: &[Disc], stages: &[Stage]) -> bool {
        let stopped = |k: &usize| discs.iter().any(|disc| blocks(disc, stages, *k));
        let first = (1..stages.len()).find(stopped);
        first.is_some_and(|k| {
            let wall = discs.iter().position(|disc| blocks(disc, stages, k));
            wall.is_some_and(|disc| Self::of(discs, k, disc).members.count_ones() > 1)
        })
    }

    /// The wall of a disc.
    fn of(discs: &[Disc], stage: usize, disc: usize) -> Self {
        let mut wall = Self { members: 1 << disc };
        loop {
            let before = wall;
            for (i, disc) in discs.iter().enumerate() {
                let touches = before.discs(discs).any(|member| {
                    let apart = (member.centres[stage] - disc.centres[stage]).norm();
                    0.0 < disc.radii[stage]
                        && apart < member.radii[stage] + disc.radii[stage] + 2.0 * CLEARANCE
                });
                wall.members |= u64::from(touches) << i;
            }
            if wall == before {
                return wall;
            }
        }
    }

    fn discs(self, discs: &[Disc]) -> impl Iterator<Item = &Disc> {
        let belongs = move |i: &usize| self.members >> i & 1 == 1;
        discs.iter().enumerate().filter(move |(i, _)| belongs(i)).map(|(_, disc)| disc)
    }
}

/// The course from `from` towards `to` that clears the nearest wall on a side, if any.
///
/// ```text
/// γ = side · max over discs of side · (β_i − β) + asin(R_i / |c_i − p|)
/// ```
/// with the bearing β of the goal and β_i of a disc's centre.
pub(crate) fn clear_course(
    discs: &[Disc],
    stage: usize,
    from: &Vector2<f64>,
    to: &Vector2<f64>,
    side: Side,
) -> Option<f64> {
    let radius = |disc: &Disc| disc.radii[stage] + CLEARANCE;
    let hides = |disc: &Disc| {
        let centre = disc.centres[stage];
        0.0 < disc.radii[stage] && (nearest_on(from, to, &centre) - centre).norm() < radius(disc)
    };
    let gap = |disc: &Disc| (disc.centres[stage] - from).norm() - radius(disc);
    let nearest = (0..discs.len())
        .filter(|i| hides(&discs[*i]))
        .min_by(|a, b| gap(&discs[*a]).total_cmp(&gap(&discs[*b])))?;
    let bearing = angle_of(&(to - from));
    let detours = Wall::of(discs, stage, nearest).discs(discs).map(|disc| {
        let away = disc.centres[stage] - from;
        let half_angle = (radius(disc) / away.norm().max(radius(disc))).asin();
        side.sign() * wrap(angle_of(&away) - bearing) + half_angle
    });
    Some(bearing + side.sign() * detours.fold(0.0, f64::max).min(DETOUR_MAX))
}

fn blocks(disc: &Disc, stages: &[Stage], k: usize) -> bool {
    let nearest = nearest_on(&stages[k - 1].position, &stages[k].position, &disc.centres[k]);
    (nearest - disc.centres[k]).norm() < disc.radii[k]
}

/// Adds the trajectory or, if it crosses a disc, the two that pass the first one's sides.
pub(crate) fn add(discs: &[Disc], stages: Vec<Stage>, guesses: &mut Vec<Vec<Stage>>) {
    let blocking = |k| discs.iter().find(|disc| blocks(disc, &stages, k));
    match (1..stages.len()).find_map(blocking) {
        Some(disc) => guesses.extend(Side::BOTH.map(|side| pushed_out(&stages, disc, side).collect())),
        None => guesses.push(stages),
    }
}

/// The trajectory with its part inside the disc pushed out on that side.
fn pushed_out(stages: &[Stage], disc: &Disc, side: Side) -> impl Iterator<Item = Stage> {
    let inside = |k: &usize| (stages[*k].position - disc.centres[*k]).norm() < disc.radii[*k] + CLEARANCE;
    let entry = (1..stages.len()).find(inside).unwrap_or(1);
    let exit = (1..stages.len()).rev().find(inside).unwrap_or(entry);
    let along = (stages[exit].position - stages[entry - 1].position)
        .try_normalize(1e-6)
        .unwrap_or(Vector2::new(1.0, 0.0));
    // Passing on the starboard side of the disc, along the trajectory.
    let out = starboard_of(along) * side.sign();
    let pushed = move |(k, stage): (usize, &Stage)| {
        let from_centre = stage.position - disc.centres[k];
        let radius = disc.radii[k] + CLEARANCE;
        let along_chord = from_centre.dot(&along);
        if from_centre.norm() < radius {
            let aside = (radius * radius - along_chord * along_chord).max(0.0).sqrt();
            Stage { position: disc.centres[k] + along * along_chord + out * aside, ..*stage }
        } else {
            *stage
        }
    };
    stages.iter().enumerate().map(pushed)
}
