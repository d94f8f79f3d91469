//! Leases of services that share a database: they lapse in real time.

use std::time::Duration;

use clock::Clock;
use store::EventStore;
use tests::postgres::{database, psql};
use tests::store::{acquired, add, append, event, joined_for, order};
use tokio::time::{Instant, sleep};

/// A lease that a test lets lapse.
const LEASE: Duration = Duration::from_secs(2);

/// A longer wait fails the test.
const PATIENCE: Duration = Duration::from_mins(1);

/// Waits for the condition; returns the duration.
async fn until(mut is_so: impl FnMut() -> bool) -> Duration {
    let begun = Instant::now();
    while !is_so() {
        assert!(begun.elapsed() < PATIENCE, "it never is so");
        sleep(Duration::from_millis(10)).await;
    }
    begun.elapsed()
}

#[tokio::test]
async fn a_service_waits_for_the_longer_lease_of_another() {
    let Some(url) = database() else { return };
    let slow = joined_for(&url, "slow", LEASE * 2);
    let two = joined_for(&url, "two", LEASE);
    add(&slow, append("a", vec![event(1, "made")])).await;
    assert_eq!(acquired(&slow), Ok(1));
    drop(slow);
    let took = until(|| acquired(&two).is_ok()).await;
    assert!(LEASE * 5 / 4 < took, "{took:?}");
}

#[tokio::test]
async fn services_remove_the_events_of_missions_that_another_program_deleted() {
    let Some(url) = database() else { return };
    let [one, two] = ["one", "two"].map(|name| joined_for(&url, name, PATIENCE));
    add(&one, append("a", (1..=1200).map(|k| event(k, "x")).collect())).await;
    let tool = EventStore::open_database(&url, None, u64::MAX, &Clock::machine()).expect("opens");
    let deleted = tool.delete("a".to_owned(), order("tool", "expire")).await;
    assert_eq!(deleted, Ok(true));
    tool.close().await.expect("ends");
    for service in [&one, &two] {
        service.read_clocks().await.expect("is stored");
    }
    let left = "SELECT (SELECT count(*) FROM missions) + (SELECT count(*) FROM events)";
    until(|| psql(&url, left) == "0").await;
}

#[tokio::test]
async fn a_silent_host_does_not_keep_a_service_from_the_one_that_answers() {
    let Some(url) = database() else { return };
    let silent = std::net::TcpListener::bind("127.0.0.1:0").expect("a port is free");
    let address = silent.local_addr().expect("is bound");
    // One after the other, the silent ones would use up the time for a connection.
    let url = url.replace("127.0.0.1", &format!("{address},{address},{address},127.0.0.1"));
    let store = joined_for(&url, "one", PATIENCE);
    add(&store, append("a", vec![event(1, "made")])).await;
    assert_eq!(acquired(&store), Ok(1));
}
