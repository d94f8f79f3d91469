//! The figures of the documentation are those that the commands beside them print.
//!
//! ```text
//! <!-- figures
//! pilotfish compare paper-tracking --seed 1 --format json
//! slow: pilotfish compare crowded --seed 1 --format json
//! | `{scenario}` | {mpc/rms_m} | {best/rms_m} |
//! -->
//! | mission | planner, m | line of sight, m |
//! |---|---:|---:|
//! | `paper-tracking` | 1.08 | 1.06 |
//! | `crowded` | 11.9 | 20.8 |
//!
//! *Version 0.2.0, 2026-11-27.*
//! <!-- end -->
//! ```
//!
//! Each command gives the lines that begin with `|`, with numbers of its answer in the braces.
//! `best` is the law with the least `rms_m`. `just figures-in-docs` writes the rows; tests compare
//! them.

use std::{collections::HashMap, env, fs, process::Command};

use serde_json::Value;

use crate::docs::{Page, none, pages, root};

const BEGIN: &str = "<!-- figures\n";
const END: &str = "<!-- end -->";

/// Figures are rounded to this many digits, and to whole numbers at most.
const DIGITS: i32 = 3;

struct Block<'a> {
    /// The arguments of `pilotfish`, and `true` for slow ones.
    commands: Vec<(&'a str, bool)>,
    templates: Vec<&'a str>,
    /// The two lines above the rows.
    head: Vec<&'a str>,
    rows: Vec<&'a str>,
    /// From the end of the comment to the end of the block.
    written: &'a str,
}

impl<'a> Block<'a> {
    /// The text from behind its beginning.
    fn read(text: &'a str) -> Option<Self> {
        let (comment, rest) = text.split_once("-->\n")?;
        let written = rest.split_once(END)?.0;
        let mut commands = vec![];
        for line in comment.lines() {
            let command = |line: &'a str| line.strip_prefix("pilotfish ");
            let slow = line.strip_prefix("slow: ").and_then(command);
            commands.extend(slow.or(command(line)).map(|command| (command, slow.is_some())));
        }
        let is_row = |line: &&str| line.starts_with('|');
        let mut head: Vec<_> = written.lines().filter(is_row).collect();
        let rows = head.split_off(head.len().min(2));
        Some(Self {
            commands,
            templates: comment.lines().filter(is_row).collect(),
            head,
            rows,
            written,
        })
    }
}

/// The output of a command, once for all blocks.
#[derive(Default)]
struct Answers(HashMap<String, Value>);

impl Answers {
    fn get(&mut self, command: &str) -> &Value {
        self.0.entry(command.to_owned()).or_insert_with(|| {
            let output = Command::new(env!("CARGO_BIN_EXE_pilotfish"))
                .args(command.split_whitespace())
                .output()
                .expect("the program starts");
            let errors = String::from_utf8_lossy(&output.stderr);
            assert!(output.status.success(), "{command}: {errors}");
            serde_json::from_slice(&output.stdout).expect("prints JSON")
        })
    }
}

/// A template with the figures of an answer, or the name that the answer lacks.
fn filled(template: &str, answer: &Value) -> Result<String, String> {
    let controllers = answer["controllers"].as_object().ok_or("no controllers")?;
    let laws = controllers.iter().filter(|(name, _)| *name != "mpc");
    let best = laws
        .min_by(|a, b| {
            a.1["rms_m"]
                .as_f64()
                .partial_cmp(&b.1["rms_m"].as_f64())
                .expect("both are finite")
        })
        .map_or("", |(name, _)| name.as_str());
    let mut text = String::new();
    let mut rest = template;
    while let Some((before, (name, after))) = rest
        .split_once('{')
        .and_then(|(before, rest)| Some((before, rest.split_once('}')?)))
    {
        text += before;
        rest = after;
        let (controller, path) = name.split_once('/').unwrap_or((name, ""));
        let controller = if controller == "best" { best } else { controller };
        match (
            name,
            &answer["controllers"][controller].pointer(&format!("/{path}")),
        ) {
            ("scenario", _) => text += answer["scenario"].as_str().unwrap_or_default(),
            ("best", _) => text += best,
            (_, Some(value)) => text += &figure(value.as_f64().ok_or(name)?),
            (_, None) => return Err(name.to_owned()),
        }
    }
    Ok(text + rest)
}

fn figure(value: f64) -> String {
    #[expect(
        clippy::cast_possible_truncation,
        reason = "the logarithm of a double is below 400"
    )]
    let before_the_point = if value == 0.0 {
        DIGITS
    } else {
        value.abs().log10().floor() as i32 + 1
    };
    let decimals = usize::try_from(DIGITS - before_the_point).unwrap_or(0);
    format!("{value:.decimals$}")
}

/// The rows of the commands, `None` for unwanted ones: `is_wanted` gets `true` for slow commands.
fn rows(
    block: &Block,
    answers: &mut Answers,
    is_wanted: fn(bool) -> bool,
) -> Result<Vec<Option<String>>, String> {
    let mut rows = vec![];
    for (command, slow) in &block.commands {
        for template in &block.templates {
            let row = is_wanted(*slow).then(|| filled(template, answers.get(command)));
            rows.push(row.transpose()?);
        }
    }
    Ok(rows)
}

/// The faults of a page's blocks.
fn faults(page: &Page, answers: &mut Answers, is_wanted: fn(bool) -> bool) -> Vec<String> {
    let mut faults = vec![];
    for text in page.text.split(BEGIN).skip(1) {
        let Some(block) = Block::read(text) else {
            faults.push("a block of figures does not end".to_owned());
            continue;
        };
        match rows(&block, answers, is_wanted) {
            Err(name) => faults.push(format!("no answer has the figure {name}")),
            Ok(rows) if rows.len() != block.rows.len() => {
                faults.push(format!(
                    "{} rows, the commands give {}",
                    block.rows.len(),
                    rows.len()
                ));
            }
            Ok(rows) => faults.extend(
                (block.rows.iter().zip(rows))
                    .filter_map(|(shown, row)| Some((shown, row.filter(|row| row != shown)?)))
                    .map(|(shown, row)| format!("{shown}\nis now\n{row}\n(just figures-in-docs)")),
            ),
        }
    }
    faults
}

/// The page with the rows of its blocks written anew.
fn rewritten(page: &Page, answers: &mut Answers) -> String {
    let day = Command::new("date")
        .args(["-u", "+%F"])
        .output()
        .expect("there is a clock")
        .stdout;
    let day = String::from_utf8(day).expect("is a date");
    let stamp = format!("*Version {}, {}.*", env!("CARGO_PKG_VERSION"), day.trim());
    let mut text = page.text.clone();
    for found in page.text.split(BEGIN).skip(1) {
        let block = Block::read(found).expect("a block of figures ends");
        let rows = rows(&block, answers, |_| true).expect("an answer has all figures");
        let mut lines: Vec<_> = block.head.iter().map(|line| (*line).to_owned()).collect();
        lines.extend(rows.into_iter().flatten());
        text = text.replace(block.written, &format!("{}\n\n{stamp}\n", lines.join("\n")));
    }
    text
}

#[track_caller]
fn compare(is_wanted: fn(bool) -> bool) {
    let pages = pages();
    let mut answers = Answers::default();
    let mut found = vec![];
    for page in &pages {
        let faults = faults(page, &mut answers, is_wanted);
        found.extend(faults.into_iter().map(|fault| (page, fault)));
    }
    none(&found);
}

#[test]
fn figures_that_no_command_gives_and_stale_ones_are_found() {
    let answer = serde_json::json!({"scenario": "calm", "controllers": {
        "mpc": {"rms_m": 0.0123}, "waypoint_box": {"rms_m": 50.26}, "integral_los": {"rms_m": 1.006, "energy_j": 1294.2}}});
    let fill = |template: &str| filled(template, &answer);
    assert_eq!(
        fill("{scenario} {best} {best/energy_j}"),
        Ok("calm integral_los 1294".to_owned())
    );
    assert_eq!(
        fill("{mpc/rms_m} {waypoint_box/rms_m}"),
        Ok("0.0123 50.3".to_owned())
    );
    assert_eq!(fill("{best/rms_m}"), Ok("1.01".to_owned()));
    assert_eq!(fill("{mpc/energy_j}"), Err("mpc/energy_j".to_owned()));

    let mut answers = Answers(HashMap::from([("compare calm".to_owned(), answer)]));
    let mut found = |rows: &str, template: &str| {
        let comment = format!("pilotfish compare calm\n| {template} |\n-->\n");
        let page = Page {
            name: "page".to_owned(),
            text: format!("{BEGIN}{comment}| m |\n|---|\n{rows}\n{END}\n"),
        };
        faults(&page, &mut answers, |slow| !slow).len()
    };
    assert_eq!(found("| 0.0123 |\n", "{mpc/rms_m}"), 0);
    assert_eq!(found("| 0.0122 |\n", "{mpc/rms_m}"), 1);
    assert_eq!(found("", "{mpc/rms_m}"), 1);
    assert_eq!(found("| 0.0123 |\n", "{mpc/mean_m}"), 1);
}

mod slow {
    use super::*;

    #[test]
    fn the_figures_of_the_pages_are_those_of_their_commands() {
        compare(|slow| !slow);
    }

    /// With `UPDATE_DOCS`, all are written.
    #[test]
    fn the_slow_figures_too() {
        if env::var_os("UPDATE_DOCS").is_none() {
            compare(|slow| slow);
            return;
        }
        let mut answers = Answers::default();
        for page in pages() {
            let text = rewritten(&page, &mut answers);
            fs::write(root().join(&page.name), text).expect("the page can be written");
        }
    }
}
