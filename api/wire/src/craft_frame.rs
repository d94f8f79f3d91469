//! The frame of plans whose datum is known: the azimuthal equidistant projection about the craft.
//!
//! Its north is true north at the craft. Headings, courses, velocities, currents and offsets are
//! true; only positions are converted. Near the craft, that is
//!
//! ```text
//! p' = J (p − c)
//! ```
//! for a position p (north, east) from the request's datum, the craft's position c, and the
//! derivative J of true (north, east) at the craft by the datum's ([`Datum::true_from_local`]). Its
//! error is |c| |p − c|²/R² (Earth's radius R).

use geodesy::Datum;
use nalgebra::{Matrix2, Rotation2, Vector2};
use planner::path::Segment;
use planner::plan::Plan;
use planner::snapshot::{NoGo, Origin, PlanRequest, PreviousPlan, Snapshot, Vessel};

/// Largest error of the linear form, m; beyond it, positions are converted over the Earth.
const LINEAR_ERROR_MAX: f64 = 1e-3;

const EARTH_RADIUS: f64 = 6.371e6;

/// The frame at a craft.
#[derive(Clone, Debug)]
pub struct CraftFrame {
    craft: Vector2<f64>,
    datum: Datum,
    at_craft: Datum,
    from_datum: Matrix2<f64>,
    to_datum: Matrix2<f64>,
    /// Turns a whole path, so that its lines and arcs still join.
    turn: Rotation2<f64>,
}

impl CraftFrame {
    /// The frame at `craft` (north, east), m, from `origin`; none if that is no place on Earth.
    pub fn new(origin: Origin, craft: Vector2<f64>) -> Option<Self> {
        Self::at(&datum(origin)?, craft)
    }

    fn at(datum: &Datum, craft: Vector2<f64>) -> Option<Self> {
        let from_datum = datum.true_from_local(&craft);
        Some(Self {
            craft,
            datum: *datum,
            at_craft: Datum::new(&datum.from_local(&craft)).ok()?,
            from_datum,
            to_datum: from_datum.try_inverse().unwrap_or_else(Matrix2::identity),
            turn: Rotation2::new(datum.convergence(&craft)),
        })
    }

    /// The frame of `snapshot` as seen from `origin`, if it is at the craft.
    pub(crate) fn of(snapshot: &Snapshot, origin: Option<Origin>) -> Option<Self> {
        let datum = datum(origin?)?;
        let craft = datum.to_local(&snapshot.origin?.into()).ok()?;
        Self::at(&datum, craft)
    }

    /// `plan`, made for `snapshot`, for the next request; positions count from `origin`.
    pub fn previous_plan(snapshot: &Snapshot, plan: &Plan, origin: Option<Origin>) -> PreviousPlan {
        let mut previous = PreviousPlan::from(plan);
        if let Some(frame) = Self::of(snapshot, origin) {
            previous.move_positions(|position| frame.leave(&position));
        }
        previous
    }

    /// Moves `request`, if it has an origin, to the frame at `craft` (north, east), m, the new
    /// origin: the position of its craft, or that of the first one of a fleet.
    pub(crate) fn enter(request: &mut PlanRequest, craft: Vector2<f64>) {
        let Some(frame) = request.origin.and_then(|origin| Self::new(origin, craft)) else {
            return;
        };
        let place = Origin::from(frame.datum.from_local(&craft));
        request.origin = Some(place);
        frame.put(&mut request.asc.north_m, &mut request.asc.east_m);
        for auv in &mut request.auvs {
            if let Some(state) = &mut auv.state {
                frame.put(&mut state.north_m, &mut state.east_m);
            }
            for report in auv.reports.iter_mut().flatten() {
                report.move_position(|position| frame.position(position));
            }
            if let Some(path) = &mut auv.path {
                frame.turn(&mut path.segments);
            }
        }
        for disc in &mut request.keep_outs {
            frame.put(&mut disc.north_m, &mut disc.east_m);
        }
        for (north, east) in request.traffic.iter_mut().flat_map(Vessel::positions_mut) {
            frame.put(north, east);
        }
        // Straight sides stay straight.
        for corner in request.area.iter_mut().chain(request.no_go.iter_mut().flat_map(NoGo::corners_mut)) {
            *corner = (frame.from_datum * (Vector2::from(*corner) - frame.craft)).into();
        }
        if let Some(plan) = &mut request.previous_plan {
            plan.origin = plan.origin.and(Some(place));
            plan.move_positions(|position| frame.position(&position));
        }
    }

    /// Converts a position from the craft to one (north, east) from the datum, m.
    pub fn leave(&self, position: &Vector2<f64>) -> Vector2<f64> {
        let exact = || self.datum.to_local(&self.at_craft.from_local(position)).ok();
        let linear = || self.craft + self.to_datum * position;
        self.is_far(position).then(exact).flatten().unwrap_or_else(linear)
    }

    /// Converts a position from the datum to one (north, east) from the craft, m.
    fn position(&self, position: &Vector2<f64>) -> Vector2<f64> {
        let from_craft = position - self.craft;
        let exact = || self.at_craft.to_local(&self.datum.from_local(position)).ok();
        let exact = self.is_far(&from_craft).then(exact).flatten();
        exact.unwrap_or_else(|| self.from_datum * from_craft)
    }

    /// `true` if the linear form is too inexact at `from_craft`, m.
    fn is_far(&self, from_craft: &Vector2<f64>) -> bool {
        LINEAR_ERROR_MAX * EARTH_RADIUS.powi(2) < self.craft.norm() * from_craft.norm_squared()
    }

    fn put(&self, north: &mut f64, east: &mut f64) {
        let position = self.position(&Vector2::new(*north, *east));
        (*north, *east) = (position.x, position.y);
    }

    /// Turns a path about its first point.
    fn turn(&self, segments: &mut [Segment]) {
        let mut anchor = None;
        for point in segments.iter_mut().flat_map(Segment::points_mut) {
            let position = Vector2::from(*point);
            let first = *anchor.get_or_insert(position);
            *point = (self.position(&first) + self.turn * (position - first)).into();
        }
    }
}

fn datum(origin: Origin) -> Option<Datum> {
    Datum::new(&origin.into()).ok()
}
