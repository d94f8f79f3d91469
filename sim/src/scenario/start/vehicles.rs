//! The vehicles of a start: surface craft and AUVs.

use std::{f64::consts::FRAC_1_SQRT_2, sync::Arc};

use nalgebra::Vector2;
use planner::{
    angle::direction,
    craft::CraftDescription,
    path::Path,
    snapshot::{DeclaredLimits, Forecast, Limits, Task, Tuning, VehicleId},
};

use super::craft::craft_description;
use super::draw::{Checked, Draw, weave_stream};
use super::invalid::{InvalidScenario, invalid, of_snapshot, refused};
use super::path::{point_out_of_range, speed_profile};
use super::turns::turning_late;
use crate::{
    observe::Briefing,
    record::{Bounds, Origin},
    scenario::{
        file::{
            AuvFile, CurrentKnowledge, NavigationErrorFile, RandomCraftFile, Scenario, SurfaceClassFile,
            SurfaceCraftFile, TrackingErrorFile,
        },
        quantity::{Coordinate, Distribution, Kind},
    },
    world::{
        SurfaceCraft,
        auv::{SimulatedAuv, TrackingError},
        dive::Dive,
        fault::Behaviour,
        inner_loop::{DragFeedForward, SurfaceAutopilot, SurgeLoop},
        path_following::PathFollowingGains,
        recorded_track::{RecordedTrack, TrackPoint},
        surface_craft::{
            SurfaceClass, SurfaceHull,
            random::{CraftConstraints, RandomCraft},
        },
        underwater_vehicle::UnderwaterState,
        water::Oscillation,
    },
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
            let reason = format_args!("{speed} m/s needs more than the {thrust_max} N of both thrusters");
            return refused("surface_craft.speed_mps", reason);
        }
        let craft = SurfaceCraft::cruising(hull, kind.autopilot, &position, heading, speed);
        let Task { goal, offset } = self.task(file, draw)?;
        let declared = declared_limits(&file.limits, draw)?;
        let acoustics = self.knowledge.acoustics.as_ref();
        let briefing = Briefing {
            goal,
            offset,
            limits: limits(&declared, &kind.limits)?,
            tuning: tuning(file.tuning.as_ref())?,
            tuned: file.parameters,
            craft: craft_description(file.craft.as_ref(), declared.surge_lag_s, kind.craft, draw.seed)?,
            current: self.knowledge.current == CurrentKnowledge::Known,
            paths: self.knowledge.paths,
            forecast: if self.knowledge.known_paths_only { Forecast::Declared } else { Forecast::Auto },
            reported_as: acoustics.map(|file| file.reported_as).unwrap_or_default(),
            course_and_speed: acoustics.is_none_or(|file| file.course_and_speed),
            bounds: Bounds::default(),
        };
        Ok((craft, briefing, draw.take(&file.contact_range_m)))
    }

    /// A craft of a class, or a random craft.
    fn surface_kind(file: &SurfaceCraftFile, draw: &mut Draw) -> Result<SurfaceKind, InvalidScenario> {
        let class = match &file.class {
            SurfaceClassFile::Medusa => SurfaceClass::Medusa,
            SurfaceClassFile::Otter => SurfaceClass::Otter,
            SurfaceClassFile::Random(random) => {
                let (seed, constraints) = (random.seed.unwrap_or(draw.seed), constraints(random, draw));
                let drawn = match &file.drawn {
                    Some(drawn) => drawn.clone(),
                    None => RandomCraft::draw(seed, &constraints)
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
        let feed_forward = if file.drag_feed_forward { DragFeedForward::On } else { DragFeedForward::Off };
        Ok(SurfaceKind {
            hull: class.hull(),
            autopilot: class.autopilot(feed_forward),
            limits: class.limits(),
            craft: class.craft(),
        })
    }

    pub(super) fn auv(
        &self,
        i: usize,
        file: &AuvFile,
        mut track: Vec<TrackPoint>,
        origin: Option<Origin>,
        draw: &mut Draw,
    ) -> Result<SimulatedAuv, InvalidScenario> {
        let class = file.class;
        let path = match (&file.path, track.first()) {
            (Some(path), _) => self.path(i, path, origin, draw)?,
            // A track replaces it.
            (None, Some(first)) => Path::starting_at(first.position, 0.0).line(1.0),
            (None, None) => {
                return refused(format!("auvs[{i}].path"), "is missing; give path or track");
            }
        };
        if let Some(far) = point_out_of_range(&path) {
            let (north, east, most) = (far.x, far.y, Coordinate::MAX);
            let reason = format_args!(
                "the path reaches {north:.0} m north, {east:.0} m east of the datum; {most} m are allowed"
            );
            return refused(format!("auvs[{i}].path"), reason);
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
            let (deepest, shallowest) = (dive.depth_max, dive.depth_min);
            let reason = format_args!("{deepest} m is not below depth_min_m, {shallowest} m");
            return refused(format!("auvs[{i}].dive.depth_max_m"), reason);
        }
        let depth = draw.take_or(file.depth_m.as_ref(), dive.depth_min);
        for point in &mut track {
            if point.depth.is_nan() {
                point.depth = depth;
            }
        }
        let depth = track.first().map_or(depth, |point| point.depth);
        let speed = speed_profile(i, file, class, draw)?;
        let error = file.navigation_error.as_ref();
        let (navigation_error, navigation_drift) = navigation_error(error, draw);
        let (tracking_error, late) = tracking_error(i, &file.tracking_error, draw);
        let declared = Arc::new(path);
        let path = match late {
            None => declared.clone(),
            Some(late) => {
                let field = format!("auvs[{i}].tracking_error.turns_late_m");
                Arc::new(turning_late(&declared, late).map_err(|reason| invalid(field, reason))?)
            }
        };
        let begin = path.at(0.0);
        let position = begin.position - navigation_error + offset;
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
        Ok(SimulatedAuv {
            id: VehicleId(file.id.clone()),
            hull,
            state,
            loops: class.loops(),
            surge: SurgeLoop::settled_at(speed.at(0.0), DragFeedForward::Off, hull.drag_surge),
            navigation: class.navigation(),
            navigation_error,
            own_covariance: None,
            navigation_drift,
            fix_at_surface: error.is_some_and(|error| error.fix_at_surface),
            position_estimate: position + navigation_error,
            gains: PathFollowingGains::LAB,
            path,
            declared,
            tracking_error,
            gamma: 0.0,
            speed,
            dive,
            leg: file.leg,
            behaviour: Behaviour::FollowsPath,
            track: (!track.is_empty()).then(|| Arc::new(RecordedTrack::new(track))),
        })
    }
}

/// Error of an AUV's navigation at the start, m, and its growth for each metre through the water.
/// Drawn only if given: every number has a stream of its own, in order.
fn navigation_error(file: Option<&NavigationErrorFile>, draw: &mut Draw) -> (Vector2<f64>, Vector2<f64>) {
    let Some(error) = file else { return (Vector2::zeros(), Vector2::zeros()) };
    let mut drawn = |file: Option<&_>| draw.take_or(file, 0.0);
    let at_first = Vector2::new(drawn(error.north_m.as_ref()), drawn(error.east_m.as_ref()));
    let share = draw.take_or(error.drift_share.as_ref(), 0.0);
    let heading = draw.take_or(error.drift_heading_rad.as_ref(), 0.0);
    (at_first, direction(heading) * share)
}

/// The deviations of AUV number `i` from its path, and how late it turns, m, drawn if given.
fn tracking_error(i: usize, file: &TrackingErrorFile, draw: &mut Draw) -> (TrackingError, Option<f64>) {
    let weave = file.weave.as_ref().map(|weave| {
        let (amplitude, period) = (draw.take(&weave.amplitude_m), draw.take(&weave.period_s));
        let mut rng = weave_stream(draw.seed, i);
        match &weave.damping {
            None => Oscillation::sine(amplitude, period, &mut rng),
            Some(damping) => {
                Oscillation::new(amplitude * FRAC_1_SQRT_2, period, draw.take(damping), &mut rng)
            }
        }
    });
    let late = file.turns_late_m.as_ref().map(|late| draw.take(late));
    let slower_diving = file.slower_diving_share.as_ref();
    let slower_diving = slower_diving.map_or(0.0, |share| draw.take(share));
    let error = TrackingError { weave, slower_diving, time: 0.0 };
    (error, late)
}

/// A surface craft without position.
struct SurfaceKind {
    hull: SurfaceHull,
    autopilot: SurfaceAutopilot,
    limits: Limits,
    /// Its declared closed-loop response.
    craft: CraftDescription,
}

fn constraints(file: &RandomCraftFile, draw: &mut Draw) -> CraftConstraints {
    CraftConstraints {
        mass: draw.take_optional(file.mass_kg.as_ref()),
        heading_loop: file.heading_loop,
        heading_lag: draw.take_optional(file.heading_lag_s.as_ref()),
        surge_loop: file.surge_loop,
        surge_lag: draw.take_optional(file.surge_lag_s.as_ref()),
        acceleration: draw.take_optional(file.acceleration_mps2.as_ref()),
        delay: draw.take_optional(file.delay_s.as_ref()),
        speed_held: file.speed_held,
        heading_held: file.heading_held,
    }
}

/// The same tuning, checked.
fn tuning(file: Option<&Tuning>) -> Result<Option<Tuning>, InvalidScenario> {
    let faults = file.map(|tuning| tuning.faults("/tuning"));
    match faults.iter().flatten().next() {
        Some(fault) => Err(of_snapshot("surface_craft", &fault.pointer, fault)),
        None => Ok(file.cloned()),
    }
}

fn declared_limits(
    file: &DeclaredLimits<Distribution>,
    draw: &mut Draw,
) -> Result<DeclaredLimits, InvalidScenario> {
    let mut checked = Checked::new(draw, "surface_craft.limits");
    let limits = file.map(&mut |member, range, number| checked.take(member, range, number));
    checked.all(Some(limits))
}

fn limits(file: &DeclaredLimits, class: &Limits) -> Result<Limits, InvalidScenario> {
    let limits = file.with_defaults(class);
    // A snapshot has the same rule.
    if limits.speed_max < limits.speed_min + 0.05 {
        let (most, least) = (limits.speed_max, limits.speed_min);
        let reason = format_args!("{most} m/s is less than 0.05 m/s above speed_min_mps, {least} m/s");
        return refused("surface_craft.limits.speed_max_mps", reason);
    }
    Ok(limits)
}
