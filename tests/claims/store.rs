//! Promises of the event store, in a file and in PostgreSQL.

use std::time::Duration;

use clock::Clock;
use futures_util::future::join_all;
use service::{Settings, service};
use store::{
    Append, Appended, Copied, EventReader, EventStore, FILE_NAME, KeyedAnswer, Member, Room, StoreError,
    StorePlace, StoredEvent, Trouble, copy,
};
use tempfile::TempDir;
use tests::{
    client::{START_S, post, send_to, with},
    postgres::{authority, database, psql},
    server::certificate,
    store::{acquired, add, append, at_epoch, event, joined_for, order},
};
use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use tokio::net::TcpListener;
use tokio::task::yield_now;

/// A place for a store, which is opened several times.
enum Place {
    /// On a simulated machine.
    File(TempDir, Clock),
    Database(String),
}

impl Place {
    fn file(clock: Clock) -> Self {
        Self::File(tempfile::tempdir().expect("is made"), clock)
    }

    fn database() -> Option<Self> {
        database().map(Self::Database)
    }

    /// Opens a store whose writer may still be ending: simulated time passes once it has ended.
    async fn open_with(&self, share: u64) -> EventStore {
        let opened = match self {
            Self::File(directory, clock) => {
                clock.sleep(Duration::from_millis(1)).await;
                EventStore::open_with(directory.path(), share, clock)
            }
            Self::Database(url) => EventStore::open_database(url, None, share, &Clock::machine()),
        };
        opened.expect("opens")
    }

    async fn open(&self) -> EventStore {
        self.open_with(u64::MAX).await
    }

    /// Changes stored data, like damage.
    fn change(&self, statements: &str) {
        match self {
            Self::File(directory, _) => {
                let file = rusqlite::Connection::open(directory.path().join(FILE_NAME));
                file.and_then(|file| file.execute_batch(statements)).expect("is done");
            }
            Self::Database(url) => drop(psql(url, statements)),
        }
    }
}

/// Each claim is a test of both stores.
macro_rules! of_both_stores {
    ($($claim:ident)*) => {
        mod in_a_file {
            use super::{Clock, Place, START_S};
            $(#[tokio::test(start_paused = true)] async fn $claim() {
                super::$claim(Place::file(Clock::simulated(START_S))).await;
            })*
        }
        mod in_postgres {
            use super::Place;
            $(#[tokio::test] async fn $claim() {
                if let Some(place) = Place::database() { super::$claim(place).await; }
            })*
        }
    };
}

of_both_stores! {
    acknowledged_events_are_there_after_a_restart
    waiting_appends_share_a_commit_and_only_a_bad_one_fails
    a_key_belongs_to_one_request
    an_append_out_of_sequence_stores_nothing
    a_deleted_mission_is_gone_at_once_and_its_number_is_not_reused
    a_client_beyond_its_share_stores_nothing_and_others_still_do
    orders_are_listed_page_by_page
    ages_count_from_a_stored_time
    every_change_of_stored_data_is_named
    an_open_store_that_is_set_back_stores_nothing_more
    a_store_whose_count_of_probes_falls_was_set_back
}

/// Key of a caller with a token.
const KEY: &str = "caller\0key";

fn keyed(sequence: u64, request: u8, answer: &str) -> Append {
    Append {
        answered: Some(KeyedAnswer {
            key: KEY.to_owned(),
            request: [request; 32],
            answer: answer.as_bytes().to_vec(),
        }),
        ..append("a", vec![event(sequence, "x")])
    }
}

async fn delete(store: &EventStore, mission: &str) -> Result<bool, StoreError> {
    store.delete(mission.to_owned(), order("one", "delete")).await
}

/// Bodies of all events, whose numbers the reader has checked.
fn bodies(store: &EventStore, id: &str) -> Vec<String> {
    let reader = store.reader().expect("opens");
    let mission = reader.mission(id).expect("reads").expect("is there");
    let events = reader.events(mission.number, 0, usize::MAX).expect("reads");
    let text = |event: StoredEvent| String::from_utf8_lossy(&event.body).into_owned();
    events.into_iter().map(text).collect()
}

async fn acknowledged_events_are_there_after_a_restart(place: Place) {
    let store = place.open().await;
    for sequence in 1..=3 {
        add(&store, append("a", vec![event(sequence, &sequence.to_string())])).await;
    }
    drop(store);
    let store = place.open().await;
    assert_eq!(bodies(&store, "a"), ["1", "2", "3"]);
    let reader = store.reader().expect("opens");
    assert_eq!(reader.snapshot(1), Ok(Some((3, b"{}".to_vec()))));
    assert_eq!(reader.last_sequence(1), Ok(3));
    let last = reader.last_of_kind(1, "reported", 2).expect("reads");
    assert_eq!(last, Some(event(2, "2")));
}

async fn waiting_appends_share_a_commit_and_only_a_bad_one_fails(place: Place) {
    let store = place.open().await;
    add(&store, append("a", vec![event(1, "one")])).await;
    // The same number twice in one mission, among many right ones.
    let all = (0..100_u32).map(|k| match k {
        50 => append("a", vec![event(2, "two"), event(2, "again")]),
        _ => append(&format!("m{k}"), vec![event(1, "x"), event(2, "y")]),
    });
    let stored = join_all(all.map(|append| store.append(append))).await;
    let failed = (0..100).filter(|k| stored[*k].is_err());
    assert_eq!(failed.collect::<Vec<_>>(), [50]);
    assert_eq!(bodies(&store, "a"), ["one"]);
    assert_eq!(bodies(&store, "m99"), ["x", "y"]);
    store.probe().await.expect("is ready");
}

async fn a_key_belongs_to_one_request(place: Place) {
    let store = place.open().await;
    add(&store, keyed(1, 1, "first")).await;
    let again = store.append(keyed(2, 1, "second")).await;
    assert_eq!(again, Ok(Appended::AnsweredBefore(b"first".to_vec())));
    let other = store.append(keyed(2, 2, "second")).await;
    assert_eq!(other, Ok(Appended::KeyTaken));
    assert_eq!(bodies(&store, "a").len(), 1);
    let reader = store.reader().expect("opens");
    assert_eq!(reader.answered("a", KEY), Ok(Some(([1; 32], b"first".to_vec()))));
    assert_eq!(reader.answered("a", "other"), Ok(None));
}

async fn an_append_out_of_sequence_stores_nothing(place: Place) {
    let store = place.open().await;
    add(&store, append("a", vec![event(1, "one"), event(2, "two")])).await;
    for sequence in [2, 4] {
        let late = store.append(append("a", vec![event(sequence, "late")])).await;
        assert_eq!(late, Ok(Appended::OutOfSequence));
    }
    assert_eq!(bodies(&store, "a"), ["one", "two"]);
}

async fn a_deleted_mission_is_gone_at_once_and_its_number_is_not_reused(place: Place) {
    let store = place.open().await;
    add(&store, append("a", (1..=1200).map(|k| event(k, "x")).collect())).await;
    add(&store, append("b", vec![event(1, "y")])).await;
    assert_eq!(delete(&store, "a").await, Ok(true));
    assert_eq!(delete(&store, "a").await, Ok(false));
    let late = || append("a", vec![event(1201, "late")]);
    assert_eq!(store.append(late()).await, Ok(Appended::MissionGone));
    let reader = store.reader().expect("opens");
    assert_eq!(reader.mission("a"), Ok(None));
    assert_eq!(reader.mission("\0"), Ok(None));
    let (listed, more) = reader.missions(0, 10, 1).expect("reads");
    assert_eq!((listed.len(), &*listed[0].id, more), (1, "b", false));
    // The name is free again.
    add(&store, append("a", vec![event(1, "anew")])).await;
    assert_eq!(store.append(late()).await, Ok(Appended::MissionGone));
    assert_eq!(bodies(&store, "a"), ["anew"]);
    store.vacuum().await.expect("has room");
    assert_eq!(reader.last_sequence(1), Ok(0));
    assert_eq!(bodies(&store, "b"), ["y"]);
}

async fn a_client_beyond_its_share_stores_nothing_and_others_still_do(place: Place) {
    let made = |mission: &str, caller: &str| Append {
        order: Some(order(caller, "create")),
        room: Room::Half,
        ..append(mission, vec![event(1, "made")])
    };
    let long = "x".repeat(700);
    let store = place.open_with(2_000).await;
    add(&store, made("a", "one")).await;
    add(&store, append("a", vec![event(2, &long)])).await;
    add(&store, append("a", vec![event(3, &long)])).await;
    add(&store, keyed(4, 1, "answer")).await;
    let more = store.append(append("a", vec![event(5, &long)])).await;
    assert_eq!(more, Ok(Appended::ShareUsed));
    // A repeated request gets its answer, and the mission itself may still store.
    let again = store.append(keyed(5, 1, "answer")).await;
    assert_eq!(again, Ok(Appended::AnsweredBefore(b"answer".to_vec())));
    let own = Append { room: Room::Any, ..append("a", vec![event(5, &long)]) };
    add(&store, own).await;
    assert_eq!(store.append(made("b", "one")).await, Ok(Appended::ShareUsed));
    add(&store, made("c", "two")).await;
    // Beyond half of it no mission is made.
    let longer = Append { number: Some(2), ..append("c", vec![event(2, &long)]) };
    add(&store, longer).await;
    assert_eq!(store.append(made("d", "two")).await, Ok(Appended::ShareUsed));
    drop(store);
    let store = place.open_with(2_000).await;
    assert_eq!(store.append(made("b", "one")).await, Ok(Appended::ShareUsed));
    assert_eq!(delete(&store, "a").await, Ok(true));
    add(&store, made("b", "one")).await;
    let reader = store.reader().expect("opens");
    for caller in ["one", "two"] {
        assert_eq!(reader.count_open(caller), Ok(1));
    }
}

async fn orders_are_listed_page_by_page(place: Place) {
    let store = place.open().await;
    for (mission, caller) in [("a", "one"), ("b", "two"), ("c", "one")] {
        let made = Append {
            order: Some(order(caller, "create")),
            status: "created".to_owned(),
            ..append(mission, vec![event(1, "made")])
        };
        add(&store, made).await;
    }
    let reader = store.reader().expect("opens");
    let callers = |mission, after, most| -> Vec<String> {
        let orders = reader.orders(mission, after, most).expect("reads");
        orders.into_iter().map(|order| order.caller).collect()
    };
    assert_eq!(callers(None, 0, 2), ["one", "two"]);
    assert_eq!(callers(None, 2, 2), ["one"]);
    assert_eq!(callers(Some("b"), 0, 9), ["two"]);
    assert_eq!(reader.last_orders("c", 3).expect("reads").len(), 1);
    assert_eq!(reader.count_open("one"), Ok(2));
    let (page, more) = reader.missions(1, 1, 1 << 10).expect("reads");
    assert_eq!((&*page[0].id, more), ("b", true));
    assert_eq!(reader.missions_with_status("created").expect("reads").len(), 3);
}

/// Two stores of one database, which make missions at the same time.
#[tokio::test(flavor = "multi_thread")]
async fn a_reader_after_a_number_misses_no_event_of_two_services() {
    const EACH: usize = 100;
    let Some(url) = database() else { return };
    let made = ["one", "two"].map(|caller| {
        let store = EventStore::open_database(&url, None, u64::MAX, &Clock::machine()).expect("opens");
        tokio::spawn(async move {
            for number in 0..EACH {
                let mission = Append {
                    order: Some(order(caller, "create")),
                    ..append(&format!("{caller}-{number}"), vec![event(1, "made")])
                };
                add(&store, mission).await;
            }
        })
    });
    let reader = EventReader::of_database(&url).expect("opens");
    let ((mut n_orders, mut last_order), (mut n_missions, mut last_mission)) = ((0, 0), (0, 0));
    loop {
        let are_made = made.iter().all(tokio::task::JoinHandle::is_finished);
        let orders = reader.orders(None, last_order, 9).expect("reads");
        let (missions, _) = reader.missions(last_mission, 9, 1 << 20).expect("reads");
        (n_orders, n_missions) = (n_orders + orders.len(), n_missions + missions.len());
        last_order = orders.last().map_or(last_order, |order| order.number);
        last_mission = missions.last().map_or(last_mission, |mission| mission.number);
        if are_made && orders.is_empty() && missions.is_empty() {
            break;
        }
    }
    assert_eq!((n_orders, n_missions), (2 * EACH, 2 * EACH));
}

async fn ages_count_from_a_stored_time(place: Place) {
    let store = place.open().await;
    let finished = Append { status: "finished".to_owned(), ..append("a", vec![event(1, "1")]) };
    add(&store, finished).await;
    store.protect().await.expect("is stored");
    store.read_clocks().await.expect("is stored");
    let now = store.clock().now_s();
    drop(store);
    let store = place.open().await;
    // The kernel of the database's machine counts hundredths of a second.
    assert!(now - 0.1 <= store.clock().now_s());
    let reader = store.reader().expect("opens");
    assert_eq!(reader.is_protected(), Ok(true));
    assert_eq!(reader.over_before(now + 1.0).expect("reads"), ["a"]);
    assert_eq!(reader.over_before(now - 60.0).expect("reads"), [""; 0]);
}

/// Faults in the missions `a` and `b` that readers find.
fn faults(store: &EventStore) -> Vec<String> {
    let reader = store.reader().expect("opens");
    let found = ["a", "b"].into_iter().flat_map(|id| {
        let mission = reader.mission(id).expect("reads").expect("is there");
        [
            mission.summary().map(drop),
            reader.last_sequence(mission.number).map(drop),
            reader.events(mission.number, 0, usize::MAX).map(drop),
            reader.snapshot(mission.number).map(drop),
        ]
    });
    let found = found.filter_map(Result::err).map(|error| error.to_string());
    let mut found: Vec<String> = found.collect();
    found.dedup();
    found
}

async fn every_change_of_stored_data_is_named(place: Place) {
    let store = place.open().await;
    for id in ["a", "b"] {
        let events = (1..=4).map(|k| event(k, &format!("{id}{k}")));
        add(&store, append(id, events.collect())).await;
    }
    place.change("CREATE TABLE whole AS SELECT * FROM events");
    place.change("CREATE TABLE whole_states AS SELECT * FROM snapshots");
    let damaged = |what: &str| format!("the mission log is damaged: mission {what}");
    let a = |what: &str| damaged(&format!("a: {what}"));
    let of_b = "(SELECT body FROM whole WHERE mission = 2 AND sequence = 2)";
    // `2nd`: of event 2 of mission a.
    let table = "
        UPDATE events SET body = OF_B 2nd | event 2 is not what was stored
        UPDATE events SET kind = 'planned' 2nd | event 2 is not what was stored
        UPDATE events SET digest = (SELECT digest FROM whole WHERE mission = 1 AND sequence = 3) 2nd | event 2 is not what was stored
        UPDATE events SET sequence = 9 2nd; UPDATE events SET sequence = 2 WHERE mission = 1 AND sequence = 3; UPDATE events SET sequence = 3 WHERE mission = 1 AND sequence = 9 | event 2 is not what was stored
        DELETE FROM events WHERE mission = 1 AND sequence = 1 | event 1 is missing
        DELETE FROM events 2nd | event 2 is missing
        DELETE FROM events WHERE mission = 2 AND sequence = 2; UPDATE events SET mission = 2 2nd | event 2 is missing, b: event 2 is not what was stored
        UPDATE snapshots SET body = OF_B WHERE mission = 1 | its checkpoint at event 4 is not what was stored
        UPDATE snapshots SET sequence = 3 WHERE mission = 1 | its checkpoint at event 3 is not what was stored
    ";
    for row in table.trim().lines() {
        let (damage, named) = row.split_once(" | ").expect("is a row");
        let damage = damage.replace("OF_B", of_b);
        place.change(&damage.replace("2nd", "WHERE mission = 1 AND sequence = 2"));
        let named = format!("a: {named}");
        let named: Vec<_> = named.split(", ").map(damaged).collect();
        assert_eq!(faults(&store), named, "{damage}");
        place.change("DELETE FROM events; INSERT INTO events SELECT * FROM whole");
        place.change("DELETE FROM snapshots; INSERT INTO snapshots SELECT * FROM whole_states");
        assert_eq!(faults(&store), [""; 0]);
    }
    // The start of a restart.
    place.change(&format!("UPDATE missions SET summary = {of_b} WHERE number = 1"));
    let named = a("its summary is not what was stored");
    assert_eq!(faults(&store), std::slice::from_ref(&named));
    store.inspect();
    let found = store.probe().await.expect_err("is damaged");
    assert_eq!(found.to_string(), named);
    // Nothing continues a mission whose last event differs.
    let named = a("its last event, 4, is missing or is not what was stored");
    let digest_of_b = "(SELECT digest FROM whole WHERE mission = 2 AND sequence = 4)";
    for damage in [
        "DELETE FROM events WHERE mission = 1 AND sequence = 4".to_owned(),
        format!(
            "INSERT INTO events SELECT mission, sequence, kind, {of_b}, {digest_of_b}
             FROM whole WHERE mission = 1 AND sequence = 4"
        ),
    ] {
        place.change(&damage);
        let refused = store.append(append("a", vec![event(5, "on")])).await;
        assert_eq!(refused.expect_err("is damaged").to_string(), named);
    }
    let last = store.reader().expect("opens").last_sequence(1);
    assert_eq!(last.expect_err("is damaged").to_string(), named);
}

async fn an_open_store_that_is_set_back_stores_nothing_more(place: Place) {
    let store = place.open().await;
    add(&store, append("a", (1..=3).map(|k| event(k, "x")).collect())).await;
    store.probe().await.expect("is whole");
    // The state after event 2.
    place.change(
        "DELETE FROM events WHERE sequence = 3; DELETE FROM snapshots;
         UPDATE missions SET sequence = 2, head = (SELECT digest FROM events WHERE sequence = 2)",
    );
    let refused = store.append(append("a", vec![event(4, "on")])).await;
    let refused = refused.expect_err("it was set back");
    let named = "mission a has events up to 2, and 3 was acknowledged";
    assert!(refused.to_string().contains(named), "{refused}");
    for (mission, sequence) in [("a", 3), ("b", 1)] {
        let on = store.append(append(mission, vec![event(sequence, "on")])).await;
        assert_eq!(on, Err(refused.clone()));
    }
    assert_eq!(store.probe().await, Err(refused));
}

/// Like a service that has none of the missions.
async fn a_store_whose_count_of_probes_falls_was_set_back(place: Place) {
    let store = place.open().await;
    store.probe().await.expect("is whole");
    place.change("UPDATE probes SET count = 0");
    let refused = store.probe().await.expect_err("it was set back");
    assert!(matches!(refused, StoreError::SetBack(_)), "{refused}");
}

/// The server refuses each new event, like a full disk, but changes existing rows.
#[tokio::test]
async fn a_database_without_room_for_events_is_not_ready_until_it_has() {
    let Some(url) = database() else { return };
    let place = Place::Database(url);
    let store = place.open().await;
    add(&store, append("a", vec![event(1, "x")])).await;
    place.change(
        "CREATE FUNCTION full_disk() RETURNS trigger LANGUAGE plpgsql AS
            $$ BEGIN RAISE EXCEPTION 'could not extend file' USING ERRCODE = '53100'; END $$;
         CREATE TRIGGER full_disk BEFORE INSERT ON events FOR EACH ROW EXECUTE FUNCTION full_disk()",
    );
    store.probe().await.expect("nothing was refused yet");
    let more = || append("a", vec![event(2, "y")]);
    assert_eq!(store.append(more()).await, Err(StoreError::Full));
    for _ in 0..2 {
        assert_eq!(store.probe().await, Err(StoreError::Full));
    }
    place.change("DROP TRIGGER full_disk ON events");
    store.probe().await.expect("has room");
    add(&store, more()).await;
    // The attempts left nothing.
    let reader = store.reader().expect("opens");
    let (missions, _) = reader.missions(0, 9, 1 << 10).expect("reads");
    assert_eq!((missions.len(), bodies(&store, "a").len()), (1, 2));
}

/// The database computes what this program checks.
#[tokio::test]
async fn a_database_of_the_first_schema_gets_the_digests_of_its_events() {
    let Some(url) = database() else { return };
    let place = Place::Database(url.clone());
    let store = place.open().await;
    let other = StoredEvent { kind: "größe".to_owned(), ..event(2, "2") };
    add(&store, append("a", vec![event(1, "1"), other, event(3, "3")])).await;
    add(&store, append("b", vec![])).await;
    store.close().await.expect("ends");
    let digests = "SELECT string_agg(digest::text, ',' ORDER BY mission, sequence) FROM events";
    let before = psql(&url, digests);
    place.change(
        "ALTER TABLE events DROP COLUMN digest; ALTER TABLE snapshots DROP COLUMN digest;
         ALTER TABLE missions DROP COLUMN head, DROP COLUMN digest; UPDATE pilotfish_schema SET version = 1",
    );
    let read = EventReader::of_database(&url);
    assert!(matches!(read, Err(StoreError::TooOld(..))));
    let store = place.open().await;
    assert_eq!(psql(&url, digests), before);
    let reader = store.reader().expect("opens");
    assert_eq!(reader.events(1, 0, 9).expect("is whole").len(), 3);
    assert_eq!(reader.snapshot(1), Ok(Some((3, b"{}".to_vec()))));
    for id in ["a", "b"] {
        let mission = reader.mission(id).expect("reads").expect("is there");
        assert_eq!(mission.summary(), Ok(&b"{}"[..]));
        reader.last_sequence(mission.number).expect("is whole");
    }
    add(&store, append("a", vec![event(4, "4")])).await;
}

/// The store of a service in a shared database, with a lease beyond the test.
fn joined(url: &str, name: &str) -> EventStore {
    joined_for(url, name, Duration::from_hours(1))
}

#[tokio::test]
async fn a_service_at_another_s_address_takes_none_of_its_missions() {
    let Some(url) = database() else { return };
    let (one, two) = (joined(&url, "same"), joined(&url, "same"));
    add(&one, append("a", vec![event(1, "made")])).await;
    assert_eq!(acquired(&one), Ok(1));
    assert_eq!(acquired(&two), Err("http://same".to_owned()));
    add(&one, at_epoch(1, 2)).await;
}

/// A stranger among the services of the database, which answers with a redirect.
#[tokio::test]
async fn a_client_s_token_never_goes_to_addresses_from_the_database_alone() {
    let Some(url) = database() else { return };
    let stranger = TcpListener::bind("127.0.0.1:0").await.expect("has a port");
    let address = format!("http://{}", stranger.local_addr().expect("listens"));
    let heard = tokio::spawn(async move {
        let (mut client, _) = stranger.accept().await.expect("is called");
        let mut head = vec![];
        while !head.ends_with(b"\r\n\r\n") {
            head.push(client.read_u8().await.expect("goes on"));
        }
        let redirect = "HTTP/1.1 307 Elsewhere\r\nlocation: http://127.0.0.1:1/\r\ncontent-length: 0\r\n\r\n";
        client.write_all(redirect.as_bytes()).await.expect("listens");
        String::from_utf8_lossy(&head).into_owned()
    });
    let paused = Append { status: "paused".to_owned(), ..append("a", vec![event(1, "made")]) };
    add(&joined(&url, "one"), paused).await;
    let owner = format!(
        "INSERT INTO services (id, url, lease_ms, beat) VALUES ('stranger', '{address}', 3600000, 0);
         UPDATE missions SET owner_service = 'stranger'"
    );
    let _ = psql(&url, &owner);
    let pause = async |peers| {
        let settings = Settings { peers, ..Settings::default() };
        let (router, _missions) = service(settings, joined(&url, "two")).await.expect("starts");
        let request = post("/v1/missions/a/pause", "{}");
        send_to(router, with(request, "authorization", "Bearer secret")).await
    };
    let refused = pause(vec![]).await;
    assert_eq!(refused.problem()["code"], "mission_elsewhere");
    assert!(!heard.is_finished());
    // The operator's configuration names it.
    let redirected = pause(vec![address]).await;
    assert!(heard.await.expect("ends").contains("Bearer secret"));
    assert_eq!(redirected.problem()["code"], "mission_unanswered");
    assert!(!redirected.headers.contains_key("location"));
}

#[tokio::test]
async fn the_database_refuses_appends_of_an_earlier_owner() {
    let Some(url) = database() else { return };
    let (one, two) = (joined(&url, "one"), joined(&url, "two"));
    add(&one, append("a", vec![event(1, "made")])).await;
    assert_eq!(one.append(at_epoch(0, 2)).await, Ok(Appended::NotOwner));
    assert_eq!(acquired(&one), Ok(1));
    assert_eq!(one.append(at_epoch(0, 2)).await, Ok(Appended::NotOwner));
    assert_eq!(acquired(&two), Err("http://one".to_owned()));
    add(&one, at_epoch(1, 2)).await;
    assert_eq!(two.append(at_epoch(1, 3)).await, Ok(Appended::NotOwner));
    let _ = psql(&url, "UPDATE missions SET owner_service = NULL");
    assert_eq!(one.append(at_epoch(1, 3)).await, Ok(Appended::NotOwner));
    assert_eq!(acquired(&two), Ok(2));
    assert_eq!(one.append(at_epoch(1, 3)).await, Ok(Appended::NotOwner));
    add(&two, at_epoch(2, 3)).await;
    assert_eq!(bodies(&one, "a"), ["made", "x", "x"]);
}

#[tokio::test(start_paused = true)]
async fn a_lease_ends_in_time_and_a_lost_one_returns_under_another_number() {
    let Some(url) = database() else { return };
    let clock = Clock::simulated(START_S);
    let millis = Duration::from_millis;
    let member = Member { url: "http://one".to_owned(), lease: millis(2_000) };
    let store = EventStore::open_database(&url, Some(member), u64::MAX, &clock).expect("opens");
    let lease = store.lease().expect("is shared");
    assert_eq!((lease.url(), lease.turn_time()), ("http://one", millis(250)));
    store.trouble(Some(Trouble::NoBeat));
    clock.sleep(millis(1_999)).await;
    assert_eq!(lease.incarnation(), Ok(1));
    clock.sleep(millis(1)).await;
    assert_eq!(lease.incarnation(), Err(StoreError::Lapsed));
    store.trouble(None);
    clock.sleep(millis(300)).await;
    assert_eq!(lease.incarnation(), Ok(1));
    // Another service ends the lease.
    let _ = psql(&url, "DELETE FROM services");
    clock.sleep(millis(300)).await;
    assert_eq!(lease.incarnation(), Ok(2));
    lease.leave().expect("is stored");
    assert_eq!(lease.incarnation(), Err(StoreError::Closed));
}

#[tokio::test]
async fn free_missions_are_shared_out() {
    let Some(url) = database() else { return };
    let one = joined(&url, "one");
    let two = joined(&url, "two");
    for k in 0..5 {
        add(&one, append(&format!("m{k}"), vec![event(1, "made")])).await;
    }
    let turn = |store: &EventStore, most| {
        let lease = store.lease().expect("is shared");
        lease.take_turn(most).expect("is asked")
    };
    assert_eq!(turn(&one, 9).taken.len(), 3);
    assert_eq!(turn(&two, 9).taken.len(), 2);
    let again = turn(&one, 9);
    assert_eq!((again.taken.len(), again.running.len()), (0, 3));
    // A mission more is for the one that has fewer.
    add(&one, append("m5", vec![event(1, "made")])).await;
    assert_eq!(turn(&one, 9).taken.len(), 0);
    assert_eq!(turn(&two, 9).taken.len(), 1);
    two.lease().expect("is shared").leave().expect("is stored");
    // A service without room for all leaves the others to the next.
    assert_eq!(turn(&one, 1).taken.len(), 1);
    assert_eq!(turn(&one, 0).taken.len(), 0);
    assert_eq!(turn(&one, 9).taken.len(), 2);
}

#[test]
fn a_database_of_a_newer_program_is_refused_and_not_changed() {
    let Some(url) = database() else { return };
    drop(EventStore::open_database(&url, None, u64::MAX, &Clock::machine()).expect("opens"));
    let _ = psql(&url, "UPDATE pilotfish_schema SET version = 99");
    let refused = EventStore::open_database(&url, None, u64::MAX, &Clock::machine());
    let is_too_new = matches!(refused, Err(StoreError::TooNew(_, 99, _)));
    assert!(is_too_new, "{refused:?}");
    let read = EventReader::of_database(&url);
    assert!(matches!(read, Err(StoreError::TooNew(..))));
    assert_eq!(psql(&url, "SELECT version FROM pilotfish_schema"), "99");
}

/// Copies once the writers of both places have ended on their threads.
async fn copy_at_rest(from: &StorePlace, to: &StorePlace) -> Result<Copied, StoreError> {
    loop {
        match copy(from, to, &Clock::machine()) {
            Err(StoreError::InUse(_)) => yield_now().await,
            done => return done,
        }
    }
}

#[tokio::test]
async fn a_store_moves_to_a_database_and_back() {
    let Some(url) = database() else { return };
    let (first, last) = (Place::file(Clock::machine()), Place::file(Clock::machine()));
    let store = first.open().await;
    add(&store, keyed(1, 7, "answer")).await;
    add(&store, append("deleted", vec![event(1, "x")])).await;
    let finished = Append {
        status: "finished".to_owned(),
        order: Some(order("one", "create")),
        ..append("c", vec![event(1, "x"), event(2, "y")])
    };
    add(&store, finished).await;
    assert_eq!(delete(&store, "deleted").await, Ok(true));
    let salt = store.reader().expect("opens").salt();
    store.close().await.expect("ends");
    drop(store);
    let path = |place: &Place| match place {
        Place::File(directory, _) => StorePlace::Directory(directory.path().to_owned()),
        Place::Database(url) => StorePlace::Database(url.clone()),
    };
    let between = Place::Database(url);
    for (from, to) in [(&first, &between), (&between, &last)] {
        let (from, to) = (path(from), path(to));
        let copied = copy_at_rest(&from, &to).await.expect("is copied");
        assert_eq!((copied.missions, copied.events), (2, 3));
        let again = copy_at_rest(&from, &to).await.expect_err("has missions");
        let again = again.to_string();
        assert!(again.contains("choose an empty store"), "{again}");
    }
    for place in [&between, &last] {
        let store = place.open().await;
        assert_eq!(bodies(&store, "a"), ["x"]);
        assert_eq!(bodies(&store, "c"), ["x", "y"]);
        let reader = store.reader().expect("opens");
        assert_eq!(reader.salt(), salt);
        assert_eq!(reader.orders(None, 0, 9).expect("reads").len(), 2);
        assert_eq!(reader.over_before(f64::MAX).expect("reads"), ["c"]);
        let again = store.append(keyed(2, 7, "another")).await;
        assert_eq!(again, Ok(Appended::AnsweredBefore(b"answer".to_vec())));
        add(&store, append("new", vec![event(1, "x")])).await;
        let made = store.reader().expect("opens").mission("new").expect("reads");
        assert!(3 < made.expect("is there").number);
        store.close().await.expect("ends");
    }
    // Number 1 is the same mission in every copy.
    between.change("UPDATE events SET kind = 'planned' WHERE mission = 1");
    let refused = copy_at_rest(&path(&between), &path(&Place::file(Clock::machine()))).await;
    let named = "mission a: event 1 is not what was stored".to_owned();
    assert_eq!(refused, Err(StoreError::Damaged(named)));
}

#[test]
fn connections_are_encrypted_to_a_server_with_a_trusted_certificate() {
    let Some((url, authority)) = database().zip(authority()) else { return };
    let verified_by = |file: &str| {
        let url = format!("{url}?sslmode=verify-full&sslrootcert={file}");
        EventStore::open_database(&url, None, u64::MAX, &Clock::machine())
    };
    let _store = verified_by(authority).expect("opens");
    let encrypted = "SELECT bool_and(ssl) FROM pg_stat_ssl JOIN pg_stat_activity USING (pid)
        WHERE datname = current_database() AND application_name = 'pilotfish'";
    assert_eq!(psql(&url, encrypted), "t");
    let folder = tempfile::tempdir().expect("there is room");
    let (another, _) = certificate(folder.path());
    let refused = verified_by(&another).expect_err("another signed it").to_string();
    assert!(refused.contains("certificate"), "{refused}");
}
