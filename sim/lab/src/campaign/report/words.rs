//! Formats of numbers in a report.

use crate::campaign::statistics::Wins;

/// For an unknown value.
pub(super) const NONE: &str = "–";

pub(super) fn interval(bounds: Option<[f64; 2]>) -> String {
    bounds.map_or(String::new(), |[low, high]| {
        format!("[{}, {}]", number(low), number(high))
    })
}

pub(super) fn wins(wins: Wins) -> String {
    let [low, high] = wins.wilson_95.map(|share| format!("{:.0}", 100.0 * share));
    format!("{:.0} % [{low}, {high}]", 100.0 * wins.share)
}

pub(super) fn probability(p: Option<f64>) -> String {
    match p {
        None => NONE.to_owned(),
        Some(p) if p < 1e-4 => "< 0.0001".to_owned(),
        Some(p) => format!("{p:.4}"),
    }
}

pub(super) fn percent(share: f64) -> String {
    format!("{:.2} %", 100.0 * share)
}

/// About three digits.
pub(super) fn number(value: f64) -> String {
    let decimals = match value.abs() {
        size if size < 1.0 => 3,
        size if size < 10.0 => 2,
        size if size < 100.0 => 1,
        size if size < 1e6 => 0,
        _ => return signed(&format!("{value:.2e}")),
    };
    signed(&format!("{value:.decimals$}"))
}

/// A number that may be unknown.
pub(super) fn optional(value: Option<f64>) -> String {
    value.map_or(NONE.to_owned(), number)
}

/// A whole number, with a space between thousands.
pub(super) fn integer<T: ToString + Copy>(value: T) -> String {
    let digits = value.to_string();
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if 0 < i && (digits.len() - i).is_multiple_of(3) {
            text.push('\u{202f}');
        }
        text.push(digit);
    }
    text
}

pub(super) fn signed(digits: &str) -> String {
    // No minus sign before zero.
    let nought = digits.chars().all(|c| matches!(c, '-' | '0' | '.'));
    digits.replace('-', if nought { "" } else { "−" })
}

pub(super) fn code(words: &str) -> String {
    format!("`{words}`")
}

pub(super) fn bold(words: &str, is_bold: bool) -> String {
    if is_bold {
        format!("**{words}**")
    } else {
        words.to_owned()
    }
}

pub(super) fn or_none(words: String) -> String {
    if words.is_empty() { NONE.to_owned() } else { words }
}
