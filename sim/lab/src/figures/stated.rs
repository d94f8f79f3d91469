//! The numbers that the source paper states, beside the measured ones.

use nalgebra::Vector2;
use sim::{
    metrics::{AuvMetrics, Metrics},
    record::{AuvRow, Record},
};

use crate::document::{Block, Document, Table};

use super::{Both, PaperMissions, over_time::offsets};

/// A quantity that the paper states, and its measured value.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Stated {
    /// Its figure.
    pub figure: u8,
    /// Its name.
    pub quantity: &'static str,
    /// As the paper states it.
    pub paper: &'static str,
    /// As measured.
    pub measured: String,
    /// Why they agree or differ.
    pub why: &'static str,
}

/// Every quantity that the paper states in its figures' text. Settled means after the scenario's settling time.
#[must_use]
pub fn stated(missions: &PaperMissions) -> Vec<Stated> {
    let PaperMissions {
        path_following,
        tracking,
        intermittent,
        midpoint,
    } = missions;
    let mut rows = underwater(path_following);
    rows.extend(surface(tracking));
    rows.extend([
        Stated {
            figure: 14,
            quantity: "time with each AUV before the next",
            paper: "240 s",
            measured: dwells(&intermittent.planner),
            why: "given by the scenario; read back from where the goal was",
        },
        Stated {
            figure: 14,
            quantity: "settled distance to the goal (root mean square)",
            paper: "not stated",
            measured: settled(intermittent),
            why: "most of it is the way from one AUV to the other, which the planner begins before the \
                  hand-over and line of sight after it",
        },
        Stated {
            figure: 15,
            quantity: "settled distance to the midpoint (root mean square)",
            paper: "not stated",
            measured: settled(midpoint),
            why: "the midpoint moves as slowly as the AUVs do, so both keep to it",
        },
    ]);
    rows
}

/// The rows as a Markdown table.
#[must_use]
pub fn table(rows: &[Stated]) -> String {
    Document(vec![Block::Table(as_table(rows))]).markdown()
}

pub(super) fn as_table(rows: &[Stated]) -> Table {
    Table::of(5, rows)
        .column("Fig.", |row| row.figure.to_string())
        .column("quantity", |row| row.quantity.to_owned())
        .column("paper", |row| row.paper.to_owned())
        .column("here", |row| row.measured.clone())
        .column("why", |row| row.why.to_owned())
        .table
}

fn underwater(record: &Record) -> Vec<Stated> {
    let metrics = Metrics::of(record);
    let first = metrics.auvs.first().filter(|_| has_settled(record));
    let of = |text: fn(&AuvMetrics) -> String| first.map_or_else(missing, text);
    vec![
        Stated {
            figure: 3,
            quantity: "cross-track error, settled",
            paper: "±1.2 m",
            measured: of(|auv| format!("within ±{}", metres(auv.cross_track_max_m))),
            why: "the law here is the paper's with its equations corrected (docs/rationale.md)",
        },
        Stated {
            figure: 4,
            quantity: "depth, settled",
            paper: "1 m to 23 m",
            measured: of(|auv| format!("{} to {}", metres(auv.depth_min_m), metres(auv.depth_max_m))),
            why: "the limits start the turn; the pitch needs time to swing through 100°, and depth goes on until then",
        },
        Stated {
            figure: 5,
            quantity: "position error, settled",
            paper: "below 1 m",
            measured: of(|auv| format!("at most {}", metres(auv.position_error_max_m))),
            why: "the horizontal speed enters the law as u cosθ here, without which the AUV trails its point",
        },
        Stated {
            figure: 6,
            quantity: "surge, settled mean",
            paper: "0.3 m/s",
            measured: of(|auv| speed(auv.surge_mean_mps)),
            why: "the reference is the paper's and the surge loop has an integrator; the paper's surge ripples when the pitch reverses, and in the model here pitch does not act on surge",
        },
        Stated {
            figure: 6,
            quantity: "pitch, settled",
            paper: "−50° and 50°",
            measured: of(|auv| format!("{} to {}", degrees(auv.pitch_min_rad), degrees(auv.pitch_max_rad))),
            why: "the reference is the paper's; beyond it is the overshoot of the pitch loop",
        },
        Stated {
            figure: 6,
            quantity: "vertical speed, down and up",
            paper: "faster down than up",
            measured: vertical_speeds(record),
            why: "the paper puts the difference down to buoyancy, of which it gives no figure",
        },
    ]
}

fn surface(tracking: &Both) -> Vec<Stated> {
    vec![
        Stated {
            figure: 8,
            quantity: "settled distance from the AUV (root mean square)",
            paper: "≈ 1 m",
            measured: settled(tracking),
            why: "the paper does not say what limits it; here the thrusters' drag feed-forward is on and the law \
                  is tuned for the scenario",
        },
        Stated {
            figure: 9,
            quantity: "largest along-track overshoot past the AUV",
            paper: "visible, not stated",
            measured: each(tracking, |record| {
                metres(
                    offsets(record)
                        .iter()
                        .map(|offset| offset.along)
                        .fold(0.0, f64::max),
                )
            }),
            why: "a craft that arrives faster than it can slow down runs past; here the law is tuned, and the planner knows how the craft brakes",
        },
        Stated {
            figure: 10,
            quantity: "settled mean surge of the surface craft",
            paper: "a little above the AUV's",
            measured: format!(
                "{}; AUV {} along its body, {} over ground",
                each(tracking, surge_of_surface_craft),
                mean(&tracking.planner, |auv| auv.surge),
                ground_speed(&tracking.planner)
            ),
            why: "the AUV covers u cosθ of ground, and a craft that stays above it is no faster than that",
        },
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

/// Times between changes of the AUV that the goal is upon, the last and unfinished one left out.
fn dwells(record: &Record) -> String {
    let nearest = |goal: Vector2<f64>, auvs: &[AuvRow]| {
        let distance = |i: &usize| (auvs[*i].position - goal).norm();
        (0..auvs.len()).min_by(|a, b| distance(a).total_cmp(&distance(b)))
    };
    let mut since = None;
    let mut dwells: Vec<f64> = vec![];
    for row in &record.rows {
        let Some(craft) = &row.surface_craft else { continue };
        let upon = nearest(craft.goal, &row.auvs);
        match since {
            Some((start, before)) if before != upon => {
                dwells.push(row.time - start);
                since = Some((row.time, upon));
            }
            Some(_) => {}
            None => since = Some((row.time, upon)),
        }
    }
    let (least, most) = (
        dwells.iter().copied().fold(f64::INFINITY, f64::min),
        dwells.iter().copied().fold(f64::NEG_INFINITY, f64::max),
    );
    match dwells.len() {
        0 => missing(),
        n if least == most => format!("{least:.0} s, {n} times"),
        n => format!("{least:.0} s to {most:.0} s, {n} times"),
    }
}

/// Mean rates of change of depth over the rows in which it grows, and over those in which it falls.
fn vertical_speeds(record: &Record) -> String {
    let depths = settled_auvs(record).map(|auv| auv.depth).collect::<Vec<_>>();
    let rates = || depths.windows(2).map(|two| (two[1] - two[0]) / record.interval);
    let down = average(rates().filter(|rate| 0.0 < *rate));
    let up = average(rates().filter(|rate| *rate < 0.0).map(f64::abs));
    format!("{} down, {} up", speed(down), speed(up))
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
