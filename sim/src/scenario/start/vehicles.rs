//! The vehicles of a start: craft, goal, underwater vehicles, paths.

use std::{collections::BTreeMap, sync::Arc};

use nalgebra::Vector2;
use planner::{
    craft::{CraftDescription, HeadingHeld, SpeedHeld},
    path::{Path, Segment, SpeedProfile},
    snapshot::{Goal, Limits, Offset, VehicleId},
};

use super::{Draw, InvalidScenario, at_most, invalid, side, told_craft};
use crate::{
    datum::Datum,
    dive::{Dive, Leg},
    diver::Diver,
    fault::Conduct,
    inner_loop::{DragFeedForward, SurfaceAutopilot, SurgeLoop},
    observe::Briefing,
    path_following::PathFollowingGains,
    record::{Bounds, Origin},
    scenario::file::{
        AuvFile, CurrentKnowledge, GoalFile, HeadingLoopFile, LegFile, LimitsFile, OffsetFile, PathFile,
        RandomCraftFile, Scenario, SegmentFile, SpeedKnot, SurfaceClassFile, SurfaceCraftFile, SurgeLoopFile,
        ToldAs, UnderwaterClassFile,
    },
    scenario::quantity::{Coordinate, Kind},
    surface_craft::{
        SurfaceClass, SurfaceHull,
        random::{CraftWishes, HeadingLoopKind, RandomCraft, SurgeLoopKind},
    },
    underwater_vehicle::{UnderwaterClass, UnderwaterState},
    world::SurfaceCraft,
};

impl Scenario {
    pub(super) fn surface_craft(
        &self,
        file: &SurfaceCraftFile,
        draw: &mut Draw,
    ) -> Result<(SurfaceCraft, Briefing, f64), InvalidScenario> {
        let position = Vector2::new(draw.take(&file.north_m), draw.take(&file.east_m));
        let (heading, speed) = (draw.take(&file.heading_rad), draw.take(&file.speed_mps));
        let kind = Self::surface_kind(file, draw)?;
        let hull = kind.hull;
        let thrust_max = 2.0 * hull.thrusters.ahead_max;
        if thrust_max < hull.drag_surge.resistance(speed) {
            return Err(invalid(
                "surface_craft.speed_mps",
                format_args!("{speed} m/s take more than the {thrust_max} N that both thrusters have"),
            ));
        }
        let craft = SurfaceCraft::cruising(hull, kind.autopilot, &position, heading, speed);
        let briefing = Briefing {
            goal: self.goal(&file.goal, draw)?,
            offset: match &file.goal_offset {
                Some(offset) => Some(self.offset(offset, &file.goal, draw)?),
                None => None,
            },
            limits: limits(&file.limits, &kind.limits, draw)?,
            craft: told_craft(file.craft.as_ref(), &file.limits, kind.craft, draw)?,
            current: self.knowledge.current == CurrentKnowledge::Known,
            paths: self.knowledge.paths,
            newest_as_state: self
                .knowledge
                .acoustics
                .as_ref()
                .is_some_and(|acoustics| acoustics.told_as == ToldAs::State),
            bounds: Bounds::default(),
        };
        Ok((craft, briefing, draw.take(&file.contact_range_m)))
    }

    /// The craft of a class, or one that is drawn.
    fn surface_kind(file: &SurfaceCraftFile, draw: &mut Draw) -> Result<SurfaceKind, InvalidScenario> {
        let class = match &file.class {
            SurfaceClassFile::Medusa => SurfaceClass::Medusa,
            SurfaceClassFile::Otter => SurfaceClass::Otter,
            SurfaceClassFile::Random(random) => {
                let (seed, wishes) = (random.seed.unwrap_or(draw.seed), wishes(random, draw));
                let drawn = match &file.drawn {
                    Some(drawn) => drawn.clone(),
                    None => RandomCraft::draw(seed, &wishes)
                        .map(Arc::new)
                        .map_err(|error| invalid("surface_craft.class.random", error))?,
                };
                return Ok(SurfaceKind {
                    hull: drawn.hull,
                    autopilot: drawn.autopilot,
                    limits: drawn.tested.limits,
                    craft: CraftDescription::from(&drawn.tested.craft),
                });
            }
        };
        let feed_forward = if file.drag_feed_forward {
            DragFeedForward::On
        } else {
            DragFeedForward::Off
        };
        Ok(SurfaceKind {
            hull: class.hull(),
            autopilot: class.autopilot(feed_forward),
            limits: class.limits(),
            craft: class.craft(),
        })
    }

    fn goal(&self, file: &GoalFile, draw: &mut Draw) -> Result<Goal, InvalidScenario> {
        let called = |field: &str, id: &String| {
            self.diver_called(field, id)?;
            Ok(VehicleId(id.clone()))
        };
        let all = |kind: &str, ids: &[String]| {
            if ids.is_empty() {
                return Err(invalid(
                    format!("surface_craft.goal.{kind}.auvs"),
                    "a goal needs at least one vehicle",
                ));
            }
            let each = ids.iter().enumerate().map(|(i, id)| {
                let field = format!("surface_craft.goal.{kind}.auvs[{i}]");
                if ids[..i].contains(id) {
                    return Err(invalid(field, format_args!("{id:?} is named twice")));
                }
                called(&field, id)
            });
            each.collect::<Result<Vec<_>, _>>()
        };
        Ok(match file {
            GoalFile::Track { auv } => Goal::Track {
                auv: called("surface_craft.goal.track.auv", auv)?,
            },
            GoalFile::Intermittent {
                auvs,
                dwell_s,
                epoch_s,
            } => Goal::Intermittent {
                auvs: all("intermittent", auvs)?,
                dwell: draw.take(dwell_s),
                epoch: draw.take(epoch_s),
            },
            GoalFile::Midpoint { auvs } => Goal::Midpoint {
                auvs: all("midpoint", auvs)?,
            },
            GoalFile::Weighted { weights } => {
                let field = "surface_craft.goal.weighted.weights";
                let weigh = |(id, weight)| Ok((called(&format!("{field}.{id}"), id)?, draw.take(weight)));
                let weights: BTreeMap<_, _> = weights.iter().map(weigh).collect::<Result<_, _>>()?;
                if weights.values().all(|weight| *weight == 0.0) {
                    return Err(invalid(field, "at least one of them must be above 0"));
                }
                Goal::Weighted { weights }
            }
            GoalFile::Range { auvs, range_m } => Goal::Range {
                auvs: all("range", auvs)?,
                radius: draw.take(range_m),
            },
        })
    }

    fn offset(&self, file: &OffsetFile, goal: &GoalFile, draw: &mut Draw) -> Result<Offset, InvalidScenario> {
        let mut pair = |first, second| Vector2::new(draw.take(first), draw.take(second));
        Ok(match file {
            OffsetFile::Ned { north_m, east_m } => Offset::Ned(pair(north_m, east_m)),
            OffsetFile::Target { ahead_m, starboard_m } => Offset::Target(pair(ahead_m, starboard_m)),
            OffsetFile::Path { ahead_m, starboard_m } => {
                let field = "surface_craft.goal_offset.path";
                if !matches!(goal, GoalFile::Track { .. } | GoalFile::Intermittent { .. }) {
                    return Err(invalid(
                        field,
                        "only a goal that follows one vehicle at a time has a path",
                    ));
                }
                if !self.knowledge.paths {
                    return Err(invalid(
                        field,
                        "the surface craft knows no paths; set knowledge.paths",
                    ));
                }
                Offset::Path(pair(ahead_m, starboard_m))
            }
        })
    }

    pub(super) fn diver(
        &self,
        i: usize,
        file: &AuvFile,
        origin: Option<Origin>,
        draw: &mut Draw,
    ) -> Result<Diver, InvalidScenario> {
        let class = match file.class {
            UnderwaterClassFile::Medusa => UnderwaterClass::Medusa,
            UnderwaterClassFile::Slocum => UnderwaterClass::Slocum,
        };
        let path = self.path(&format!("auvs[{i}].path"), &file.path, origin, draw)?;
        if let Some(far) = farthest_out(&path) {
            return Err(invalid(
                format!("auvs[{i}].path"),
                format_args!(
                    "it goes to {:.0} m north, {:.0} m east of the datum, and {} m are allowed",
                    far.x,
                    far.y,
                    Coordinate::MOST
                ),
            ));
        }
        let offset = Vector2::new(
            draw.take_or(file.north_of_path_m.as_ref(), 0.0),
            draw.take_or(file.east_of_path_m.as_ref(), 0.0),
        );
        let turned = draw.take_or(file.heading_off_path_rad.as_ref(), 0.0);
        let dive = match &file.dive {
            None => class.dive(),
            Some(dive) => Dive {
                depth_min: draw.take(&dive.depth_min_m),
                depth_max: draw.take(&dive.depth_max_m),
                pitch: draw.take(&dive.pitch_rad),
            },
        };
        if dive.depth_max <= dive.depth_min {
            return Err(invalid(
                format!("auvs[{i}].dive.depth_max_m"),
                format_args!(
                    "{} m is not deeper than the least, {} m",
                    dive.depth_max, dive.depth_min
                ),
            ));
        }
        let depth = draw.take_or(file.depth_m.as_ref(), dive.depth_min);
        let speed = speed_profile(i, file, class, draw)?;
        let begin = path.at(0.0);
        let position = begin.position + offset;
        let hull = class.hull();
        let state = UnderwaterState::from([
            position.x,
            position.y,
            depth,
            0.0,
            begin.tangent + turned,
            speed.at(0.0),
            0.0,
            0.0,
        ]);
        Ok(Diver {
            id: VehicleId(file.id.clone()),
            hull,
            state,
            loops: class.loops(),
            surge: SurgeLoop::settled_at(speed.at(0.0), DragFeedForward::Off, hull.drag_surge),
            navigation: class.navigation(),
            believed: position,
            gains: PathFollowingGains::LAB,
            path: Arc::new(path),
            gamma: 0.0,
            speed,
            dive,
            leg: match file.leg {
                LegFile::Down => Leg::Down,
                LegFile::Up => Leg::Up,
            },
            conduct: Conduct::FollowsPath,
        })
    }

    fn path(
        &self,
        field: &str,
        file: &PathFile,
        origin: Option<Origin>,
        draw: &mut Draw,
    ) -> Result<Path, InvalidScenario> {
        match file {
            PathFile::LawnMower {
                from,
                heading_rad,
                lane_length_m,
                lane_spacing_m,
                lanes,
            } => {
                if !(1..=100).contains(lanes) {
                    return Err(invalid(
                        format!("{field}.lawn_mower.lanes"),
                        format_args!("{lanes} is outside 1 to 100"),
                    ));
                }
                let from = draw.point(from);
                let heading = draw.take(heading_rad);
                let (length, spacing) = (draw.take(lane_length_m), draw.take(lane_spacing_m));
                let path = Path::lawn_mower(from, heading, length, spacing, *lanes);
                path.check()
                    .map_err(|error| invalid(format!("{field}.lawn_mower"), error))?;
                Ok(path)
            }
            PathFile::Waypoints {
                points,
                fillet_m,
                closed,
            } => Path::waypoints(&draw.points(points), draw.take(fillet_m), *closed)
                .map_err(|error| invalid(format!("{field}.waypoints"), error)),
            PathFile::Circle {
                centre,
                radius_m,
                turn,
                bearing_rad,
            } => {
                let centre = draw.point(centre);
                let radius = draw.take(radius_m);
                let bearing = draw.take_or(bearing_rad.as_ref(), 0.0);
                Path::circle(centre, radius, side(*turn), bearing)
                    .map_err(|error| invalid(format!("{field}.circle"), error))
            }
            PathFile::Segments { segments, closed } => {
                let segments: Vec<Segment> = segments.iter().map(|file| segment(file, draw)).collect();
                Path::from_segments(&segments, *closed)
                    .map_err(|error| invalid(format!("{field}.segments"), error))
            }
            PathFile::Geojson { file, fillet_m } => {
                let origin = origin.ok_or_else(|| {
                    invalid(
                        format!("{field}.geojson"),
                        "latitudes and longitudes need a datum: add [origin]",
                    )
                })?;
                let line = self
                    .files
                    .line(file)
                    .map_err(|error| invalid(format!("{field}.geojson.file"), error))?;
                let not_on_earth = |error| invalid(format!("{field}.geojson.file"), error);
                let datum = Datum::new(&origin).map_err(not_on_earth)?;
                let points = line.iter().map(|place| datum.to_local(place));
                let points = points.collect::<Result<Vec<_>, _>>().map_err(not_on_earth)?;
                Path::waypoints(&points, draw.take(fillet_m), false)
                    .map_err(|error| invalid(format!("{field}.geojson"), error))
            }
        }
    }
}

/// A surface craft before it is anywhere.
struct SurfaceKind {
    hull: SurfaceHull,
    autopilot: SurfaceAutopilot,
    limits: Limits,
    /// What is said of how it answers its references.
    craft: CraftDescription,
}

fn wishes(file: &RandomCraftFile, draw: &mut Draw) -> CraftWishes {
    CraftWishes {
        mass: draw.take_any(file.mass_kg.as_ref()),
        heading_loop: file.heading_loop.map(|kind| match kind {
            HeadingLoopFile::Pd => HeadingLoopKind::ProportionalDerivative,
            HeadingLoopFile::Pid => HeadingLoopKind::ProportionalIntegralDerivative,
            HeadingLoopFile::ReferenceModel => HeadingLoopKind::ReferenceModel,
            HeadingLoopFile::Cascade => HeadingLoopKind::Cascade,
        }),
        heading_lag: draw.take_any(file.heading_lag_s.as_ref()),
        surge_loop: file.surge_loop.map(|kind| match kind {
            SurgeLoopFile::P => SurgeLoopKind::Proportional,
            SurgeLoopFile::Pi => SurgeLoopKind::AntiWindup,
            SurgeLoopFile::PiWindup => SurgeLoopKind::Windup,
        }),
        surge_lag: draw.take_any(file.surge_lag_s.as_ref()),
        acceleration: draw.take_any(file.acceleration_mps2.as_ref()),
        delay: draw.take_any(file.delay_s.as_ref()),
        speed_held: file.speed_held.map(SpeedHeld::from),
        heading_held: file.heading_held.map(HeadingHeld::from),
    }
}

/// A point of `path` beyond the coordinates that a file may name, if there is one.
fn farthest_out(path: &Path) -> Option<Vector2<f64>> {
    /// A path has at most a few hundred pieces.
    const LOOKS: u32 = 2000;
    let point = |k: u32| path.at(path.length() * f64::from(k) / f64::from(LOOKS)).position;
    (0..=LOOKS)
        .map(point)
        .find(|point| Coordinate::MOST < point.amax())
}

fn limits(file: &LimitsFile, class: &Limits, draw: &mut Draw) -> Result<Limits, InvalidScenario> {
    let limits = Limits {
        speed_min: draw.take_or(file.speed_min_mps.as_ref(), class.speed_min),
        speed_max: draw.take_or(file.speed_max_mps.as_ref(), class.speed_max),
        turn_rate_max: draw.take_or(file.turn_rate_max_radps.as_ref(), class.turn_rate_max),
        acceleration_max: draw.take_or(file.acceleration_max_mps2.as_ref(), class.acceleration_max),
        deceleration_max: draw.take_or(file.deceleration_max_mps2.as_ref(), class.deceleration_max),
    };
    // The planner's own rule: a snapshot with less is refused.
    if limits.speed_max < limits.speed_min + 0.05 {
        return Err(invalid(
            "surface_craft.limits.speed_max_mps",
            format_args!(
                "{} m/s is not 0.05 m/s above the slowest, {} m/s",
                limits.speed_max, limits.speed_min
            ),
        ));
    }
    Ok(limits)
}

/// Speed along the path; none that the hull cannot reach.
fn speed_profile(
    i: usize,
    file: &AuvFile,
    class: UnderwaterClass,
    draw: &mut Draw,
) -> Result<SpeedProfile, InvalidScenario> {
    let field = format!("auvs[{i}].speed_profile");
    let mut knots = vec![(0.0, draw.take_or(file.speed_mps.as_ref(), class.speed()))];
    if let Some(profile) = &file.speed_profile {
        if file.speed_mps.is_some() {
            return Err(invalid(field, "speed_mps is given too; give one of them"));
        }
        at_most(&field, profile.len())?;
        if profile.is_empty() {
            return Err(invalid(field, "a profile has at least one knot"));
        }
        let knot = |knot: &SpeedKnot| (draw.take(&knot.along_m), draw.take(&knot.speed_mps));
        knots = profile.iter().map(knot).collect();
    }
    let hull = class.hull();
    for (_, speed) in &knots {
        if hull.force_max < hull.drag_surge.resistance(*speed) {
            return Err(invalid(
                format!("auvs[{i}].speed_mps"),
                format_args!("{speed} m/s take more than the {} N that it has", hull.force_max),
            ));
        }
    }
    SpeedProfile::new(knots).map_err(|error| invalid(field, error))
}

fn segment(file: &SegmentFile, draw: &mut Draw) -> Segment {
    match file {
        SegmentFile::Line { from, to } => {
            let from = draw.point(from);
            Segment::Line {
                from,
                to: draw.point(to),
            }
        }
        SegmentFile::Arc {
            from,
            centre,
            angle_rad,
        } => {
            let from = draw.point(from);
            let centre = draw.point(centre);
            Segment::Arc {
                from,
                centre,
                angle: draw.take(angle_rad),
            }
        }
    }
}
