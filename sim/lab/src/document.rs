//! Headings, paragraphs and tables, as Markdown or as a page of HTML.

use std::fmt::Write as _;

use maud::{Markup, PreEscaped, html};

use crate::article::article;

/// A text in blocks.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Document(pub(crate) Vec<Block>);

/// A block. Words between two `*` pairs are strong, between two backticks code; there is no other markup in them.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Block {
    /// A heading and its level, from 1 to 3.
    Heading(usize, String),
    /// A paragraph.
    Paragraph(String),
    /// A table.
    Table(Table),
    /// A picture within the document: its SVG, and what it shows. Markdown has no place for it, and says what it shows.
    Drawing(String, String),
}

/// A table; every row has as many cells as there are columns.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Table {
    /// How many columns, from the left, hold words; the others hold numbers and are set flush right.
    pub(crate) words: usize,
    /// Names of the columns.
    pub(crate) columns: Vec<String>,
    /// Cells, row by row.
    pub(crate) rows: Vec<Vec<String>>,
}

impl Table {
    /// Without rows.
    #[must_use]
    pub(crate) fn new(words: usize, columns: &[&str]) -> Self {
        Self {
            words,
            columns: columns.iter().map(|name| (*name).to_owned()).collect(),
            rows: vec![],
        }
    }
}

impl Document {
    /// As Markdown with GitHub's tables.
    #[must_use]
    pub(crate) fn markdown(&self) -> String {
        let mut text = String::new();
        for block in &self.0 {
            if !text.is_empty() {
                text.push('\n');
            }
            match block {
                Block::Heading(level, words) => push(&mut text, &format!("{} {words}", "#".repeat(*level))),
                Block::Paragraph(words) => push(&mut text, words),
                Block::Drawing(_, shows) => push(&mut text, &format!("Drawn on the page: {shows}")),
                Block::Table(Table { words, columns, rows }) => {
                    let line = |cells: &[String]| {
                        let cells: Vec<String> = cells.iter().map(|cell| cell.replace('|', "\\|")).collect();
                        format!("| {} |", cells.join(" | "))
                    };
                    push(&mut text, &line(columns));
                    let numbers = "---:|".repeat(columns.len().saturating_sub(*words));
                    push(&mut text, &format!("|{}{numbers}", "---|".repeat(*words)));
                    for row in rows {
                        push(&mut text, &line(row));
                    }
                }
            }
        }
        text
    }

    /// As a page that needs nothing else. Its title is its first heading.
    #[must_use]
    pub(crate) fn html(&self) -> String {
        let body = html! { @for block in &self.0 { (block_html(block)) } };
        article(&format!("Pilotfish: {}", self.title()), &body)
    }

    fn title(&self) -> &str {
        let first = self.0.iter().find_map(|block| match block {
            Block::Heading(_, words) => Some(words.as_str()),
            Block::Paragraph(_) | Block::Table(_) | Block::Drawing(..) => None,
        });
        first.unwrap_or("report")
    }
}

fn push(text: &mut String, line: &str) {
    writeln!(text, "{line}").expect("a string takes everything");
}

fn block_html(block: &Block) -> Markup {
    match block {
        Block::Heading(level, words) => {
            let words = marked_up(words);
            match level {
                1 => html! { h1 { (words) } },
                2 => html! { h2 { (words) } },
                _ => html! { h3 { (words) } },
            }
        }
        Block::Paragraph(words) => html! { p { (marked_up(words)) } },
        Block::Drawing(svg, shows) => {
            html! { figure style="margin: 1em 0" { (PreEscaped(svg)) figcaption { (marked_up(shows)) } } }
        }
        Block::Table(table) => {
            let number = |i: usize| (table.words <= i).then_some("n");
            html! {
                div style="margin: 1em 0; overflow-x: auto" {
                    table {
                        tr { @for (i, cell) in table.columns.iter().enumerate() { th class=[number(i)] { (marked_up(cell)) } } }
                        @for row in &table.rows {
                            tr { @for (i, cell) in row.iter().enumerate() { td class=[number(i)] { (marked_up(cell)) } } }
                        }
                    }
                }
            }
        }
    }
}

fn marked_up(words: &str) -> Markup {
    html! {
        @for (strong, words) in parts(words, "**") {
            @if strong { b { (code(&words)) } } @else { (code(&words)) }
        }
    }
}

fn code(words: &str) -> Markup {
    html! {
        @for (code, words) in parts(words, "`") {
            @if code { code { (words) } } @else { (words) }
        }
    }
}

/// `words` in parts, and whether each stands between two marks. A mark without a partner stays.
fn parts(words: &str, mark: &str) -> Vec<(bool, String)> {
    let mut parts: Vec<(bool, String)> = words
        .split(mark)
        .enumerate()
        .map(|(i, part)| (i % 2 == 1, part.to_owned()))
        .collect();
    if parts.len().is_multiple_of(2)
        && let Some((_, tail)) = parts.pop()
    {
        parts.push((false, format!("{mark}{tail}")));
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    fn document() -> Document {
        Document(vec![
            Block::Heading(1, "All & sundry".to_owned()),
            Block::Paragraph("say `a < b` **twice**, and 2 ** 3".to_owned()),
            Block::Table(Table {
                rows: vec![vec!["x|y".to_owned(), "1".to_owned()]],
                ..Table::new(1, &["name", "value"])
            }),
        ])
    }

    #[test]
    fn markdown_escapes_what_would_end_a_cell() {
        let text = document().markdown();
        assert_eq!(
            text,
            "# All & sundry\n\nsay `a < b` **twice**, and 2 ** 3\n\n| name | value |\n|---|---:|\n| x\\|y | 1 |\n"
        );
    }

    #[test]
    fn html_escapes_and_closes_what_it_opens() {
        let page = document().html();
        assert!(page.contains("<title>Pilotfish: All &amp; sundry</title>"));
        assert!(page.contains("<h1>All &amp; sundry</h1>"));
        assert!(page.contains("<p>say <code>a &lt; b</code> <b>twice</b>, and 2 ** 3</p>"));
        assert!(page.contains("<tr><td>x|y</td><td class=\"n\">1</td></tr>"));
    }

    #[test]
    fn a_drawing_stands_within_the_page_and_markdown_says_what_it_shows() {
        let drawn = Document(vec![Block::Drawing("<svg></svg>".to_owned(), "a & b".to_owned())]);
        assert!(
            drawn
                .html()
                .contains("<svg></svg><figcaption>a &amp; b</figcaption>")
        );
        assert!(drawn.html().contains("<title>Pilotfish: report</title>"));
        assert_eq!(drawn.markdown(), "Drawn on the page: a & b\n");
    }
}
