//! Types that the event store stores and returns.

use std::sync::Arc;

use super::error::StoreError;

/// A stored event. Only the missions read its body.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StoredEvent {
    /// Its number in its mission, from 1 without gaps.
    pub sequence: u64,
    /// Its kind.
    pub kind: String,
    /// JSON.
    pub body: Arc<[u8]>,
}

/// A mission in a list.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StoredMission {
    /// Its number; lists are in this order.
    pub number: u64,
    /// Its id in paths.
    pub id: String,
    /// The client that created it.
    pub owner: String,
    pub(super) summary: Vec<u8>,
    /// `true` if the summary has its digest.
    pub(super) is_whole: bool,
}

impl StoredMission {
    /// JSON of the mission after its last event. Fails if it is damaged.
    pub fn summary(&self) -> Result<&[u8], StoreError> {
        if self.is_whole {
            return Ok(&self.summary);
        }
        let what = format!("mission {}: its summary is not what was stored", self.id);
        Err(StoreError::Damaged(what))
    }
}

/// An append to one mission, stored completely or not at all.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Append {
    /// The mission's id.
    pub mission: String,
    /// The mission's number; none for a new mission. Deletions free ids, but no numbers.
    pub number: Option<u64>,
    /// Epoch of the caller's ownership; 0 in a store of one service.
    pub epoch: u64,
    /// Events that continue the mission's sequence.
    pub events: Vec<StoredEvent>,
    /// The mission's status after these events; a service that starts looks for running missions.
    pub status: String,
    /// JSON of the mission after these events.
    pub summary: Vec<u8>,
    /// The state after the last of these events, if it is worth storing.
    pub snapshot: Option<Vec<u8>>,
    /// The client's idempotency key, and the answer.
    pub answered: Option<KeyedAnswer>,
    /// The order's author, if this is an order.
    pub order: Option<AuditEntry>,
    /// Largest share of the disk after this append.
    pub room: Room,
}

impl Append {
    pub(super) fn is_over(&self) -> bool {
        ["finished", "failed"].contains(&&*self.status)
    }

    /// The owner of a new mission.
    pub(super) fn creator(&self) -> &str {
        self.order.as_ref().map_or("", |order| &order.caller)
    }
}

/// Limit of a client's share of the disk after an append.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Room {
    /// No limit: plans, pauses and ends of missions.
    #[default]
    Any,
    /// The share: reports and changes.
    Share,
    /// Half of the share: new missions. The other half is for running missions.
    Half,
}

/// An order of the audit: its author and its action. It outlives the mission.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AuditEntry {
    /// Time, Unix time, s.
    pub at_s: f64,
    /// Name of the client's token, or the client's address.
    pub caller: String,
    /// Id of the request.
    pub request: String,
    /// The action, such as `create` or `finish`.
    pub action: String,
}

/// The answer to a request with a key.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct KeyedAnswer {
    /// The client's key.
    pub key: String,
    /// Hash of the request; detects the same key in a different request.
    pub request: [u8; 32],
    /// The answer, JSON.
    pub answer: Vec<u8>,
}

/// Hash of an earlier request, and its answer.
pub type PreviousAnswer = ([u8; 32], Vec<u8>);

/// Selects a [`PreviousAnswer`] by mission and key.
pub(super) const FIND_ANSWER: &str = "SELECT request, answer FROM answered JOIN missions ON number = mission
    WHERE id = ?1 AND key = ?2 AND status <> 'deleted'";

impl KeyedAnswer {
    /// The result of an append whose key had this answer before.
    pub(super) fn repeated(&self, request: &[u8], answer: Vec<u8>) -> Appended {
        if self.request == request { Appended::AnsweredBefore(answer) } else { Appended::KeyTaken }
    }
}

/// The result of an append. Only `Stored` stores anything.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Appended {
    /// The append was stored.
    Stored,
    /// A request with the same key had this answer.
    AnsweredBefore(Vec<u8>),
    /// The key belongs to a different request.
    KeyTaken,
    /// The mission was deleted.
    MissionGone,
    /// The caller does not know the newest events of the mission.
    OutOfSequence,
    /// Another service owns the mission, or is about to.
    NotOwner,
    /// The client's share of the disk is used up.
    ShareUsed,
}
