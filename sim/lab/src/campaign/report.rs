//! The report of a campaign: each controller beside the reference, with intervals, failures and the effect of parameters.
//!
//! One set of numbers in three forms: a page in one file, Markdown, and JSON for programs. Equal rows give equal
//! reports, unless `report.metrics` names a measured time.

mod claims;
mod compared;
mod data;
mod learnt;
mod numbers;
mod overview;
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

/// The report of a campaign.
#[derive(Clone, Debug)]
pub struct CampaignReport {
    numbers: Numbers,
    document: Document,
}

/// The report on the `rows` of `campaign`, in any order. Shards have one too, on their rows.
#[must_use]
pub fn report(campaign: &Campaign, rows: &Rows) -> CampaignReport {
    let numbers = Numbers::of(campaign, rows);
    CampaignReport {
        document: sections::document(&numbers),
        numbers,
    }
}

impl CampaignReport {
    /// As Markdown with GitHub's tables; pictures are left out, and their captions stay.
    #[must_use]
    pub fn markdown(&self) -> String {
        self.document.markdown()
    }

    /// As one page of HTML with its pictures, which needs no other file.
    #[must_use]
    pub fn html(&self) -> String {
        self.document.html()
    }

    /// All numbers of the tables as JSON, unrounded. Ratios, shares and probabilities have no unit; other units are beside the
    /// numbers or at the end of their names.
    #[must_use]
    pub fn json(&self) -> String {
        serde_json::to_string_pretty(&self.numbers).expect("numbers and words are JSON") + "\n"
    }
}
