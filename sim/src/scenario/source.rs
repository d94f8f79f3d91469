//! The text of a scenario file: line numbers for errors, and errors about wrong forms.

use std::ops::Range;

use serde_json::Value;
use toml::{
    Spanned,
    de::{DeTable, DeValue},
};

use super::{InvalidScenario, ScenarioError};

/// Largest number of characters that an error quotes.
const QUOTED_MAX: usize = 60;

/// The text that a scenario was read from, for errors.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Source {
    /// Name of the file.
    pub file: String,
    /// The text.
    pub text: String,
    /// The values in it.
    pub(super) tree: Value,
}

impl Source {
    /// The error of a file that is not TOML.
    pub(super) fn unreadable(&self, error: &toml::de::Error) -> ScenarioError {
        let field = "syntax".to_owned();
        let reason = error.message().to_owned();
        let line = error.span().map_or(1, |span| line_of(&self.text, span.start));
        self.invalid(line, InvalidScenario { field, reason })
    }

    /// The error of a file that cannot be read as a scenario because of one of its members.
    pub(super) fn refused(&self, wrong: InvalidScenario) -> ScenarioError {
        match misshapen(&self.text, &wrong.field) {
            Some((line, misshapen)) => self.invalid(line, misshapen),
            None => self.wrong(wrong),
        }
    }

    /// The error of a scenario whose members do not fit together.
    pub(super) fn wrong(&self, wrong: InvalidScenario) -> ScenarioError {
        self.invalid(line_of_field(&self.text, &wrong.field), wrong)
    }

    fn invalid(&self, line: usize, wrong: InvalidScenario) -> ScenarioError {
        ScenarioError::Invalid(self.file.clone(), line, wrong)
    }
}

enum Shape {
    Text,
    WholeNumber,
    Table,
    /// A table with its kind as the only key. Another kind is refused as it is read.
    Kind,
    /// A table with one of these as its only key, or one of these as text.
    OneOf(&'static [&'static str]),
}

/// Members that often get another form, as `auvs[].path`: shape, and an example for the error.
const FORMS: &[(&str, Shape, &str)] = &[
    ("schema_version", Shape::Text, "schema_version = \"1\""),
    (
        "water.current",
        Shape::OneOf(&["constant", "grid"]),
        "current = {constant = {north_mps = 0, east_mps = 0.12}}",
    ),
    ("knowledge.current", Shape::Text, "current = \"unknown\""),
    ("surface_craft.goal", Shape::Kind, "goal = {track = {auv = \"auv-1\"}}"),
    ("surface_craft.goal_offset", Shape::Kind, "goal_offset = {ned = {north_m = -5, east_m = 10}}"),
    (
        "auvs[].path",
        Shape::OneOf(&["lawn_mower", "waypoints", "circle", "segments", "geojson", "random_survey"]),
        "path = {waypoints = {points = [[0, 0], [100, 0]], fillet_m = 10}}",
    ),
    ("auvs[].path.waypoints", Shape::Table, "waypoints = {points = [[0, 0], [100, 0]], fillet_m = 10}"),
    ("auvs[].path.lawn_mower.lanes", Shape::WholeNumber, "lanes = 4"),
];

impl Shape {
    fn fits(&self, value: &DeValue<'_>) -> bool {
        match (self, value) {
            (Self::Text, DeValue::String(_))
            | (Self::WholeNumber, DeValue::Integer(_))
            | (Self::Table, DeValue::Table(_)) => true,
            (Self::Kind, DeValue::Table(table)) => table.len() == 1,
            (Self::OneOf(names), DeValue::Table(table)) => {
                table.len() == 1 && names.iter().any(|name| table.contains_key(*name))
            }
            (Self::OneOf(names), DeValue::String(text)) => names.contains(&text.as_ref()),
            _ => false,
        }
    }

    fn wanted(&self) -> String {
        match self {
            Self::Text => "a string".to_owned(),
            Self::WholeNumber => "a whole number".to_owned(),
            Self::Table => "a table".to_owned(),
            Self::Kind => "a table with one kind".to_owned(),
            Self::OneOf(names) => format!("a table with one of {}", names.join(", ")),
        }
    }
}

/// A member of a file on the path to an inner member.
struct OuterMember<'a> {
    /// Its name, as `auvs[0].path`.
    field: String,
    /// The same without indices, as `auvs[].path`.
    place: String,
    value: Spanned<DeValue<'a>>,
}

/// Line and error, with an example, of the outermost wrong form on the path to `field`.
fn misshapen(text: &str, field: &str) -> Option<(usize, InvalidScenario)> {
    members_to(text, field).into_iter().find_map(|member| {
        let (_, shape, example) = FORMS.iter().find(|(place, ..)| *place == member.place)?;
        if shape.fits(member.value.get_ref()) {
            return None;
        }
        let (given, wanted) = (given(text, &member.value), shape.wanted());
        let reason = format!("{given} is not {wanted}; write for example {example}");
        let line = line_of(text, member.value.span().start);
        let field = member.field;
        Some((line, InvalidScenario { field, reason }))
    })
}

/// The text of `value`, shortened.
fn given(text: &str, value: &Spanned<DeValue<'_>>) -> String {
    if let DeValue::Table(table) = value.get_ref() {
        let keys: Vec<&str> = table.keys().map(|key| key.get_ref().as_ref()).collect();
        return format!("a table with {}", keys.join(", "));
    }
    let Range { start, end } = value.span();
    let words: Vec<&str> = text[start..end].split_whitespace().collect();
    let words = words.join(" ");
    if words.chars().count() <= QUOTED_MAX {
        return words;
    }
    words.chars().take(QUOTED_MAX).chain("…".chars()).collect()
}

/// The existing members on the path to `field`, such as `auvs[0].path`, outermost first.
fn members_to<'a>(text: &'a str, field: &str) -> Vec<OuterMember<'a>> {
    let mut members: Vec<OuterMember<'a>> = vec![];
    let Ok(document) = DeTable::parse(text) else { return members };
    let document = DeValue::Table(document.into_inner());
    for step in field.split(['.', '[']) {
        let here = members.last().map_or(&document, |member| member.value.get_ref());
        let index = step.strip_suffix(']');
        let next = match (here, index) {
            (DeValue::Table(table), None) => table.get(step),
            (DeValue::Array(items), Some(index)) => index.parse::<usize>().ok().and_then(|i| items.get(i)),
            _ => None,
        };
        let Some(value) = next.cloned() else { break };
        let (mut field, mut place) = members
            .last()
            .map_or_else(Default::default, |member| (member.field.clone(), member.place.clone()));
        match index {
            Some(index) => {
                field = format!("{field}[{index}]");
                place += "[]";
            }
            None if field.is_empty() => (field, place) = (step.to_owned(), step.to_owned()),
            None => {
                field = format!("{field}.{step}");
                place = format!("{place}.{step}");
            }
        }
        members.push(OuterMember { field, place, value });
    }
    members
}

/// The line of a TOML text, from 1 on, with this `byte`.
pub fn line_of(text: &str, byte: usize) -> usize {
    1 + text.bytes().take(byte).filter(|byte| *byte == b'\n').count()
}

/// The line of the member at `field`, such as `auvs[0].path`, or of the innermost table around it.
pub fn line_of_field(text: &str, field: &str) -> usize {
    let innermost = members_to(text, field).pop();
    innermost.map_or(1, |member| line_of(text, member.value.span().start))
}

#[cfg(test)]
mod tests {
    use crate::scenario::{Files, Scenario};
    use crate::tests::rows;

    #[test]
    fn a_wrong_form_is_refused_with_an_example_of_the_right_one() {
        let constant = "[water.current.constant]\nnorth_mps = 0\neast_mps = 0.12";
        let mower = "[auvs.path.lawn_mower]\nfrom = [0, 0]\nheading_rad = 0\nlane_length_m = 100\n\
                     lane_spacing_m = 20\nlanes = 4";
        let inline = "current = {constant = {north_mps = 0, east_mps = 0.12}}";
        let points = "waypoints = {points = [[0, 0], [100, 0]], fillet_m = 10}";
        // The last mistake, inside a right form, is named itself.
        for [right, wrong, says, example] in rows(
            r#"
            schema_version = "1" | schema_version = 1 | schema_version: 1 is not a string | schema_version = "1"
            lanes = 4 | lanes = 2.5 | path.lawn_mower.lanes: 2.5 is not a whole number | lanes = 4
            lanes = 4 | lanes = "four" | lawn_mower.lanes: |
            CONSTANT | [water]\ncurrent = {north_mps = 0, east_mps = 0.12} | water.current: a table with east_mps, north_mps is not a table with one of constant, grid | INLINE
            CONSTANT | [water]\ncurrent = [0, 0.12] | water.current: [0, 0.12] is not a table with one of constant, grid | INLINE
            CONSTANT | [water]\ncurrent = {east_mps = 0.12} | water.current: a table with east_mps is not |
            MOWER | [auvs.path]\nwaypoints = [[0, 0], [100, 0]] | auvs[0].path.waypoints: [[0, 0], [100, 0]] is not a table | POINTS
            MOWER | path = [[0, 0], [100, 0]] | auvs[0].path: [[0, 0], [100, 0]] is not a table with one of lawn_mower, waypoints |
            goal.track | goal.trck | surface_craft.goal: unknown variant `trck`, expected one of `track`, `intermittent` |
            [surface_craft.goal.track] | [surface_craft.goal.track]\nauv = "auv-1"\n[surface_craft.goal.midpoint] | goal: a table with midpoint, track is not a table with one kind |
            east_mps = 0.12 | east_mps = 9 | water.current.constant.east_mps: 9 is outside -3 to 3 m/s |
            "#,
        ) {
            let right = right.replace("CONSTANT", constant).replace("MOWER", mower);
            let example = example.replace("INLINE", inline).replace("POINTS", points);
            let text = Scenario::text("cross-current").expect("exists");
            assert!(text.contains(&right), "{right}");
            let text = text.replacen(&right, &wrong, 1);
            let read = Scenario::parse(&text, "my.toml", Files::default());
            let error = read.and_then(Scenario::checked).expect_err(&wrong);
            let message = error.to_string();
            assert!(message.starts_with("my.toml:") && message.contains(&says), "{message}");
            let shown = format!("{says}; write for example {example}");
            assert!(example.is_empty() || message.contains(&shown), "{message}");
        }
    }

    #[test]
    fn every_example_of_a_form_is_accepted() {
        for (place, shape, example) in super::FORMS {
            let (_, key) = place.rsplit_once('.').unwrap_or(("", place));
            let table = toml::de::DeTable::parse(example).expect("is TOML");
            let value = table.get_ref().get(key).expect("is of its key");
            assert!(shape.fits(value.get_ref()), "{example}");
        }
    }
}
