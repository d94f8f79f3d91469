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

use crate::command::{json, line, printed};
use crate::docs::{Page, none, pages, root};

const BEGIN: &str = "<!-- figures\n";
const END: &str = "<!-- end -->";

/// Figures are rounded to this many digits, and to whole numbers at most.
const DIGITS: i32 = 3;

/// A block of a page.
struct Block<'a> {
    /// From the end of the comment to the end of the block.
    written: &'a str,
    /// The two lines above the rows.
    head: Vec<&'a str>,
    rows: Vec<&'a str>,
    /// The rows that the commands give.
    given: Vec<String>,
}

/// The blocks of a page. `is_wanted` gets `true` for slow commands; rows of unwanted commands stay.
fn blocks<'a>(page: &'a Page, answers: &mut Answers, is_wanted: fn(bool) -> bool) -> Vec<Block<'a>> {
    let is_row = |line: &&str| line.starts_with('|');
    let mut block = |text: &'a str| {
        let (comment, rest) = text.split_once("-->\n").expect("the comment ends");
        let (written, _) = rest.split_once(END).expect("the block ends");
        let mut head: Vec<_> = written.lines().filter(is_row).collect();
        let rows = head.split_off(head.len().min(2));
        let mut given = vec![];
        for line in comment.lines() {
            let slow = line.strip_prefix("slow: ");
            let Some(command) = slow.unwrap_or(line).strip_prefix("pilotfish ") else {
                continue;
            };
            for template in comment.lines().filter(is_row) {
                let kept = rows.get(given.len()).filter(|_| !is_wanted(slow.is_some()));
                let kept = kept.map(|row| (*row).to_owned());
                given.push(kept.unwrap_or_else(|| filled(template, answers.get(command))));
            }
        }
        Block { written, head, rows, given }
    };
    page.text.split(BEGIN).skip(1).map(&mut block).collect()
}

/// The faults of a page's blocks.
fn faults(page: &Page, answers: &mut Answers, is_wanted: fn(bool) -> bool) -> Vec<String> {
    let blocks = blocks(page, answers, is_wanted).into_iter();
    let fault = |Block { rows, given, .. }: Block| {
        let (shown, now) = (rows.join("\n"), given.join("\n"));
        format!("{shown}\nis now\n{now}\n(just figures-in-docs)")
    };
    blocks.filter(|block| block.rows != block.given).map(fault).collect()
}

/// The page with the rows of its blocks written anew.
fn rewritten(page: &Page, answers: &mut Answers) -> String {
    let day = Command::new("date").args(["-u", "+%F"]).output();
    let day = printed(&day.expect("there is a clock"));
    let stamp = format!("*Version {}, {}.*", env!("CARGO_PKG_VERSION"), day.trim());
    blocks(page, answers, |_| true).into_iter().fold(page.text.clone(), |text, block| {
        let (head, rows) = (block.head.join("\n"), block.given.join("\n"));
        text.replace(block.written, &format!("{head}\n{rows}\n\n{stamp}\n"))
    })
}

/// The output of a command, once for all blocks.
#[derive(Default)]
struct Answers(HashMap<String, Value>);

impl Answers {
    fn get(&mut self, command: &str) -> &Value {
        let answer = || json(&printed(&line(command)));
        self.0.entry(command.to_owned()).or_insert_with(answer)
    }
}

/// A template with the figures of an answer.
fn filled(template: &str, answer: &Value) -> String {
    let controllers = answer["controllers"].as_object().expect("has controllers");
    let laws = controllers.iter().filter(|(name, _)| *name != "mpc");
    let rms = |law: &Value| law["rms_m"].as_f64().unwrap_or(f64::INFINITY);
    let best = laws.min_by(|(_, a), (_, b)| rms(a).total_cmp(&rms(b)));
    let best = best.map_or("", |(name, _)| name.as_str());
    let mut text = String::new();
    let mut rest = template;
    while let Some((before, (name, after))) =
        rest.split_once('{').and_then(|(before, rest)| Some((before, rest.split_once('}')?)))
    {
        text += before;
        rest = after;
        let (controller, path) = name.split_once('/').unwrap_or((name, ""));
        let controller = if controller == "best" { best } else { controller };
        let value = controllers.get(controller);
        let value = value.and_then(|scores| scores.pointer(&format!("/{path}")));
        match (name, value) {
            ("scenario", _) => text += answer["scenario"].as_str().unwrap_or_default(),
            ("best", _) => text += best,
            (_, value) => text += &figure(value.and_then(Value::as_f64).expect(name)),
        }
    }
    text + rest
}

fn figure(value: f64) -> String {
    #[expect(clippy::cast_possible_truncation, reason = "the logarithm of a double is below 400")]
    let before_the_point = if value == 0.0 { DIGITS } else { value.abs().log10().floor() as i32 + 1 };
    let decimals = usize::try_from(DIGITS - before_the_point).unwrap_or(0);
    format!("{value:.decimals$}")
}

mod slow {
    use super::*;

    #[test]
    fn the_figures_of_the_pages_are_those_of_their_commands() {
        let mut answers = Answers::default();
        none(|page| faults(page, &mut answers, |slow| !slow));
    }

    /// With `UPDATE_DOCS`, all are written.
    #[test]
    fn the_slow_figures_too() {
        let mut answers = Answers::default();
        if env::var_os("UPDATE_DOCS").is_none() {
            return none(|page| faults(page, &mut answers, |slow| slow));
        }
        for page in pages() {
            let text = rewritten(&page, &mut answers);
            fs::write(root().join(&page.name), text).expect("the page can be written");
        }
    }
}
