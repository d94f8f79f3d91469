//! Charts over time.

use nalgebra::Vector2;
use planner::angle::ned_from_body;
use sim::record::{AuvRow, Record, Row, SurfaceCraftRow};

use super::Both;
use crate::{
    chart::{Axes, BLACK_INK, BLUE, Line, PURPLE, Panel, Stroke, VERMILION},
    unwrap::unwrap,
};

/// Fig. 4: depth.
pub(super) fn depth(record: &Record) -> Vec<Panel> {
    let lines = (0..record.auv_ids.len()).map(|i| {
        let depth = over_time(record, |row| Some(row.auvs.get(i)?.depth));
        Line::new("depth", BLUE, Stroke::Solid, depth)
    });
    vec![Panel::over_time("", "depth, m", Axes::Down, lines.collect())]
}

/// Fig. 5: distance from the followed point, and the part of it across the path.
pub(super) fn path_error(record: &Record) -> Vec<Panel> {
    let error = |of: fn(&AuvRow) -> f64| over_time(record, move |row| Some(of(row.auvs.first()?)));
    let to_point = error(|auv| auv.along_track.hypot(auv.cross_track));
    let across = error(|auv| auv.cross_track.abs());
    let lines = vec![
        Line::new("to the point followed", BLUE, Stroke::Solid, to_point),
        Line::new("across the path", VERMILION, Stroke::Dashed, across),
    ];
    vec![Panel::over_time("", "distance, m", Axes::Up, lines)]
}

/// Fig. 6: inner loops of an underwater vehicle.
pub(super) fn inner_loops(record: &Record) -> Vec<Panel> {
    let [surge, pitch, heading] = inner_loop_lines(record);
    vec![
        Panel::over_time("surge", "surge, m/s", Axes::Up, surge),
        Panel::over_time("pitch", "pitch, °", Axes::Up, pitch),
        Panel::over_time("heading", "heading, °", Axes::Up, heading),
    ]
}

/// Fig. 9: the surface craft's place in the frame of the underwater vehicle.
pub(super) fn relative(both: &Both) -> Vec<Panel> {
    let lines = |of: fn(&Offset) -> f64| {
        let points = |record| {
            offsets(record)
                .into_iter()
                .map(move |offset| (offset.time, of(&offset)))
        };
        vec![
            Line::new("planner", BLUE, Stroke::Solid, points(&both.planner)),
            Line::new(
                "line of sight, tuned",
                VERMILION,
                Stroke::Dashed,
                points(&both.line_of_sight),
            ),
        ]
    };
    vec![
        Panel::over_time(
            "along the AUV's course, positive ahead of it",
            "along-track, m",
            Axes::Up,
            lines(|offset| offset.along),
        ),
        Panel::over_time(
            "across it, positive to starboard",
            "cross-track, m",
            Axes::Up,
            lines(|offset| offset.across),
        ),
    ]
}

/// Fig. 10: references and motion of both craft, under either controller.
pub(super) fn both_craft(both: &Both) -> Vec<Panel> {
    let columns = [
        ("planner", &both.planner),
        ("line of sight, tuned", &both.line_of_sight),
    ]
    .map(|(name, record)| (name, inner_loop_lines(record), surface_craft_lines(record)));
    let units = ["surge, m/s", "pitch, °", "heading, °"];
    let mut panels = vec![];
    for (k, unit) in units.into_iter().enumerate() {
        for (name, under, above) in &columns {
            let lines = [above[k].clone(), under[k].clone()].concat();
            panels.push(Panel::over_time(name, unit, Axes::Up, lines));
        }
    }
    panels
}

/// Where the surface craft is, seen from an underwater vehicle.
pub(super) struct Offset {
    /// Time, s.
    pub(super) time: f64,
    /// Along the vehicle's course over ground, m, positive ahead of it.
    pub(super) along: f64,
    /// Across it, m, positive to starboard.
    pub(super) across: f64,
}

/// The surface craft's place relative to the first underwater vehicle, in the frame of that vehicle's course:
///
/// ```text
/// (s, e) = R(χ)ᵀ (p − p_d)
/// ```
/// χ comes from the positions a row before and after, which hold every current and every sideslip; while they
/// are the same point, the last χ stays.
pub(super) fn offsets(record: &Record) -> Vec<Offset> {
    let rows = &record.rows;
    let position = |k: usize| rows.get(k)?.auvs.first().map(|auv| auv.position);
    let mut course = 0.0;
    let mut offsets = vec![];
    for (k, row) in rows.iter().enumerate() {
        let (Some(craft), Some(auv)) = (&row.surface_craft, position(k)) else {
            continue;
        };
        let before = position(k.saturating_sub(1)).unwrap_or(auv);
        let moved: Vector2<f64> = position(k + 1).unwrap_or(auv) - before;
        if moved != Vector2::zeros() {
            course = moved.y.atan2(moved.x);
        }
        let offset = ned_from_body(course).transpose() * (craft.position - auv);
        offsets.push(Offset {
            time: row.time,
            along: offset.x,
            across: offset.y,
        });
    }
    offsets
}

/// Surge, pitch and heading of the first underwater vehicle, its references on top.
fn inner_loop_lines(record: &Record) -> [Vec<Line>; 3] {
    let points = |of: fn(&AuvRow) -> f64| over_time(record, move |row| Some(of(row.auvs.first()?)));
    let reference = |of| Line::new("AUV, reference", VERMILION, Stroke::Dashed, points(of));
    let actual = |of| Line::new("AUV", BLUE, Stroke::Solid, points(of));
    [
        vec![actual(|auv| auv.surge), reference(|auv| auv.reference.surge)],
        vec![
            actual(|auv| auv.pitch.to_degrees()),
            reference(|auv| auv.reference.pitch.to_degrees()),
        ],
        heading_lines(reference(|auv| auv.reference.heading), actual(|auv| auv.heading)),
    ]
}

/// Surge, pitch (which has none) and heading of the surface craft, its references on top.
fn surface_craft_lines(record: &Record) -> [Vec<Line>; 3] {
    let points = |of: fn(&SurfaceCraftRow) -> f64| {
        over_time(record, move |row| Some(of(row.surface_craft.as_ref()?)))
    };
    let reference = |of| Line::new("surface craft, reference", PURPLE, Stroke::Dashed, points(of));
    let actual = |of| Line::new("surface craft", BLACK_INK, Stroke::Solid, points(of));
    [
        vec![
            actual(|craft| craft.surge),
            reference(|craft| craft.reference.speed),
        ],
        vec![],
        heading_lines(
            reference(|craft| craft.reference.heading.radians()),
            actual(|craft| craft.heading),
        ),
    ]
}

/// Headings without jumps, the reference on top.
fn heading_lines(reference: Line, actual: Line) -> Vec<Line> {
    let mut lines = [reference, actual];
    unwrap(&mut lines);
    let [reference, actual] = lines;
    vec![actual, reference]
}

fn over_time(record: &Record, of: impl Fn(&Row) -> Option<f64>) -> impl Iterator<Item = (f64, f64)> {
    record
        .rows
        .iter()
        .filter_map(move |row| Some((row.time, of(row)?)))
}

#[cfg(test)]
mod tests {
    use planner::parameters::Parameters;
    use sim::{guide::LosGuide, mission, scenario::Scenario};

    use super::*;

    #[test]
    fn a_craft_behind_and_to_starboard_is_so_whichever_way_the_vehicle_goes_and_while_it_rests() {
        let scenario = Scenario::named("paper-tracking").expect("exists").lasting(4.0);
        let mut guide = LosGuide::new(Parameters::default().los);
        let mut record = mission::run(&scenario, &mut guide, 1, &mut |_| {}).expect("runs");
        // North, east, south, south-west: ahead and starboard as on a compass rose.
        let s = std::f64::consts::FRAC_1_SQRT_2;
        let roses = [
            ([1.0, 0.0], [0.0, 1.0]),
            ([0.0, 1.0], [-1.0, 0.0]),
            ([-1.0, 0.0], [0.0, -1.0]),
            ([-s, -s], [s, -s]),
        ];
        for (ahead, starboard) in roses.map(|(a, b)| (Vector2::from(a), Vector2::from(b))) {
            for (row, travelled) in record.rows.iter_mut().zip([0.0, 0.2, 0.2, 0.2]) {
                row.auvs[0].position = Vector2::new(7.0, -3.0) + ahead * travelled;
                row.surface_craft.as_mut().expect("has one").position =
                    row.auvs[0].position - ahead * 3.0 + starboard * 2.0;
            }
            let offsets = offsets(&record);
            assert_eq!(offsets.len(), 4);
            for Offset { along, across, .. } in offsets {
                assert!((along + 3.0).abs() < 1e-12 && (across - 2.0).abs() < 1e-12);
            }
        }
    }
}
