//! All figures on one page.

use maud::html;

use super::{Figure, Stated};
use crate::article::article;

/// A page of HTML that shows the figures, which lie beside it, and the table of [`super::stated()`].
#[must_use]
pub fn gallery(figures: &[Figure], rows: &[Stated]) -> String {
    let body = html! {
        h1 { "The paper's figures, flown again" }
        p { "Dots mark where a track begins. The paper steers by line of sight; the planner is drawn beside it." }
        @for figure in figures {
            @let file = figure.file_name();
            figure {
                a href=(file) { img src=(file) alt=(figure.caption); }
                figcaption { "Fig. " (figure.number) ": " (figure.caption) }
            }
        }
        h2 { "The paper's numbers and these" }
        table {
            tr { @for name in ["Fig.", "quantity", "paper", "here", "why"] { th { (name) } } }
            @for row in rows {
                tr {
                    td { (row.figure) }
                    @for cell in [row.quantity, row.paper, &row.measured, row.why] { td { (cell) } }
                }
            }
        }
    };
    article("Pilotfish: the paper's figures", &body)
}
