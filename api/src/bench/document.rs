//! Headings, paragraphs and tables, as Markdown or as a page of HTML.

use std::fmt::Write as _;

use crate::report::escaped;

/// A text in blocks.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Document(pub Vec<Block>);

/// A block. Words between two `*` pairs are strong, between two backticks code; there is no other markup in them.
#[derive(Clone, Debug, PartialEq)]
pub enum Block {
    /// A heading and its level, from 1 on.
    Heading(usize, String),
    /// A paragraph.
    Paragraph(String),
    /// A table.
    Table(Table),
    /// A picture that lies beside the document: name of its file, and what it shows.
    Picture(String, String),
}

/// A table; every row has as many cells as there are columns.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    /// How many columns, from the left, hold words; the others hold numbers and are set flush right.
    pub words: usize,
    /// Names of the columns.
    pub columns: Vec<String>,
    /// Cells, row by row.
    pub rows: Vec<Vec<String>>,
}

impl Table {
    /// Without rows.
    #[must_use]
    pub fn new(words: usize, columns: &[&str]) -> Self {
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
    pub fn markdown(&self) -> String {
        let mut text = String::new();
        for block in &self.0 {
            if !text.is_empty() {
                text.push('\n');
            }
            match block {
                Block::Heading(level, words) => push(&mut text, &format!("{} {words}", "#".repeat(*level))),
                Block::Paragraph(words) => push(&mut text, words),
                Block::Picture(file, shows) => push(&mut text, &format!("![{shows}]({file})")),
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

    /// As a page that needs nothing but its pictures.
    #[must_use]
    pub fn html(&self) -> String {
        let mut text = String::from(HEAD);
        for block in &self.0 {
            match block {
                Block::Heading(level, words) => {
                    push(&mut text, &format!("<h{level}>{}</h{level}>", marked_up(words)));
                }
                Block::Paragraph(words) => push(&mut text, &format!("<p>{}</p>", marked_up(words))),
                Block::Picture(file, shows) => {
                    let (file, shows) = (escaped(file), escaped(shows));
                    push(&mut text, &format!("<p><img src=\"{file}\" alt=\"{shows}\"></p>"));
                }
                Block::Table(Table { words, columns, rows }) => {
                    push(
                        &mut text,
                        &format!("<table><tr>{}</tr>", cells("th", *words, columns)),
                    );
                    for row in rows {
                        push(&mut text, &format!("<tr>{}</tr>", cells("td", *words, row)));
                    }
                    push(&mut text, "</table>");
                }
            }
        }
        text + "</html>\n"
    }
}

fn push(text: &mut String, line: &str) {
    writeln!(text, "{line}").expect("a string takes everything");
}

fn cells(tag: &str, words: usize, cells: &[String]) -> String {
    let mut text = String::new();
    for (i, cell) in cells.iter().enumerate() {
        let class = if i < words { "" } else { " class=\"n\"" };
        write!(text, "<{tag}{class}>{}</{tag}>", marked_up(cell)).expect("a string takes everything");
    }
    text
}

fn marked_up(words: &str) -> String {
    let strong = paired(&escaped(words), "**", "b");
    paired(&strong, "`", "code")
}

/// Every pair of marks becomes a pair of tags; one without a partner stays.
fn paired(words: &str, mark: &str, tag: &str) -> String {
    let parts: Vec<&str> = words.split(mark).collect();
    let without_partner = parts.len().is_multiple_of(2);
    let mut text = String::new();
    for (i, part) in parts.iter().enumerate() {
        let marks_before = match i {
            0 => String::new(),
            last if without_partner && last + 1 == parts.len() => mark.to_owned(),
            odd if odd % 2 == 1 => format!("<{tag}>"),
            _ => format!("</{tag}>"),
        };
        text.push_str(&marks_before);
        text.push_str(part);
    }
    text
}

const HEAD: &str = r#"<!doctype html>
<html lang="en">
<meta charset="utf-8">
<meta name="viewport" content="width=device-width">
<title>Pilotfish: benchmark</title>
<style>
  body { max-width: 1300px; margin: 24px auto; padding: 0 16px; font: 15px/1.45 system-ui, "DejaVu Sans", sans-serif; color: #10202c; }
  table { border-collapse: collapse; font-size: 13px; font-variant-numeric: tabular-nums; }
  th, td { padding: 4px 10px; border-top: 1px solid #d5dee6; text-align: left; vertical-align: top; }
  .n { text-align: right; white-space: nowrap; }
  img { max-width: 100%; border: 1px solid #d5dee6; border-radius: 8px; }
</style>
"#;

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
        assert!(page.contains("<h1>All &amp; sundry</h1>"));
        assert!(page.contains("<p>say <code>a &lt; b</code> <b>twice</b>, and 2 ** 3</p>"));
        assert!(page.contains("<tr><td>x|y</td><td class=\"n\">1</td></tr>"));
    }
}
