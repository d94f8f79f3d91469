//! An AUV's path at a start, and its speed along it.

use geodesy::Datum;
use nalgebra::Vector2;
use planner::path::{Path, Segment, SpeedProfile, TURN_RADIUS};

use super::draw::{Draw, check_count, survey_stream};
use super::invalid::{InvalidScenario, invalid, refused};
use super::survey::SurveyConstraints;
use crate::{
    record::Origin,
    scenario::{
        file::{AuvFile, LANES_MAX, PathFile, Scenario, SegmentFile, SpeedKnot},
        quantity::{Coordinate, Kind},
    },
    world::underwater_vehicle::UnderwaterClass,
};

impl Scenario {
    /// The path of AUV `i`, as long as the list of kinds: an arm draws the numbers of one.
    pub(super) fn path(
        &self,
        i: usize,
        file: &PathFile,
        origin: Option<Origin>,
        draw: &mut Draw,
    ) -> Result<Path, InvalidScenario> {
        let kind = match file {
            PathFile::LawnMower { .. } => "lawn_mower",
            PathFile::Waypoints { .. } => "waypoints",
            PathFile::RandomSurvey { .. } => "random_survey",
            PathFile::Circle { .. } => "circle",
            PathFile::Segments { .. } => "segments",
            PathFile::Geojson { .. } => "geojson",
        };
        let field = format!("auvs[{i}].path.{kind}");
        let drawn = match file {
            PathFile::LawnMower { from, heading_rad, lane_length_m, lane_spacing_m, lanes } => {
                if !(1..=LANES_MAX).contains(lanes) {
                    let fault = format_args!("{lanes} is outside 1 to {LANES_MAX}");
                    return refused(format!("{field}.lanes"), fault);
                }
                let from = draw.point(from);
                let heading = draw.take(heading_rad);
                let (length, spacing) = (draw.take(lane_length_m), draw.take(lane_spacing_m));
                let path = Path::lawn_mower(from, heading, length, spacing, *lanes);
                path.check().map(|()| path)
            }
            PathFile::Waypoints { points, fillet_m, turn_radius_m, closed } => {
                let points = draw.points(points).into_iter().map(Into::into).collect();
                let (fillet_m, turn_radius_m) = match (fillet_m, turn_radius_m) {
                    (Some(_), Some(_)) => return refused(field, "fillet_m or turn_radius_m, not both"),
                    (Some(fillet), None) => (Some(draw.take(fillet)), None),
                    (None, radius) => (None, Some(draw.take_or(radius.as_ref(), TURN_RADIUS))),
                };
                let waypoints = Segment::Waypoints { points, fillet_m, turn_radius_m, legs: vec![] };
                Path::from_segments(&[waypoints], *closed)
            }
            PathFile::RandomSurvey { seed, pattern, from, heading_rad, leg_m, spacing_m, turn_radius_m } => {
                let constraints = SurveyConstraints {
                    pattern: *pattern,
                    from: from.as_ref().map_or(Vector2::zeros(), |from| draw.point(from)),
                    heading: draw.take_optional(heading_rad.as_ref()),
                    leg: draw.take_optional(leg_m.as_ref()),
                    spacing: draw.take_optional(spacing_m.as_ref()),
                    turn_radius: draw.take_or(turn_radius_m.as_ref(), TURN_RADIUS),
                };
                let rng = survey_stream(seed.unwrap_or(draw.seed), i);
                return constraints.draw(&field, rng);
            }
            PathFile::Circle { centre, radius_m, turn, bearing_rad } => {
                let centre = draw.point(centre);
                let radius = draw.take(radius_m);
                let bearing = draw.take_or(bearing_rad.as_ref(), 0.0);
                Path::circle(centre, radius, *turn, bearing)
            }
            PathFile::Segments { segments, closed } => {
                let segments: Vec<Segment> = segments.iter().map(|file| segment(file, draw)).collect();
                Path::from_segments(&segments, *closed)
            }
            PathFile::Geojson { file, fillet_m } => {
                let no_datum = "latitudes and longitudes need a datum: add [origin]";
                let origin = origin.ok_or_else(|| invalid(field.clone(), no_datum))?;
                let file_field = || format!("{field}.file");
                let line = self.files.line(file);
                let line = line.map_err(|error| invalid(file_field(), error))?;
                let not_on_earth = |error| invalid(file_field(), error);
                let datum = Datum::new(&origin).map_err(not_on_earth)?;
                let points = line.iter().map(|place| datum.to_local(place));
                let points = points.collect::<Result<Vec<_>, _>>().map_err(not_on_earth)?;
                Path::waypoints(&points, draw.take(fillet_m), false)
            }
        };
        drawn.map_err(|error| invalid(field, error))
    }
}

/// A point of `path` outside the range of coordinates, if there is one.
pub(super) fn point_out_of_range(path: &Path) -> Option<Vector2<f64>> {
    /// A path has at most a few hundred pieces.
    const SAMPLES: u32 = 2000;
    let at = |k: u32| path.length() * f64::from(k) / f64::from(SAMPLES);
    let mut points = (0..=SAMPLES).map(|k| path.at(at(k)).position);
    points.find(|point| Coordinate::MAX < point.amax())
}

/// Speed along the path, within reach of the hull.
pub(super) fn speed_profile(
    i: usize,
    file: &AuvFile,
    class: UnderwaterClass,
    draw: &mut Draw,
) -> Result<SpeedProfile, InvalidScenario> {
    let field = format!("auvs[{i}].speed_profile");
    let mut knots = vec![(0.0, draw.take_or(file.speed_mps.as_ref(), class.speed()))];
    if let Some(profile) = &file.speed_profile {
        if file.speed_mps.is_some() {
            return refused(field, "speed_mps is given too; give one of them");
        }
        check_count(&field, profile.len())?;
        if profile.is_empty() {
            return refused(field, "a profile has at least one knot");
        }
        let knot = |knot: &SpeedKnot| (draw.take(&knot.along_m), draw.take(&knot.speed_mps));
        knots = profile.iter().map(knot).collect();
    }
    let hull = class.hull();
    for (_, speed) in &knots {
        if hull.force_max < hull.drag_surge.resistance(*speed) {
            let most = hull.force_max;
            let reason = format_args!("{speed} m/s needs more than the {most} N of the vehicle");
            return refused(format!("auvs[{i}].speed_mps"), reason);
        }
    }
    SpeedProfile::new(knots).map_err(|error| invalid(field, error))
}

fn segment(file: &SegmentFile, draw: &mut Draw) -> Segment {
    match file {
        // Members are drawn in this order.
        SegmentFile::Line { from, to } => {
            Segment::Line { from: draw.point(from).into(), to: draw.point(to).into() }
        }
        SegmentFile::Arc { from, centre, angle_rad } => Segment::Arc {
            from: draw.point(from).into(),
            centre: draw.point(centre).into(),
            angle_rad: draw.take(angle_rad),
        },
    }
}
