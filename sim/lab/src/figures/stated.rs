//! The numbers that the source paper states, beside the measured ones.

use sim::{
    metrics::{AuvMetrics, Metrics},
    record::{AuvRow, Record},
};

use crate::document::Table;

use super::{Both, PaperMissions, over_time::offsets};

/// Numbers that the paper states in its figures' text, beside the measured ones. Settled means after the scenario's settling time.
pub(super) fn stated(missions: &PaperMissions) -> Table {
    let PaperMissions {
        path_following,
        tracking,
        intermittent,
        midpoint,
    } = missions;
    let mut rows = underwater(path_following);
    rows.extend(surface(tracking));
    rows.extend([
        row(
            14,
            "settled distance to the goal (root mean square)",
            "not stated",
            settled(intermittent),
        ),
        row(
            15,
            "settled distance to the midpoint (root mean square)",
            "not stated",
            settled(midpoint),
        ),
    ]);
    Table {
        words: 4,
        columns: ["Fig.", "quantity", "paper", "here"].map(str::to_owned).into(),
        rows,
    }
}

fn row(figure: u8, quantity: &str, paper: &str, measured: String) -> Vec<String> {
    vec![
        figure.to_string(),
        quantity.to_owned(),
        paper.to_owned(),
        measured,
    ]
}

fn underwater(record: &Record) -> Vec<Vec<String>> {
    let metrics = Metrics::of(record);
    let first = metrics.auvs.first().filter(|_| has_settled(record));
    let of = |text: fn(&AuvMetrics) -> String| first.map_or_else(missing, text);
    vec![
        row(
            3,
            "cross-track error, settled",
            "±1.2 m",
            of(|auv| format!("within ±{}", metres(auv.cross_track_max_m))),
        ),
        row(
            4,
            "depth, settled",
            "1 m to 23 m",
            of(|auv| format!("{} to {}", metres(auv.depth_min_m), metres(auv.depth_max_m))),
        ),
        row(
            5,
            "position error, settled",
            "below 1 m",
            of(|auv| format!("at most {}", metres(auv.position_error_max_m))),
        ),
        row(
            6,
            "surge, settled mean",
            "0.3 m/s",
            of(|auv| speed(auv.surge_mean_mps)),
        ),
        row(
            6,
            "pitch, settled",
            "−50° and 50°",
            of(|auv| format!("{} to {}", degrees(auv.pitch_min_rad), degrees(auv.pitch_max_rad))),
        ),
    ]
}

fn surface(tracking: &Both) -> Vec<Vec<String>> {
    vec![
        row(
            8,
            "settled distance from the AUV (root mean square)",
            "≈ 1 m",
            settled(tracking),
        ),
        row(
            9,
            "largest along-track overshoot past the AUV",
            "visible, not stated",
            each(tracking, |record| {
                metres(
                    offsets(record)
                        .iter()
                        .map(|offset| offset.along)
                        .fold(0.0, f64::max),
                )
            }),
        ),
        row(
            10,
            "settled mean surge of the surface craft",
            "a little above the AUV's",
            format!(
                "{}; AUV {} along its body, {} over ground",
                each(tracking, surge_of_surface_craft),
                mean(&tracking.planner, |auv| auv.surge),
                ground_speed(&tracking.planner)
            ),
        ),
    ]
}

fn each(both: &Both, of: fn(&Record) -> String) -> String {
    format!(
        "planner {}, line of sight {}",
        of(&both.planner),
        of(&both.line_of_sight)
    )
}

fn settled(both: &Both) -> String {
    each(both, |record| {
        let metrics = Metrics::of(record).surface_craft.filter(|_| has_settled(record));
        metrics.map_or_else(missing, |metrics| metres(metrics.settled_rms_m))
    })
}

fn ground_speed(record: &Record) -> String {
    let positions = settled_auvs(record).map(|auv| auv.position).collect::<Vec<_>>();
    let steps = positions
        .windows(2)
        .map(|two| (two[1] - two[0]).norm() / record.interval);
    speed(average(steps))
}

fn surge_of_surface_craft(record: &Record) -> String {
    let settled = record.rows.iter().filter(|row| record.settled_after <= row.time);
    speed(average(
        settled.filter_map(|row| Some(row.surface_craft.as_ref()?.surge)),
    ))
}

fn mean(record: &Record, of: fn(&AuvRow) -> f64) -> String {
    speed(average(settled_auvs(record).map(of)))
}

fn has_settled(record: &Record) -> bool {
    record
        .rows
        .last()
        .is_some_and(|row| record.settled_after <= row.time)
}

fn settled_auvs(record: &Record) -> impl Iterator<Item = &AuvRow> {
    let settled = record.rows.iter().filter(|row| record.settled_after <= row.time);
    settled.filter_map(|row| row.auvs.first())
}

/// Not a number if there are no values.
fn average(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, n) = values.fold((0.0, 0.0), |(sum, n), value| (sum + value, n + 1.0));
    sum / n
}

fn metres(value: f64) -> String {
    number(value, 3, " m")
}

fn speed(value: f64) -> String {
    number(value, 3, " m/s")
}

fn degrees(radians: f64) -> String {
    number(radians.to_degrees(), 1, "°")
}

/// Not finite where no row has settled.
fn number(value: f64, decimals: usize, unit: &str) -> String {
    if value.is_finite() {
        format!("{value:.decimals$}{unit}").replace('-', "−")
    } else {
        missing()
    }
}

fn missing() -> String {
    "–".to_owned()
}
