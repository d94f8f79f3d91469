//! Colours of charts on pages, light and dark.

use plotters::style::RGBColor;

use super::{BLACK_INK, GRID};

/// Of runs, the first two those of the service's page; then measured, simulated and reference on the page of a log.
pub(crate) const RUNS: [RGBColor; 6] = [
    RGBColor(0x0b, 0x6b, 0xb0),
    RGBColor(0xd4, 0x57, 0x1b),
    RGBColor(0x10, 0x20, 0x2c),
    RGBColor(0xb5, 0x9a, 0x00),
    RGBColor(0x8f, 0x9a, 0xa5),
    RGBColor(0xc2, 0x18, 0x5b),
];
/// Of underwater vehicles.
pub(crate) const AUVS: [RGBColor; 4] = [
    RGBColor(0x1d, 0x7f, 0x5f),
    RGBColor(0x8a, 0x5a, 0x00),
    RGBColor(0x56, 0xb4, 0xe9),
    RGBColor(0xcc, 0x79, 0xa7),
];
pub(crate) const GOAL: RGBColor = RGBColor(0x7a, 0x5b, 0xb5);
pub(crate) const PATH: RGBColor = RGBColor(0xb9, 0xc4, 0xce);
/// Of what the craft has to keep within or out of.
pub(crate) const BOUND: RGBColor = RGBColor(0xb3, 0x26, 0x1e);

/// What colours become on a dark ground, where they would be hard to see.
const DARK: [(RGBColor, &str); 10] = [
    (BLACK_INK, "#e3eaf0"),
    (GRID, "#2b3d4c"),
    (PATH, "#46596a"),
    (RUNS[0], "#58acee"),
    (RUNS[1], "#f08a55"),
    (RUNS[2], "#f4f7f9"),
    (RUNS[5], "#ff6f9f"),
    (AUVS[0], "#4fc79c"),
    (AUVS[1], "#d29a3f"),
    (GOAL, "#b79ef0"),
];

/// The colour as charts write it.
pub(super) fn hex(RGBColor(red, green, blue): RGBColor) -> String {
    format!("#{red:02X}{green:02X}{blue:02X}")
}

/// Rules for dark screens: a rule of a style sheet is stronger than an attribute of a drawing.
pub(super) fn dark_style() -> String {
    let rule = |(light, dark): (RGBColor, &str)| {
        let light = hex(light);
        format!("svg [stroke=\"{light}\"] {{ stroke: {dark} }} svg [fill=\"{light}\"] {{ fill: {dark} }}\n")
    };
    let rules: String = DARK.map(rule).concat();
    format!("@media (prefers-color-scheme: dark) {{\n{rules}}}\n")
}
