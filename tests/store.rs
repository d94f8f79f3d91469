//! Event stores and their appends.

use std::time::Duration;

use clock::Clock;
use store::{Acquired, Append, Appended, AuditEntry, EventStore, Member, Room, StoredEvent};

/// An event of a live mission.
pub fn event(sequence: u64, body: &str) -> StoredEvent {
    StoredEvent { sequence, kind: "reported".to_owned(), body: body.as_bytes().into() }
}

/// Appends to `mission`: a new one if `events` begin with event 1, else the store's first one.
pub fn append(mission: &str, events: Vec<StoredEvent>) -> Append {
    Append {
        mission: mission.to_owned(),
        number: events.first().filter(|event| 1 < event.sequence).map(|_| 1),
        events,
        status: "running".to_owned(),
        summary: b"{}".to_vec(),
        snapshot: Some(b"{}".to_vec()),
        room: Room::Share,
        ..Append::default()
    }
}

/// An order of `caller`.
pub fn order(caller: &str, action: &str) -> AuditEntry {
    AuditEntry { caller: caller.to_owned(), action: action.to_owned(), ..AuditEntry::default() }
}

/// Appends, and sees that it is stored.
pub async fn add(store: &EventStore, append: Append) {
    assert_eq!(store.append(append).await, Ok(Appended::Stored));
}

/// The store of a service with that lease, in a database of several.
pub fn joined_for(url: &str, name: &str, lease: Duration) -> EventStore {
    let url_of_service = format!("http://{name}");
    let member = Member { url: url_of_service, lease };
    EventStore::open_database(url, Some(member), u64::MAX, &Clock::machine()).expect("opens")
}

/// The epoch with which `store` owns the mission `a`; the URL of the owner if it is another.
pub fn acquired(store: &EventStore) -> Result<u64, String> {
    match store.lease().expect("is shared").acquire("a").expect("is asked") {
        Acquired::Here(owned) => Ok(owned.epoch),
        Acquired::At(url) => Err(url),
        Acquired::NoMission => panic!("there is one"),
    }
}

/// Appends an event to the mission `a`, as its owner with that epoch.
pub fn at_epoch(epoch: u64, sequence: u64) -> Append {
    Append { epoch, number: Some(1), ..append("a", vec![event(sequence, "x")]) }
}
