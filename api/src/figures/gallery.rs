//! All figures on one page.

use std::fmt::Write as _;

use super::{Figure, Stated};
use crate::report::escaped;

/// A page of HTML that shows the figures, which lie beside it, and the table of [`super::stated()`].
#[must_use]
pub fn gallery(figures: &[Figure], rows: &[Stated]) -> String {
    let mut text = String::from(HEAD);
    for figure in figures {
        let (file, caption) = (figure.file_name(), escaped(&figure.caption));
        writeln!(
            text,
            "<figure><a href=\"{file}\"><img src=\"{file}\" alt=\"{caption}\"></a>\
             <figcaption>Fig. {}: {caption}</figcaption></figure>",
            figure.number
        )
        .expect("a string takes everything");
    }
    text +=
        "<h2>The paper's numbers and these</h2>\n<table><tr><th>Fig.<th>quantity<th>paper<th>here<th>why\n";
    for row in rows {
        let cells = [row.quantity, row.paper, &row.measured, row.why].map(escaped);
        writeln!(text, "<tr><td>{}<td>{}", row.figure, cells.join("<td>"))
            .expect("a string takes everything");
    }
    text + "</table>\n</html>\n"
}

const HEAD: &str = r#"<!doctype html>
<html lang="en">
<meta charset="utf-8">
<meta name="viewport" content="width=device-width">
<title>Pilotfish: the paper's figures</title>
<style>
  body { max-width: 1100px; margin: 24px auto; padding: 0 16px; font: 15px/1.45 system-ui, "DejaVu Sans", sans-serif; color: #10202c; }
  figure { margin: 0 0 32px; }
  img { width: 100%; border: 1px solid #d5dee6; border-radius: 8px; }
  figcaption { color: #55677a; padding: 6px 2px; }
  table { border-collapse: collapse; }
  th, td { padding: 6px 10px; border-top: 1px solid #d5dee6; text-align: left; vertical-align: top; }
</style>
<h1>The paper's figures, flown again</h1>
<p>Dots mark where a track begins. The paper steers by line of sight; the planner is drawn beside it.</p>
"#;
