//! What the event store keeps of a mission, and what it is asked to keep.

use super::idempotency::KeyedAnswer;
use std::sync::Arc;

/// An event as it is stored. Only the missions know what its body means.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StoredEvent {
    /// Its number in its mission, from 1 on without a gap.
    pub sequence: u64,
    /// Its kind.
    pub kind: String,
    /// JSON.
    pub body: Arc<[u8]>,
}

/// A mission as the list of all missions shows it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StoredMission {
    /// Its number, by which lists are ordered and continued.
    pub number: u64,
    /// Its name in paths.
    pub id: String,
    /// JSON of the mission after its last event.
    pub summary: Vec<u8>,
}

/// What is appended to one mission, all of it or nothing.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Append {
    /// The mission's name.
    pub mission: String,
    /// The mission's number; none for a new mission. A name is free again after its mission is deleted, a number is not.
    pub number: Option<u64>,
    /// Events, whose sequence continues that of the mission.
    pub events: Vec<StoredEvent>,
    /// The mission's status after these events. A start finds running missions by it.
    pub status: String,
    /// JSON of the mission after these events.
    pub summary: Vec<u8>,
    /// The fold of all events up to the last of these, where it is worth keeping.
    pub snapshot: Option<Vec<u8>>,
    /// The client's key of the request, and its answer.
    pub answered: Option<KeyedAnswer>,
    /// Who ordered it, where it is an order.
    pub order: Option<Order>,
    /// How much of its share of the disk the client who made the mission must have left.
    pub room: Room,
}

/// How full a client's share of the disk may be for an append. It is refused beyond that.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Room {
    /// It is stored in any case: what a mission needs to be planned for, to pause or to end.
    #[default]
    Any,
    /// Within the share: what goes on with a mission.
    Share,
    /// Within half of it, so that missions under way have the other half: what makes a new one.
    Half,
}

/// An order to change a mission, as it is kept for those who ask who gave it. It outlives the mission.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Order {
    /// When it was given, Unix time, s.
    pub at_s: f64,
    /// Name of the client's token, or its address.
    pub caller: String,
    /// Id of the request.
    pub request: String,
    /// What was ordered, such as `create` or `finish`.
    pub action: String,
}

/// An order, as it was stored.
#[derive(Clone, Debug, PartialEq)]
pub struct StoredOrder {
    /// Its number, by which lists are ordered and continued.
    pub number: u64,
    /// Name of the mission.
    pub mission: String,
    /// The order.
    pub order: Order,
}

/// What became of an append. All but `Stored` store nothing.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Appended {
    /// It is stored.
    Stored,
    /// Its key had this answer before.
    AnsweredBefore(Vec<u8>),
    /// Its key was answered before, for another request.
    KeyTaken,
    /// The mission is deleted.
    MissionGone,
    /// The mission has events that the caller does not know.
    OutOfSequence,
    /// The missions of the client who made it have their share of the disk.
    ShareUsed,
}
