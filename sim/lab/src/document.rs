//! Headings, paragraphs, tables and charts, as Markdown or as one page without network access.

use std::fmt::Write as _;

use serde::Serialize;
use serde_json::json;

use crate::chart::Sheet;

/// A document in blocks, the first of which is its title.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Document(pub(crate) Vec<Block>);

/// A block. Text between `**` is bold, between backticks code; there is no other markup.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Block {
    /// A heading and its level, from 1 to 3.
    Heading(usize, String),
    /// A paragraph.
    Paragraph(String),
    /// A table.
    Table(Table),
    /// Code, with its caption.
    Code(String, String),
    /// A figure; Markdown shows its title only.
    Sheet(Sheet),
}

/// A table; every row has as many cells as there are columns.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub(crate) struct Table {
    /// Number of text columns, from the left; the others hold numbers and are aligned right.
    pub(crate) words: usize,
    /// Names of the columns.
    pub(crate) columns: Vec<String>,
    /// Cells, row by row.
    pub(crate) rows: Vec<Vec<String>>,
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
                Block::Code(caption, code) => push(&mut text, &format!("{caption}:\n\n```\n{code}\n```")),
                Block::Sheet(sheet) => {
                    push(&mut text, &format!("Picture in the HTML report: {}", sheet.title));
                }
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

    /// As a page in one file. Its title is its first heading.
    #[must_use]
    pub(crate) fn html(&self) -> String {
        let title = match self.0.first() {
            Some(Block::Heading(_, words)) => words,
            _ => "report",
        };
        page::one_file(title, &json!({ "kind": "document", "blocks": self.0 }))
    }
}

fn push(text: &mut String, line: &str) {
    writeln!(text, "{line}").expect("a string takes everything");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn markdown_escapes_what_would_end_a_cell() {
        let document = Document(vec![
            Block::Heading(1, "All & sundry".to_owned()),
            Block::Paragraph("say `a < b` **twice**, and 2 ** 3".to_owned()),
            Block::Table(Table {
                words: 1,
                columns: vec!["name".to_owned(), "value".to_owned()],
                rows: vec![vec!["x|y".to_owned(), "1".to_owned()]],
            }),
        ]);
        assert_eq!(
            document.markdown(),
            "# All & sundry\n\nsay `a < b` **twice**, and 2 ** 3\n\n| name | value |\n|---|---:|\n| x\\|y | 1 |\n"
        );
    }
}
