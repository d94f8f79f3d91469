//! The frame that plans are made in where the datum's place on Earth is known: its north is true north at the craft.
//!
//! ```text
//! p' = J (p − c)
//! ```
//!
//! p is a position (north, east) from the request's datum, c is the craft's, and J is the derivative of true (north, east) at
//! the craft by the datum's ([`Datum::true_from_local`]). Headings, courses, velocities, currents and offsets are true: no angle
//! is converted. Off by s L²/R² at a distance L from a craft that is s from the datum: 0.4 m at 5 km and 600 km.

use geodesy::Datum;
use nalgebra::{Matrix2, Rotation2, Vector2};
use planner::{
    path::Segment,
    plan::Plan,
    snapshot::{Origin, PlanRequest, PreviousPlan, Snapshot},
};

/// The frame at a craft.
#[derive(Clone, Copy, Debug)]
pub struct CraftFrame {
    craft: Vector2<f64>,
    from_datum: Matrix2<f64>,
    to_datum: Matrix2<f64>,
    /// Paths are turned alone: their lines and arcs must join as they did.
    turn: Rotation2<f64>,
}

impl CraftFrame {
    /// At `craft` (north, east) of a datum at `origin`, m. None if that is no place on Earth.
    #[must_use]
    pub fn new(origin: Origin, craft: Vector2<f64>) -> Option<Self> {
        Some(Self::at(&datum(origin)?, craft))
    }

    fn at(datum: &Datum, craft: Vector2<f64>) -> Self {
        let from_datum = datum.true_from_local(&craft);
        Self {
            craft,
            from_datum,
            to_datum: from_datum.try_inverse().unwrap_or_else(Matrix2::identity),
            turn: Rotation2::new(datum.convergence(&craft)),
        }
    }

    /// That of `snapshot`, if it is at the craft, as seen from `origin`.
    pub(crate) fn of(snapshot: &Snapshot, origin: Option<Origin>) -> Option<Self> {
        let datum = datum(origin?)?;
        let craft = datum.to_local(&snapshot.origin?.into()).ok()?;
        Some(Self::at(&datum, craft))
    }

    /// What the next request has to say of `plan`, which was made for `snapshot`, its positions from `origin`.
    #[must_use]
    pub fn previous_plan(snapshot: &Snapshot, plan: &Plan, origin: Option<Origin>) -> PreviousPlan {
        let mut previous = PreviousPlan::from(plan);
        if let Some(frame) = Self::of(snapshot, origin) {
            previous.move_positions(|position| frame.leave(&position));
        }
        previous
    }

    /// Counts the positions of `request` from the craft, which becomes its origin. Without an origin it stays as it is.
    pub(crate) fn enter(request: &mut PlanRequest) {
        let Some(datum) = request.origin.and_then(datum) else {
            return;
        };
        let frame = Self::at(&datum, request.asc.position());
        let place = Origin::from(datum.from_local(&frame.craft));
        request.origin = Some(place);
        frame.put(&mut request.asc.north_m, &mut request.asc.east_m);
        for auv in &mut request.auvs {
            if let Some(state) = &mut auv.state {
                frame.put(&mut state.north_m, &mut state.east_m);
            }
            for report in auv.reports.iter_mut().flatten() {
                frame.put(&mut report.north_m, &mut report.east_m);
            }
            if let Some(path) = &mut auv.path {
                frame.turn(&mut path.segments);
            }
        }
        for disc in &mut request.keep_outs {
            frame.put(&mut disc.north_m, &mut disc.east_m);
        }
        for [north, east] in &mut request.area {
            frame.put(north, east);
        }
        if let Some(plan) = &mut request.previous_plan {
            plan.origin = plan.origin.and(Some(place));
            plan.move_positions(|position| frame.position(&position));
        }
    }

    /// The position (north, east) from the datum, m, of one from the craft.
    #[must_use]
    pub fn leave(&self, position: &Vector2<f64>) -> Vector2<f64> {
        self.craft + self.to_datum * position
    }

    /// The position (north, east) from the craft, m, of one from the datum.
    fn position(&self, position: &Vector2<f64>) -> Vector2<f64> {
        self.from_datum * (position - self.craft)
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
