//! The section about craft that the planner was not tuned for, and its rows.

use std::{borrow::Cow, io::Write};

use crate::{
    bench::{
        statistics::quantile,
        strangers::{
            Breakdown, CHECKPOINTS, Estimates, FAULT_MISSIONS, FaultTrial, Flight, Knowledge, Learnt,
            StrangerFlights, StrangersBoard,
        },
    },
    strangers::{Stranger, StrangerMission},
};

use super::{Block, Provenance, Table};
use record::{
    ExportError,
    parquet::{Column, Table as Columns, Values, write_table},
};

/// How many of the worst flights are named.
const NAMED: usize = 10;

const MADE: &str = "Surface craft drawn at random: hull, thrusters and autopilot, each tested in steps first. Each flies six \
    missions. Beside the planner stands the best-tuned law: of `saturated_los` and `tracker_frame` at 25 gains \
    each, the one with the least RMS distance on a tuning seed of that craft and mission, then flown on the seed that is \
    scored. Declared is the planner that gets the response which step tests found, and the limits; undeclared the one that \
    gets the least and the largest speed and nothing else, not even what the loops hold. The laws know what the \
    loops hold, as the planner does where it is declared. All know the current where the scenario grants it. Ratios are paired: \
    the same craft, mission and seed.";

const CALM: &str = "Steps are the seconds, in %, at whose end the heading reference steps by more than the craft turns in one \
    second: mean / worst. Variation is the sum of all changes of a reference after 120 s, beside that of the best-tuned law: \
    median / 90 %. The law's heading reference hardly changes where its goal stands still.";

const ESTIMATES: &str = "What the planner makes of its craft, beside step tests. An estimate is informed where its standard deviation \
    is less than half of what it began with. The error is relative for lags, in s for sway per surge and yaw rate: \
    median / 90 %. The interval is ± 1.96 standard deviations and should hold the truth in 95 %.";

const ALARMS: &str =
    "`craft_does_not_follow` in the missions above, where nothing breaks: all of these alarms are false.";

const FAULTS: &str = "Something breaks 300 s into a mission of 600 s, on a MEDUSA, an Otter and ten random craft. Times \
    are from there to the alarm: median / longest, of those that raise one anew. A rudder that is stuck gives 10/35 of \
    the largest yaw moment, whatever is asked for.";

/// The section.
pub(super) fn strangers(board: &StrangersBoard) -> Vec<Block> {
    let seed = |craft: Option<&Stranger>| craft.map_or(0, |craft| craft.seed);
    let (first, last) = (seed(board.crafts.first()), seed(board.crafts.last()));
    let duration = board
        .flights
        .first()
        .map_or(0.0, |flights| flights.law.duration_s);
    let mut blocks = vec![
        Block::Heading(2, "Strangers".to_owned()),
        Block::Paragraph(format!("{MADE} Craft {first} to {last}, {duration:.0} s each.")),
        Block::Table(nearness(board)),
        Block::Paragraph(CALM.to_owned()),
        Block::Table(calmness(board)),
        Block::Heading(3, "Worst flights".to_owned()),
    ];
    for knowledge in Knowledge::ALL {
        let of = match knowledge {
            Knowledge::Declared => "The planner with its craft declared, over the whole mission.",
            Knowledge::Undeclared => "The planner with nothing declared, after 120 s.",
        };
        blocks.push(Block::Paragraph(of.to_owned()));
        blocks.push(Block::Table(worst(board, knowledge)));
    }
    blocks.extend([
        Block::Heading(3, "Learning the craft".to_owned()),
        Block::Paragraph(ESTIMATES.to_owned()),
        Block::Table(estimates(board)),
        Block::Heading(3, "Noticing that it does not follow".to_owned()),
        Block::Paragraph(ALARMS.to_owned()),
        Block::Table(alarms(board)),
    ]);
    if !board.faults.is_empty() {
        blocks.push(Block::Paragraph(FAULTS.to_owned()));
        blocks.push(Block::Table(faults(board)));
    }
    blocks
}

/// Every mission, and then all of them.
fn missions(board: &StrangersBoard) -> Vec<(&'static str, Vec<&StrangerFlights>)> {
    let of = |mission: Option<StrangerMission>| {
        let flights = board.flights.iter();
        flights
            .filter(|flights| mission.is_none_or(|mission| mission == flights.mission))
            .collect()
    };
    let each = StrangerMission::ALL.map(|mission| (mission.name(), of(Some(mission))));
    each.into_iter().chain([("all", of(None))]).collect()
}

/// Values of which there are any, for quantiles.
fn finite(values: impl Iterator<Item = f64>) -> Vec<f64> {
    values.filter(|value| value.is_finite()).collect()
}

fn spread(values: &[f64], shares: &[f64]) -> String {
    let texts: Option<Vec<String>> = shares
        .iter()
        .map(|share| quantile(values, *share).map(|value| format!("{value:.2}")))
        .collect();
    texts.map_or(String::new(), |texts| texts.join(" / "))
}

/// The planner's value beside the law's, flight by flight; without those where the law's is nothing.
fn ratios(flights: &[&StrangerFlights], knowledge: Knowledge, of: fn(&Flight) -> f64) -> Vec<f64> {
    /// In units of any metric: m, J, m/s, rad.
    const NOTHING: f64 = 1e-3;
    let some = flights.iter().filter(|flights| NOTHING < of(&flights.law));
    finite(some.map(|flights| of(flights.planner(knowledge)) / of(&flights.law)))
}

fn nearness(board: &StrangersBoard) -> Table {
    let mut table = Table::new(
        1,
        &[
            "mission",
            "declared: RMS, median / 90 % / worst",
            "undeclared",
            "declared, after 120 s",
            "undeclared, after 120 s",
            "declared: energy, median / 90 %",
            "undeclared",
            "declared: seconds by program / previous plan / law / hold, %",
            "undeclared",
        ],
    );
    let three = [0.5, 0.9, 1.0];
    for (name, flights) in missions(board) {
        let mut row = vec![name.to_owned()];
        for of in [(|flight| flight.rms_m) as fn(&Flight) -> f64, |flight| {
            flight.late_rms_m
        }] {
            row.extend(Knowledge::ALL.map(|knowledge| spread(&ratios(&flights, knowledge, of), &three)));
        }
        row.extend(Knowledge::ALL.map(|knowledge| {
            let energies = ratios(&flights, knowledge, |flight| flight.energy_j);
            spread(&energies, &three[..2])
        }));
        row.extend(Knowledge::ALL.map(|knowledge| answered(&flights, knowledge)));
        table.rows.push(row);
    }
    table
}

fn answered(flights: &[&StrangerFlights], knowledge: Knowledge) -> String {
    let shares = [0, 1, 2, 3].map(|k| {
        let share = |flights: &&StrangerFlights| flights.planner(knowledge).answered[k];
        let sum: f64 = flights.iter().map(share).sum();
        format!("{:.1}", 100.0 * sum / count(flights.len()))
    });
    shares.join(" / ")
}

fn calmness(board: &StrangersBoard) -> Table {
    let mut table = Table::new(
        1,
        &[
            "mission",
            "steps: law",
            "declared",
            "undeclared",
            "speed variation: declared",
            "undeclared",
            "heading variation: declared",
            "undeclared",
        ],
    );
    for (name, flights) in missions(board) {
        let steps = |of: &dyn Fn(&StrangerFlights) -> &Flight| {
            let shares = finite(flights.iter().map(|flights| 100.0 * of(flights).steep_share));
            let mean = shares.iter().sum::<f64>() / count(shares.len());
            format!("{mean:.2} / {}", spread(&shares, &[1.0]))
        };
        let mut row = vec![
            name.to_owned(),
            steps(&|flights| &flights.law),
            steps(&|flights| &flights.declared),
            steps(&|flights| &flights.undeclared),
        ];
        for of in [
            (|flight| flight.speed_variation_mps) as fn(&Flight) -> f64,
            |flight| flight.heading_variation_rad,
        ] {
            row.extend(Knowledge::ALL.map(|knowledge| spread(&ratios(&flights, knowledge, of), &[0.5, 0.9])));
        }
        table.rows.push(row);
    }
    table
}

/// The flights of the largest ratios of RMS distance; of a planner with nothing declared after the first 120 s.
fn worst(board: &StrangersBoard, knowledge: Knowledge) -> Table {
    let mut table = Table::new(
        2,
        &[
            "mission",
            "law",
            "craft",
            "× law",
            "RMS, m",
            "law, m",
            "program, %",
            "alarm, s",
            "heading loop",
            "lag, s",
            "delay, s",
            "turn, rad/s",
            "surge lag, s",
            "m/s²",
            "holds",
        ],
    );
    let rms = |flight: &Flight| match knowledge {
        Knowledge::Declared => flight.rms_m,
        Knowledge::Undeclared => flight.late_rms_m,
    };
    let ratio = |flights: &StrangerFlights| rms(flights.planner(knowledge)) / rms(&flights.law);
    let mut flights: Vec<&StrangerFlights> = board.flights.iter().collect();
    flights.retain(|flights| ratio(flights).is_finite());
    flights.sort_by(|a, b| ratio(b).total_cmp(&ratio(a)));
    for flights in flights.into_iter().take(NAMED) {
        let Some(stranger) = board.craft(flights.craft) else {
            continue;
        };
        let planner = flights.planner(knowledge);
        let craft = &stranger.craft.tested.craft;
        table.rows.push(vec![
            flights.mission.name().to_owned(),
            format!(
                "{} {} / {}",
                flights.nearest.law.name(),
                flights.nearest.gains.look_ahead,
                flights.nearest.gains.along_track_gain
            ),
            flights.craft.to_string(),
            format!("{:.2}", ratio(flights)),
            format!("{:.2}", rms(planner)),
            format!("{:.2}", rms(&flights.law)),
            format!("{:.0}", 100.0 * planner.answered[0]),
            format!("{:.0}", planner.alarm_s),
            format!("{:?}", stranger.craft.traits.heading_loop),
            format!("{:.1}", craft.heading.lag()),
            format!("{:.1}", craft.heading.delay),
            format!("{:.2}", craft.heading.rate_max),
            format!("{:.1}", craft.surge.lag()),
            format!("{:.2}", craft.surge.acceleration_max),
            format!("{:?}, {:?}", craft.speed_held, craft.heading_held),
        ]);
    }
    table
}

type Parameter = (&'static str, fn(&Estimates) -> Learnt, bool);

/// What is estimated, and whether its error is relative.
const PARAMETERS: [Parameter; 3] = [
    ("heading lag", |estimates| estimates.heading_lag, true),
    ("surge lag", |estimates| estimates.surge_lag, true),
    ("sway per yaw rate", |estimates| estimates.drift, false),
];

fn error(learnt: &Learnt, relative: bool) -> f64 {
    let error = (learnt.value - learnt.truth).abs();
    if relative { error / learnt.truth } else { error }
}

fn estimates(board: &StrangersBoard) -> Table {
    let mut table = Table::new(
        2,
        &[
            "planner",
            "of",
            "after, s",
            "error",
            "interval holds, %",
            "informed, %",
            "error there",
            "interval holds there, %",
        ],
    );
    for knowledge in Knowledge::ALL {
        for (name, of, relative) in PARAMETERS {
            for (k, at) in CHECKPOINTS.into_iter().enumerate() {
                let flights = board.flights.iter();
                let all: Vec<Learnt> = flights
                    .filter_map(|flights| Some(of(&flights.planner(knowledge).estimates.as_ref()?[k])))
                    .collect();
                let informed: Vec<Learnt> = all.iter().filter(|learnt| learnt.excited).copied().collect();
                let errors = |those: &[Learnt]| {
                    let errors = finite(those.iter().map(|learnt| error(learnt, relative)));
                    spread(&errors, &[0.5, 0.9])
                };
                table.rows.push(vec![
                    knowledge.name().to_owned(),
                    name.to_owned(),
                    format!("{at:.0}"),
                    errors(&all),
                    percent(&all, Learnt::covers),
                    percent(&all, |learnt| learnt.excited),
                    errors(&informed),
                    percent(&informed, Learnt::covers),
                ]);
            }
        }
    }
    table
}

/// Of how many, in %; nothing where there are none.
fn percent<T>(all: &[T], are: impl Fn(&T) -> bool) -> String {
    if all.is_empty() {
        return String::new();
    }
    let those = all.iter().filter(|one| are(one)).count();
    format!("{:.0}", 100.0 * count(those) / count(all.len()))
}

fn alarms(board: &StrangersBoard) -> Table {
    let mut table = Table::new(
        1,
        &[
            "planner",
            "flown, h",
            "alarms",
            "alarms per hour",
            "of the time, %",
            "flights with an alarm",
        ],
    );
    for knowledge in Knowledge::ALL {
        let flights: Vec<&Flight> = board
            .flights
            .iter()
            .map(|flights| flights.planner(knowledge))
            .collect();
        let flown: f64 = flights.iter().map(|flight| flight.duration_s).sum();
        let alarmed: f64 = flights.iter().map(|flight| flight.alarm_s).sum();
        let onsets: usize = flights.iter().map(|flight| flight.alarms_at_s.len()).sum();
        let hours = flown / 3600.0;
        table.rows.push(vec![
            knowledge.name().to_owned(),
            format!("{hours:.1}"),
            onsets.to_string(),
            format!("{:.2}", count(onsets) / hours),
            format!("{:.1}", 100.0 * alarmed / flown),
            flights
                .iter()
                .filter(|flight| 0.0 < flight.alarm_s)
                .count()
                .to_string(),
        ]);
    }
    table
}

fn faults(board: &StrangersBoard) -> Table {
    let mut table = Table::new(
        3,
        &[
            "what breaks",
            "mission",
            "planner",
            "craft",
            "alarm already",
            "alarm anew",
            "after, s",
            "MEDUSA, s",
            "Otter, s",
        ],
    );
    for what in Breakdown::ALL {
        for mission in FAULT_MISSIONS {
            for knowledge in Knowledge::ALL {
                let trials: Vec<&FaultTrial> = board
                    .faults
                    .iter()
                    .filter(|trial| {
                        (trial.what, trial.mission, trial.knowledge) == (what, mission, knowledge)
                    })
                    .collect();
                let already = trials.iter().filter(|trial| trial.alarmed_already).count();
                let anew: Vec<f64> = trials
                    .iter()
                    .filter(|trial| !trial.alarmed_already)
                    .filter_map(|trial| trial.detected_after_s)
                    .collect();
                let class = |name: &str| {
                    let trial = trials.iter().find(|trial| trial.craft == name);
                    let after = trial.and_then(|trial| trial.detected_after_s);
                    after.map_or("–".to_owned(), |after| format!("{after:.0}"))
                };
                table.rows.push(vec![
                    what.name().to_owned(),
                    mission.name().to_owned(),
                    knowledge.name().to_owned(),
                    trials.len().to_string(),
                    already.to_string(),
                    anew.len().to_string(),
                    spread_seconds(&anew),
                    class("MEDUSA"),
                    class("Otter"),
                ]);
            }
        }
    }
    table
}

fn spread_seconds(times: &[f64]) -> String {
    match (quantile(times, 0.5), quantile(times, 1.0)) {
        (Some(median), Some(most)) => format!("{median:.0} / {most:.0}"),
        _ => String::new(),
    }
}

/// Writes a row for every flight: three for each craft and mission.
pub fn write_strangers(
    board: &StrangersBoard,
    provenance: &Provenance,
    out: &mut (impl Write + Send),
) -> Result<(), ExportError> {
    let rows: Vec<(&StrangerFlights, &'static str, &Flight)> = board
        .flights
        .iter()
        .flat_map(|flights| {
            [
                (flights, "law", &flights.law),
                (flights, Knowledge::Declared.name(), &flights.declared),
                (flights, Knowledge::Undeclared.name(), &flights.undeclared),
            ]
        })
        .collect();
    let words = |name: &str, of: &dyn Fn(&StrangerFlights, &'static str) -> String| Column {
        name: name.to_owned(),
        values: Values::Words(
            rows.iter()
                .map(|(flights, who, _)| Cow::Owned(of(flights, who)))
                .collect(),
        ),
    };
    let numbers = |name: &str, of: &dyn Fn(&StrangerFlights, &Flight) -> Option<f64>| Column {
        name: name.to_owned(),
        values: Values::Numbers(
            rows.iter()
                .map(|(flights, _, flight)| of(flights, flight))
                .collect(),
        ),
    };
    #[expect(clippy::cast_precision_loss, reason = "seeds count from 1")]
    let mut columns = vec![
        words("mission", &|flights, _| flights.mission.name().to_owned()),
        words("controller", &|_, who| who.to_owned()),
        words("law", &|flights, _| flights.nearest.law.name().to_owned()),
        numbers("craft", &|flights, _| Some(flights.craft as f64)),
        numbers("look_ahead_m", &|flights, _| {
            Some(flights.nearest.gains.look_ahead)
        }),
        numbers("along_track_gain_per_s", &|flights, _| {
            Some(flights.nearest.gains.along_track_gain)
        }),
    ];
    for (name, of) in FLIGHT {
        columns.push(numbers(name, &|_, flight| {
            Some(of(flight)).filter(|value| value.is_finite())
        }));
    }
    for (k, at) in CHECKPOINTS.into_iter().enumerate() {
        for (name, of, _) in PARAMETERS {
            let learnt = |flight: &Flight| flight.estimates.as_ref().map(|estimates| of(&estimates[k]));
            let name = format!("{}_{at:.0}_s", name.replace(' ', "_"));
            columns.push(numbers(&name, &|_, flight| Some(learnt(flight)?.value)));
            columns.push(numbers(&format!("{name}_sigma"), &|_, flight| {
                Some(learnt(flight)?.sigma)
            }));
            columns.push(numbers(&format!("{name}_truth"), &|_, flight| {
                Some(learnt(flight)?.truth)
            }));
            columns.push(numbers(&format!("{name}_informed"), &|_, flight| {
                Some(f64::from(u8::from(learnt(flight)?.excited)))
            }));
        }
    }
    write_table(
        &Columns {
            name: "strangers",
            columns,
            about: about(provenance),
        },
        out,
    )
}

type Number = (&'static str, fn(&Flight) -> f64);

const FLIGHT: [Number; 13] = [
    ("rms_m", |flight| flight.rms_m),
    ("rms_after_120_s_m", |flight| flight.late_rms_m),
    ("energy_j", |flight| flight.energy_j),
    ("steps_beyond_turn_percent", |flight| 100.0 * flight.steep_share),
    ("speed_variation_after_120_s_mps", |flight| {
        flight.speed_variation_mps
    }),
    ("heading_variation_after_120_s_rad", |flight| {
        flight.heading_variation_rad
    }),
    ("answered_mpc", |flight| flight.answered[0]),
    ("answered_previous_plan", |flight| flight.answered[1]),
    ("answered_law", |flight| flight.answered[2]),
    ("answered_hold", |flight| flight.answered[3]),
    ("duration_s", |flight| flight.duration_s),
    ("alarm_s", |flight| flight.alarm_s),
    ("alarms", |flight| count(flight.alarms_at_s.len())),
];

/// Writes a row for every breakdown.
pub fn write_breakdowns(
    board: &StrangersBoard,
    provenance: &Provenance,
    out: &mut (impl Write + Send),
) -> Result<(), ExportError> {
    let words = |name: &str, of: fn(&FaultTrial) -> String| Column {
        name: name.to_owned(),
        values: Values::Words(board.faults.iter().map(|trial| Cow::Owned(of(trial))).collect()),
    };
    let numbers = |name: &str, of: fn(&FaultTrial) -> Option<f64>| Column {
        name: name.to_owned(),
        values: Values::Numbers(board.faults.iter().map(of).collect()),
    };
    let columns = vec![
        words("craft", |trial| trial.craft.clone()),
        words("mission", |trial| trial.mission.name().to_owned()),
        words("what_breaks", |trial| trial.what.name().to_owned()),
        words("planner", |trial| trial.knowledge.name().to_owned()),
        numbers("alarms_before", |trial| Some(count(trial.alarms_before))),
        numbers("alarm_already", |trial| {
            Some(f64::from(u8::from(trial.alarmed_already)))
        }),
        numbers("alarm_after_s", |trial| trial.detected_after_s),
        numbers("rms_m", |trial| Some(trial.rms_m)),
    ];
    write_table(
        &Columns {
            name: "breakdowns",
            columns,
            about: about(provenance),
        },
        out,
    )
}

fn about(provenance: &Provenance) -> Vec<(&'static str, String)> {
    vec![
        ("schema_version", "1".to_owned()),
        ("command", provenance.command.clone()),
        ("commit", provenance.commit.clone().unwrap_or_default()),
    ]
}

#[expect(clippy::cast_precision_loss, reason = "thousands of flights, not 2⁵³")]
fn count(n: usize) -> f64 {
    n as f64
}
