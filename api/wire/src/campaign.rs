//! Campaigns as clients see them. What a campaign is made of is the laboratory's: `lab::campaign::CampaignFile`.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// A campaign that was posted, and how far it is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Campaign {
    /// Its name in paths.
    pub id: String,
    /// Its file's name.
    pub name: String,
    /// What it asks, in one line.
    pub title: String,
    /// Where it is.
    pub status: CampaignStatus,
    /// When it was posted, Unix time, s.
    pub created_s: f64,
    /// When the service began with it, or went on with it after its last start, Unix time, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub started_s: Option<f64>,
    /// When it was over, Unix time, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub finished_s: Option<f64>,
    /// How far it is.
    pub progress: CampaignProgress,
    /// Rows of its table, once it is done.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rows: Option<u64>,
    /// SHA-256 of all rows but for what the clock measured, once it is done: equal campaigns have equal ones.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub digest: Option<String>,
    /// Why it failed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
}

/// Where a campaign is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "lowercase")]
pub enum CampaignStatus {
    /// It waits for those before it.
    Queued,
    /// It is flown.
    Running,
    /// All of it was flown, and its report is written.
    Done,
    /// A client stopped it.
    Cancelled,
    /// It cannot be flown to its end.
    Failed,
}

impl CampaignStatus {
    /// Its name in JSON.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Queued => "queued",
            Self::Running => "running",
            Self::Done => "done",
            Self::Cancelled => "cancelled",
            Self::Failed => "failed",
        }
    }

    /// Whether nothing more will come of it.
    #[must_use]
    pub fn is_over(self) -> bool {
        match self {
            Self::Queued | Self::Running => false,
            Self::Done | Self::Cancelled | Self::Failed => true,
        }
    }
}

/// How far a campaign is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct CampaignProgress {
    /// Laws whose gains are to be found, in all scenarios with all craft: those of a part that was flown before a start of the
    /// service are not counted.
    pub laws: u64,
    /// Laws whose gains are found.
    pub laws_tuned: u64,
    /// Runs, at most: a law whose gains are the best for two objectives flies once for both.
    pub runs: u64,
    /// Runs that are flown. A few of the newest are flown again after the service was stopped.
    pub runs_done: u64,
    /// Missions that failed since the service began or went on with it.
    pub runs_failed: u64,
    /// Runs in a second since then.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub runs_per_s: Option<f64>,
}

/// Campaigns, in the order in which they were posted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct CampaignList {
    /// Some of them.
    pub campaigns: Vec<Campaign>,
    /// Where the next ones begin: the `after` to ask for them with. None: there are no more.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub next: Option<u64>,
}
