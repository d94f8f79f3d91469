//! Leases of services that share a database: they lapse in real time.

use std::time::Duration;

use clock::Clock;
use store::{Appended, EventStore, StoreError};
use tests::{
    postgres::{database, psql},
    store::{acquired, add, append, at_epoch, event, joined_for, order},
};
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
async fn a_dead_service_loses_its_missions_and_a_live_one_keeps_them() {
    let Some(url) = database() else { return };
    let (one, two) = (joined_for(&url, "one", LEASE), joined_for(&url, "two", LEASE));
    add(&one, append("a", vec![event(1, "made")])).await;
    assert_eq!(acquired(&one), Ok(1));
    sleep(LEASE + LEASE / 2).await;
    assert_eq!(acquired(&two), Err("http://one".to_owned()));
    drop(one);
    let took = until(|| acquired(&two).is_ok()).await;
    // A stall of this machine restarts the wait.
    assert!(LEASE / 2 < took && took < LEASE * 4, "{took:?}");
}

#[tokio::test]
async fn a_service_that_others_consider_dead_restarts() {
    let Some(url) = database() else { return };
    let one = joined_for(&url, "one", LEASE);
    let lease = one.lease().expect("is shared");
    add(&one, append("a", vec![event(1, "made")])).await;
    assert_eq!((lease.incarnation(), acquired(&one)), (Ok(1), Ok(1)));
    let _ = psql(&url, "DELETE FROM services");
    assert_eq!(one.append(at_epoch(1, 2)).await, Ok(Appended::NotOwner));
    until(|| lease.incarnation() == Ok(2)).await;
    assert_eq!(acquired(&one), Ok(2));
    lease.leave().expect("is stored");
    assert_eq!(lease.incarnation(), Err(StoreError::Closed));
    assert_eq!(psql(&url, "SELECT count(*) FROM services"), "0");
}

#[tokio::test]
async fn services_remove_the_events_of_missions_that_another_program_deleted() {
    let Some(url) = database() else { return };
    let (one, two) = (
        joined_for(&url, "one", PATIENCE),
        joined_for(&url, "two", PATIENCE),
    );
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
    let silent = silent
        .local_addr()
        .map(|address| (silent, address))
        .expect("is bound");
    let url = url.replace("127.0.0.1", &format!("{},127.0.0.1", silent.1));
    let begun = Instant::now();
    let store = joined_for(&url, "one", PATIENCE);
    add(&store, append("a", vec![event(1, "made")])).await;
    assert_eq!(acquired(&store), Ok(1));
    // One host after the other, each of the connections would wait a second.
    assert!(begun.elapsed() < 2 * LEASE, "{:?}", begun.elapsed());
}
