//! The parts of a page for tests.

use std::collections::BTreeSet;

/// A fenced block.
pub(crate) struct Block {
    pub(crate) language: String,
    pub(crate) text: String,
}

pub(crate) fn blocks(markdown: &str) -> Vec<Block> {
    let mut blocks = vec![];
    let mut lines = markdown.lines();
    while let Some(opening) = lines.by_ref().find_map(|line| line.trim_start().strip_prefix("```")) {
        let content: Vec<&str> = lines.by_ref().take_while(|line| line.trim() != "```").collect();
        blocks.push(Block { language: opening.to_owned(), text: content.join("\n") });
    }
    blocks
}

/// The running text.
pub(crate) fn without_blocks(markdown: &str) -> String {
    let mut inside = false;
    let outside = markdown.lines().filter(|line| {
        let fence = line.trim_start().starts_with("```");
        inside ^= fence;
        !inside && !fence
    });
    outside.collect::<Vec<_>>().join("\n")
}

/// The text between backticks in the running text.
pub(crate) fn spans(markdown: &str) -> Vec<String> {
    let text = without_blocks(markdown);
    text.split("\n\n")
        .flat_map(|paragraph| paragraph.split('`').skip(1).step_by(2))
        .map(|span| span.replace('\n', " "))
        .collect()
}

/// The anchors of a page: of its titles, and its own.
pub(crate) fn titles(markdown: &str) -> BTreeSet<String> {
    let text = without_blocks(markdown);
    let named = text.split("id=\"").skip(1).filter_map(|rest| rest.split('"').next()).map(str::to_owned);
    let of_titles = text.lines().filter(|line| line.starts_with('#')).map(|line| {
        let kept = |c: &char| c.is_alphanumeric() || *c == ' ' || *c == '-' || *c == '_';
        let title = line.trim_start_matches('#').trim().to_lowercase();
        title.chars().filter(kept).collect::<String>().replace(' ', "-")
    });
    named.chain(of_titles).collect()
}
