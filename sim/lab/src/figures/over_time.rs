//! Quantities over time.

use nalgebra::Vector2;
use planner::angle::ned_from_body;
use sim::record::{AuvRow, Record, SurfaceCraftRow};

use super::Both;
use crate::{
    chart::{Axes, BLACK_INK, BLUE, Colour, Line, PURPLE, Panel, Sheet, Stroke, VERMILION},
    unwrap::unwrap,
};

/// Height of the only panel of a page, and of one of three, units.
const ALONE: u32 = 700;
const ONE_OF_THREE: u32 = 420;

/// Fig. 4: depth.
pub(super) fn depth(record: &Record) -> Sheet {
    let lines = (0..record.auv_ids.len())
        .map(|i| auv_line(record, i, "depth", BLUE, Stroke::Solid, |auv| auv.depth))
        .collect();
    column(vec![panel("", "depth, m", Axes::Depth(ALONE), lines)])
}

/// Fig. 5: distance from the followed point, and the part of it across the path.
pub(super) fn path_error(record: &Record) -> Sheet {
    let lines = vec![
        auv_line(record, 0, "to the point followed", BLUE, Stroke::Solid, |auv| {
            auv.along_track.hypot(auv.cross_track)
        }),
        auv_line(record, 0, "across the path", VERMILION, Stroke::Dashed, |auv| {
            auv.cross_track.abs()
        }),
    ];
    column(vec![panel("", "distance, m", Axes::Time(ALONE), lines)])
}

/// Fig. 6: inner loops of an underwater vehicle.
pub(super) fn inner_loops(record: &Record) -> Sheet {
    let [surge, pitch, heading] = inner_loop_lines(record);
    column(vec![
        panel("surge", "surge, m/s", Axes::Time(ONE_OF_THREE), surge),
        panel("pitch", "pitch, °", Axes::Time(ONE_OF_THREE), pitch),
        panel("heading", "heading, °", Axes::Time(ONE_OF_THREE), heading),
    ])
}

/// Fig. 9: the surface craft's place in the frame of the underwater vehicle.
pub(super) fn relative(both: &Both) -> Sheet {
    let lines = |of: fn(&Offset) -> f64| {
        let line = |name: &str, colour, stroke, record| Line {
            name: name.to_owned(),
            colour,
            stroke,
            points: offsets(record)
                .iter()
                .map(|offset| (offset.time, of(offset)))
                .collect(),
        };
        vec![
            line("planner", BLUE, Stroke::Solid, &both.planner),
            line(
                "line of sight, tuned",
                VERMILION,
                Stroke::Dashed,
                &both.line_of_sight,
            ),
        ]
    };
    column(vec![
        panel(
            "along the AUV's course, positive ahead of it",
            "along-track, m",
            Axes::Time(ONE_OF_THREE),
            lines(|offset| offset.along),
        ),
        panel(
            "across it, positive to starboard",
            "cross-track, m",
            Axes::Time(ONE_OF_THREE),
            lines(|offset| offset.across),
        ),
    ])
}

/// Fig. 10: references of both craft and what becomes of them, under either controller.
pub(super) fn both_craft(both: &Both) -> Sheet {
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
            panels.push(panel(name, unit, Axes::Time(ONE_OF_THREE), lines));
        }
    }
    Sheet { columns: 2, panels }
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
    let reference = |of| auv_line(record, 0, "AUV, reference", VERMILION, Stroke::Dashed, of);
    let actual = |of| auv_line(record, 0, "AUV", BLUE, Stroke::Solid, of);
    let mut heading = [reference(|auv| auv.reference.heading), actual(|auv| auv.heading)];
    unwrap(&mut heading);
    let [heading_reference, heading_actual] = heading;
    [
        vec![actual(|auv| auv.surge), reference(|auv| auv.reference.surge)],
        vec![
            actual(|auv| auv.pitch.to_degrees()),
            reference(|auv| auv.reference.pitch.to_degrees()),
        ],
        vec![heading_actual, heading_reference],
    ]
}

/// Surge, pitch (of which there is none) and heading of the surface craft, its references on top.
fn surface_craft_lines(record: &Record) -> [Vec<Line>; 3] {
    let line = |name: &str, colour, stroke, of: fn(&SurfaceCraftRow) -> f64| Line {
        name: name.to_owned(),
        colour,
        stroke,
        points: record
            .rows
            .iter()
            .filter_map(|row| Some((row.time, of(row.surface_craft.as_ref()?))))
            .collect(),
    };
    let reference = |of| line("surface craft, reference", PURPLE, Stroke::Dashed, of);
    let actual = |of| line("surface craft", BLACK_INK, Stroke::Solid, of);
    let mut heading = [
        reference(|craft| craft.reference.heading.radians()),
        actual(|craft| craft.heading),
    ];
    unwrap(&mut heading);
    let [heading_reference, heading_actual] = heading;
    [
        vec![
            actual(|craft| craft.surge),
            reference(|craft| craft.reference.speed),
        ],
        vec![],
        vec![heading_actual, heading_reference],
    ]
}

fn auv_line(
    record: &Record,
    i: usize,
    name: &str,
    colour: Colour,
    stroke: Stroke,
    of: fn(&AuvRow) -> f64,
) -> Line {
    Line {
        name: name.to_owned(),
        colour,
        stroke,
        points: record
            .rows
            .iter()
            .filter_map(|row| Some((row.time, of(row.auvs.get(i)?))))
            .collect(),
    }
}

fn panel(heading: &str, y_label: &'static str, axes: Axes, lines: Vec<Line>) -> Panel {
    Panel {
        heading: heading.to_owned(),
        ..Panel::over_time(y_label, axes, lines)
    }
}

fn column(panels: Vec<Panel>) -> Sheet {
    Sheet { columns: 1, panels }
}

#[cfg(test)]
mod tests {
    use planner::policy::Policy;
    use sim::{guide::LosGuide, mission, scenario::Scenario};

    use super::*;

    #[test]
    fn a_craft_behind_and_to_starboard_is_so_whichever_way_the_vehicle_goes_and_while_it_rests() {
        let scenario = Scenario::named("paper-tracking").expect("exists").lasting(4.0);
        let mut guide = LosGuide::new(Policy::default().los);
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
