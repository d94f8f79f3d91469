//! Line charts as data: panels of lines and axes above a legend. Crate `page` draws them.

use std::borrow::Cow;

use serde::Serialize;

/// A colour as style sheets write it.
pub(crate) type Colour = &'static str;

/// Colours for colour-blind readers. Source: M. Okabe, K. Ito, "Color Universal Design", 2008.
pub(crate) const BLUE: Colour = "#0072B2";
pub(crate) const VERMILION: Colour = "#D55E00";
/// For references, which lie under the measurements.
pub(crate) const GREY: Colour = "#A5ACB4";

/// A figure.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Sheet {
    pub(crate) title: String,
    pub(crate) columns: usize,
    pub(crate) panels: Vec<Panel>,
}

/// Axes and their lines.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Panel {
    pub(crate) heading: String,
    pub(crate) x_label: Cow<'static, str>,
    pub(crate) y_label: Cow<'static, str>,
    pub(crate) lines: Vec<Line>,
}

impl Panel {
    /// Over time in seconds.
    pub(crate) fn over_time(y_label: &'static str, lines: Vec<Line>) -> Self {
        Self {
            heading: String::new(),
            x_label: "time, s".into(),
            y_label: y_label.into(),
            lines,
        }
    }
}

/// A line and its name in the legend. Equal names share an entry.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Line {
    pub(crate) name: String,
    pub(crate) colour: Colour,
    pub(crate) stroke: Stroke,
    pub(crate) points: Vec<(f64, f64)>,
}

impl Line {
    pub(crate) fn new(
        name: impl Into<String>,
        colour: Colour,
        stroke: Stroke,
        points: impl IntoIterator<Item = (f64, f64)>,
    ) -> Self {
        Self {
            name: name.into(),
            colour,
            stroke,
            points: points.into_iter().collect(),
        }
    }
}

/// Style of a line.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Stroke {
    Solid,
    Dashed,
}
