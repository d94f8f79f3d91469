//! The report of a campaign: how each controller did beside the reference, how surely, where it failed, and what that depends on.
//!
//! One set of numbers, in three forms: a page that needs nothing else, Markdown, and JSON for programs. Equal rows give equal
//! reports, but for solve times, which are measured.

mod claims;
mod forest;
mod gather;
mod learnt;
mod numbers;
mod pareto;
mod scores;
mod sections;
mod tables;
#[cfg(test)]
mod tests;
mod words;

use crate::document::Document;

use super::{design::Campaign, rows::Rows};
use numbers::Numbers;
pub(super) use words::number;

/// The report of a campaign.
#[derive(Clone, Debug)]
pub struct CampaignReport {
    numbers: Numbers,
    document: Document,
}

/// The report on the `rows` of `campaign`, in any order. Shards and broken-off campaigns have one too: of the rows that are there.
#[must_use]
pub fn report(campaign: &Campaign, rows: &Rows) -> CampaignReport {
    let numbers = Numbers::of(campaign, rows);
    CampaignReport {
        document: sections::document(&numbers),
        numbers,
    }
}

impl CampaignReport {
    /// As Markdown with GitHub's tables; pictures are named and left out.
    #[must_use]
    pub fn markdown(&self) -> String {
        self.document.markdown()
    }

    /// As one page of HTML with its pictures, without scripts or references.
    #[must_use]
    pub fn html(&self) -> String {
        self.document.html()
    }

    /// All numbers of the tables, not rounded, as JSON. Ratios, shares and probabilities are 1; other units stand beside the numbers
    /// or at the end of their names.
    #[must_use]
    pub fn json(&self) -> String {
        serde_json::to_string_pretty(&self.numbers).expect("numbers and words are JSON") + "\n"
    }
}
