use std::collections::HashMap;
use std::fs;
use std::os::unix::fs::{PermissionsExt as _, symlink};
use std::path::Path;
use std::time::Duration;

use super::{files::private_file, *};
use clock::Clock;

/// The mission whose appends make the writer panic.
pub(super) const PANICS: &str = "panics";

fn event(sequence: u64, body: &str) -> StoredEvent {
    StoredEvent { sequence, kind: "reported".to_owned(), body: body.as_bytes().into() }
}

fn append(mission: &str, events: Vec<StoredEvent>) -> Append {
    Append {
        mission: mission.to_owned(),
        // Tests continue only the first mission.
        number: events.first().filter(|event| 1 < event.sequence).map(|_| 1),
        events,
        status: "running".to_owned(),
        summary: b"{}".to_vec(),
        snapshot: Some(b"{}".to_vec()),
        room: Room::Share,
        ..Append::default()
    }
}

fn directory() -> tempfile::TempDir {
    tempfile::tempdir().expect("is made")
}

fn open(directory: &Path) -> EventStore {
    EventStore::open(directory, &clock()).expect("opens")
}

/// Bodies of all events; the reader has checked their numbers.
fn bodies(store: &EventStore, id: &str) -> Vec<Vec<u8>> {
    let reader = store.reader().expect("opens");
    let mission = reader.mission(id).expect("reads").expect("is there");
    let events = reader.events(mission.number, 0, usize::MAX).expect("reads");
    events.into_iter().map(|event| event.body.to_vec()).collect()
}

async fn add(store: &EventStore, append: Append) {
    assert_eq!(store.append(append).await.expect("is stored"), Appended::Stored);
}

async fn delete(store: &EventStore, id: &str) -> Result<bool, StoreError> {
    store.delete(id.to_owned(), AuditEntry::default()).await
}

/// A new store with a mission `a` of one event.
async fn with_a(directory: &Path, body: &str) -> EventStore {
    let store = open(directory);
    add(&store, append("a", vec![event(1, body)])).await;
    store
}

/// The text of the fault that a probe finds.
async fn fault(store: &EventStore) -> String {
    store.probe().await.expect_err("has a fault").to_string()
}

/// Closes a store, whose write-ahead file is then merged.
async fn close(store: EventStore) {
    store.close().await.expect("is closed");
    drop(store);
}

/// A store of this directory as an earlier program left it, at this version and with this content.
fn of_version(directory: &Path, version: usize, content: &str) {
    let mut connection = Connection::open(directory.join(FILE_NAME)).expect("opens");
    for version in 0..version {
        schema::step(&mut connection, version);
    }
    connection.execute_batch(content).expect("is written");
}

/// Limits the pages of a file, like a full disk.
fn limit_growth(connection: &Connection, pages: u32) {
    let limited = connection.pragma_update_and_check(None, "max_page_count", pages, |_| Ok(()));
    limited.expect("is a number");
}

fn mode(path: &Path) -> u32 {
    fs::metadata(path).expect("is there").permissions().mode() & 0o777
}

/// A machine that was just switched on.
fn clock() -> Clock {
    Clock::simulated(1.8e9)
}

/// Waits until no writer has work left: only then does simulated time pass.
async fn settle() {
    clock().sleep(Duration::from_millis(1)).await;
}

/// Opens a store after the writer of another handle has ended.
async fn open_again(directory: &Path) -> EventStore {
    settle().await;
    open(directory)
}

#[tokio::test(start_paused = true)]
async fn a_panic_of_the_writer_loses_only_the_interrupted_commit() {
    let directory = directory();
    let store = EventStore::open_with(directory.path(), 10_000, &clock()).expect("opens");
    add(&store, append("a", vec![event(1, "one")])).await;
    for sequence in 2..=4 {
        // In one commit or two: acknowledged events are stored, and stored exactly once.
        let panics = store.append(append(PANICS, vec![event(1, "x")]));
        let (panicked, other) = tokio::join!(panics, store.append(append("a", vec![event(sequence, "y")])));
        assert_eq!(panicked, Err(StoreError::Unanswered));
        if other == Err(StoreError::Unanswered) {
            add(&store, append("a", vec![event(sequence, "y")])).await;
        }
    }
    store.probe().await.expect("is ready");
    assert_eq!(bodies(&store, "a"), [b"one".as_slice(), b"y", b"y", b"y"]);
    assert_eq!(delete(&store, "a").await, Ok(true));
    drop(store);
    let store = open_again(directory.path()).await;
    store.probe().await.expect("nothing acknowledged is missing");
    let reader = store.reader().expect("opens");
    assert_eq!(reader.mission(PANICS), Ok(None));
}

#[tokio::test(start_paused = true)]
async fn a_store_on_a_full_disk_refuses_appends_and_works_again_once_there_is_space() {
    let directory = directory();
    let path = directory.path().join(FILE_NAME);
    drop(open(directory.path()));
    let connection = Connection::open(&path).expect("opens");
    configure(&connection).expect("is configured");
    limit_growth(&connection, 80);
    let file = private_file(&path).expect("is there");
    let store = EventStore::start(connection, &path, file, u64::MAX, &clock()).expect("starts");
    let mut stored = 0;
    let long = |sequence| append("a", vec![event(sequence, &"x".repeat(5000))]);
    let full = loop {
        match store.append(long(stored + 1)).await {
            Ok(_) => stored += 1,
            full => break full,
        }
    };
    assert_eq!(full, Err(StoreError::Full));
    assert!(0 < stored && stored < 80);
    assert_eq!(u64::try_from(bodies(&store, "a").len()).expect("small"), stored);
    assert_eq!(store.probe().await, Err(StoreError::Full));
    assert_eq!(delete(&store, "a").await, Ok(true));
    // Pages are freed step by step.
    settle().await;
    add(&store, append("b", vec![event(1, &"y".repeat(5000))])).await;
    assert_eq!(bodies(&store, "b").len(), 1);
    store.probe().await.expect("has room again");
}

#[tokio::test(start_paused = true)]
async fn a_log_of_a_newer_program_is_refused_and_not_changed() {
    let directory = directory();
    drop(open(directory.path()));
    of_version(directory.path(), 0, "PRAGMA user_version = 99");
    settle().await;
    let opened = EventStore::open(directory.path(), &clock()).map(drop);
    for refused in [opened, EventReader::of(directory.path()).map(drop)] {
        let is_newer = matches!(refused, Err(StoreError::TooNew(_, 99, _)));
        assert!(is_newer, "{refused:?}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_log_of_the_first_schema_is_migrated_with_its_content() {
    let directory = directory();
    of_version(
        directory.path(),
        1,
        "INSERT INTO missions VALUES (1, 'a', 'running', x'7b7d');
         INSERT INTO events VALUES (1, 1, 'created', x'31'), (1, 2, 'reported', x'32');
         INSERT INTO snapshots VALUES (1, 2, x'7b7d');
         INSERT INTO answered VALUES (1, 'k', zeroblob(32), x'33');",
    );
    let refused = EventReader::of(directory.path()).expect_err("is too old to read as it is");
    let refused = refused.to_string();
    assert!(refused.contains("start the service once"), "{refused}");
    let store = open(directory.path());
    assert_eq!(bodies(&store, "a"), [b"1", b"2"]);
    let reader = store.reader().expect("opens");
    assert_eq!(reader.snapshot(1).expect("is whole"), Some((2, b"{}".to_vec())));
    assert_eq!(reader.last_sequence(1), Ok(2));
    assert_eq!(reader.damage(true), Ok(vec![]));
    let again = KeyedAnswer { key: "k".to_owned(), request: [0; 32], answer: b"again".to_vec() };
    let again = Append { answered: Some(again), ..append("a", vec![event(3, "x")]) };
    let known = store.append(again).await;
    assert_eq!(known, Ok(Appended::AnsweredBefore(b"3".to_vec())));
    add(&store, append("a", vec![event(3, "on")])).await;
}

#[test]
fn on_a_full_disk_a_log_is_migrated_completely_or_not_at_all() {
    let directory = directory();
    let mission = "INSERT INTO missions VALUES (1, 'a', 'running', x'7b7d', x'')";
    of_version(directory.path(), 4, mission);
    let path = directory.path().join(FILE_NAME);
    let mut connection = Connection::open(&path).expect("opens");
    let version = |connection: &Connection| {
        let found = connection.pragma_query_value(None, "user_version", |row| row.get::<_, u32>(0));
        found.expect("is a number")
    };
    // The limit cannot be below the present number of pages.
    limit_growth(&connection, 1);
    assert_eq!(schema::migrate(&mut connection, &path), Err(StoreError::Full));
    assert_eq!(version(&connection), 4);
    limit_growth(&connection, u32::MAX - 1);
    schema::migrate(&mut connection, &path).expect("has room");
    assert_eq!(version(&connection), 9);
}

#[tokio::test(start_paused = true)]
async fn a_file_that_is_no_log_is_refused_and_keeps_its_content_and_mode() {
    type Make<'a> = &'a dyn Fn(&Path);
    let directory = directory();
    let elsewhere = directory.path().join("elsewhere");
    let log = directory.path().join(FILE_NAME);
    let text = |path: &Path| fs::write(path, [b'x'; 4096]).expect("is written");
    let database = |path: &Path| {
        let other = Connection::open(path).expect("opens");
        let done = other.execute_batch("CREATE TABLE bookmarks (url)");
        done.expect("is SQL");
    };
    let linked = |path: &Path| {
        text(&elsewhere);
        symlink(&elsewhere, path).expect("is linked");
    };
    let cases: [(Make<'_>, &str); 3] =
        [(&text, "not a database"), (&database, "another program"), (&linked, "symbolic link")];
    for (make, why) in cases {
        make(&log);
        fs::set_permissions(&log, fs::Permissions::from_mode(0o644)).expect("is set");
        let before = fs::read(&log).expect("is there");
        let refused = EventStore::open(directory.path(), &clock()).expect_err("is no log");
        assert!(refused.to_string().contains(why), "{refused}");
        assert_eq!(fs::read(&log).expect("is there"), before, "{why}");
        assert_eq!(mode(&log), 0o644, "{why}");
        fs::remove_file(&log).expect("is removed");
    }
}

#[tokio::test(start_paused = true)]
async fn an_event_missing_from_an_older_log_is_named_after_its_migration() {
    let directory = directory();
    of_version(
        directory.path(),
        7,
        "INSERT INTO missions VALUES (1, 'a', 'running', x'7b7d', '', 0, NULL);
         INSERT INTO events VALUES (1, 1, 'created', x'31'), (1, 3, 'reported', x'33');
         INSERT INTO snapshots VALUES (1, 1, x'7b7d');",
    );
    let reader = open(directory.path()).reader().expect("opens");
    assert_eq!(reader.damage(true), Ok(vec!["mission a: event 2 is missing".to_owned()]));
    assert_eq!(reader.snapshot(1).expect("is whole"), Some((1, b"{}".to_vec())));
}

#[tokio::test(start_paused = true)]
async fn a_closed_log_needs_no_write_ahead_file_and_an_emptied_one_is_refused() {
    let directory = directory();
    let path = directory.path().join(FILE_NAME);
    let ahead = directory.path().join(format!("{FILE_NAME}-wal"));
    let store = with_a(directory.path(), "x").await;
    // The files of a copy of a running service whose main file was emptied.
    let emptied = tempfile::tempdir().expect("is made");
    fs::copy(&ahead, emptied.path().join(format!("{FILE_NAME}-wal"))).expect("is copied");
    fs::write(emptied.path().join(FILE_NAME), []).expect("is written");
    let refused = EventStore::open(emptied.path(), &clock()).expect_err("lost a mission");
    assert!(refused.to_string().contains("is empty or missing"), "{refused}");

    store.close().await.expect("is closed");
    assert_eq!(store.append(append("b", vec![])).await, Err(StoreError::Closed));
    let alone = tempfile::tempdir().expect("is made");
    fs::copy(&path, alone.path().join(FILE_NAME)).expect("is copied");
    assert_eq!(bodies(&open(alone.path()), "a"), [b"x"]);
}

#[tokio::test(start_paused = true)]
async fn only_the_service_s_user_may_read_the_log() {
    let directory = directory();
    let made = directory.path().join("made");
    let _store = with_a(&made, "x").await;
    assert_eq!(mode(&made), 0o700);
    for name in [FILE_NAME.to_owned(), format!("{FILE_NAME}-wal")] {
        assert_eq!(mode(&made.join(&name)), 0o600, "{name}");
    }
}

#[tokio::test(start_paused = true)]
async fn the_file_shrinks_after_a_mission_is_deleted() {
    let directory = directory();
    let store = open(directory.path());
    let long = "x".repeat(10_000);
    add(&store, append("a", (1..=400).map(|k| event(k, &long)).collect())).await;
    let pages = || -> i64 {
        let reader = store.reader().expect("opens");
        let file = reader.0.file().expect("is a file");
        file.query_row("PRAGMA page_count", [], |row| row.get(0)).expect("reads")
    };
    let full = pages();
    assert_eq!(delete(&store, "a").await, Ok(true));
    settle().await;
    assert!(pages() < full / 10, "{full} pages became {}", pages());
}

#[tokio::test(start_paused = true)]
async fn closing_a_log_during_a_read_reports_that_the_write_ahead_file_stays() {
    let directory = directory();
    let store = with_a(directory.path(), "x").await;
    let reader = store.reader().expect("opens");
    let file = reader.0.file().expect("is a file");
    let begun = file.execute_batch("BEGIN; SELECT * FROM missions");
    begun.expect("reads");
    assert_eq!(store.close().await, Err(StoreError::Busy));
}

#[tokio::test(start_paused = true)]
async fn appends_wait_for_a_lock_of_another_program_and_name_a_lasting_one() {
    let directory = directory();
    let store = with_a(directory.path(), "x").await;
    let other = Connection::open(directory.path().join(FILE_NAME)).expect("opens");
    other.execute_batch("BEGIN IMMEDIATE").expect("locks");
    // Three appends wait together.
    let (first, second, deleted) = tokio::join!(
        store.append(append("a", vec![event(2, "y")])),
        store.append(append("b", vec![event(1, "y")])),
        delete(&store, "a"),
    );
    for refused in [first.map(drop), second.map(drop), deleted.map(drop)] {
        assert_eq!(refused, Err(StoreError::Locked));
    }
    let said = StoreError::Locked.to_string();
    assert!(said.contains("another program has locked"), "{said}");
    // A lock that is released while an append waits costs nothing.
    tokio::join!(add(&store, append("a", vec![event(2, "y")])), async {
        other.execute_batch("ROLLBACK").expect("unlocks");
    });
}

#[tokio::test(start_paused = true)]
async fn a_backup_during_writes_is_a_complete_log() {
    let directory = directory();
    let store = with_a(directory.path(), "1").await;
    let writer = tokio::spawn({
        let store = store.clone();
        async move {
            for k in 2..400 {
                add(&store, append("a", vec![event(k, "2")])).await;
            }
        }
    });
    let to = directory.path().join("copy");
    let (reader, copy) = (store.reader().expect("opens"), to.clone());
    let machine = clock();
    let copied = machine.run_blocking(move || {
        assert_eq!(reader.back_up(&copy).expect("is copied"), [""; 0]);
        reader.back_up(&copy).expect_err("is there already")
    });
    let again = copied.await.expect("does not panic");
    assert!(again.to_string().contains("choose another directory"), "{again}");
    writer.await.expect("is stored");
    let (whole, copied) = (bodies(&store, "a"), bodies(&open(&to), "a"));
    assert!(whole.starts_with(&copied) && !copied.is_empty());
    let partial = |name: &String| name.contains("partial");
    assert_eq!(files_of_a_killed(&to).keys().find(|name| partial(name)), None);
}

#[tokio::test(start_paused = true)]
async fn a_vacuum_frees_space_that_an_older_log_keeps() {
    let directory = directory();
    let file = directory.path().join(FILE_NAME);
    // A file whose first table was created without it has no incremental vacuum.
    let older = Connection::open(&file).expect("opens");
    older.execute_batch("CREATE TABLE first (x); DROP TABLE first").expect("is SQL");
    drop(older);
    let size = || fs::metadata(&file).expect("is there").len();

    let store = open(directory.path());
    let big = Append { summary: vec![b' '; 1 << 20], ..append("a", vec![]) };
    store.append(big).await.expect("is stored");
    assert_eq!(delete(&store, "a").await, Ok(true));
    close(store).await;
    assert!(1 << 20 < size(), "only a vacuum gives the room back");

    let store = open_again(directory.path()).await;
    store.vacuum().await.expect("has room");
    store.close().await.expect("ends");
    assert!(size() < 1 << 18, "{} bytes are left", size());
}

/// The files of a store whose service was just killed.
fn files_of_a_killed(directory: &Path) -> HashMap<String, Vec<u8>> {
    let entries = fs::read_dir(directory).expect("is there");
    entries
        .map(|entry| {
            let entry = entry.expect("is there");
            let bytes = fs::read(entry.path()).expect("is read");
            (entry.file_name().into_string().expect("is text"), bytes)
        })
        .filter(|(name, _)| !name.ends_with("-shm"))
        .collect()
}

fn written(files: &HashMap<String, Vec<u8>>) -> tempfile::TempDir {
    let directory = directory();
    for (name, bytes) in files {
        fs::write(directory.path().join(name), bytes).expect("is written");
    }
    directory
}

#[tokio::test(start_paused = true)]
async fn losses_of_a_damaged_write_ahead_file_are_named_until_a_person_has_read_them() {
    const EVENTS: u64 = 120;
    let running = directory();
    let store = open(running.path());
    for sequence in 1..=EVENTS {
        add(&store, append("a", vec![event(sequence, &"1".repeat(500))])).await;
    }
    let whole = files_of_a_killed(running.path());
    let ahead = format!("{FILE_NAME}-wal");
    let wal = &whole[&ahead];
    let mut flipped = wal.clone();
    flipped[wal.len() / 2] ^= 1;
    // A byte of the last event: all earlier commits are whole.
    let torn = wal.windows(99).rposition(|bytes| bytes == [b'1'; 99]);
    let mut torn = wal[..torn.expect("it has the last event")].to_vec();
    torn.extend([0xAA; 20]);
    for (expected, damaged) in [
        (Some(EVENTS), Some(wal.clone())),
        (None, Some(wal[..wal.len() / 2 - 1000].to_vec())),
        (Some(EVENTS - 1), Some(torn)),
        (None, Some(flipped)),
        (None, Some(vec![])),
        (None, None),
    ] {
        let mut files = whole.clone();
        match damaged {
            Some(bytes) => drop(files.insert(ahead.clone(), bytes)),
            None => drop(files.remove(&ahead)),
        }
        let killed = written(&files);
        let store = open(killed.path());
        let found = store.probe().await;
        if expected == Some(EVENTS) {
            assert_eq!(found, Ok(()));
            assert_eq!(bodies(&store, "a").len() as u64, EVENTS);
            continue;
        }
        let reader = store.reader().expect("opens");
        let left = reader.last_sequence(1).expect("reads");
        assert!(expected.is_none_or(|expected| left == expected), "{left}");
        if 0 < left {
            assert_eq!(bodies(&store, "a").len() as u64, left);
        }
        let (n_lost, first) = (EVENTS - left, left + 1);
        let lost = format!("{n_lost} events of mission a from {first} to {EVENTS}");
        let found = found.expect_err("events are missing").to_string();
        assert!(found.contains(&lost), "{lost}: {found}");
        // A second start neither forgets nor repeats the loss.
        drop((store, reader));
        let store = open_again(killed.path()).await;
        let found = fault(&store).await;
        assert_eq!(found.matches(&lost).count(), 1, "{found}");
        fs::remove_file(killed.path().join(LOST_NAME)).expect("is there");
        assert_eq!(store.probe().await, Ok(()));
    }
}

#[tokio::test(start_paused = true)]
async fn a_deletion_lost_with_the_write_ahead_file_is_named() {
    let running = directory();
    let store = with_a(running.path(), "1").await;
    close(store).await;
    let store = open_again(running.path()).await;
    assert_eq!(delete(&store, "a").await, Ok(true));
    let mut files = files_of_a_killed(running.path());
    files.remove(&format!("{FILE_NAME}-wal"));
    let killed = written(&files);
    let found = fault(&open(killed.path())).await;
    assert!(found.contains("the deletion of mission a"), "{found}");
}

#[tokio::test(start_paused = true)]
async fn events_missing_from_an_older_copy_of_the_store_are_named() {
    let directory = directory();
    let path = directory.path().join(FILE_NAME);
    let store = open(directory.path());
    add(&store, append("a", vec![event(1, "1"), event(2, "2")])).await;
    close(store).await;
    let older = fs::read(&path).expect("is there");
    let store = open_again(directory.path()).await;
    add(&store, append("a", vec![event(3, "3"), event(4, "4")])).await;
    add(&store, append("b", vec![event(1, "1")])).await;
    close(store).await;
    fs::write(&path, older).expect("is written");
    let store = open_again(directory.path()).await;
    let found = fault(&store).await;
    assert!(found.contains("2 events of mission a from 3 to 4, "), "{found}");
    assert!(found.contains("1 events of mission b from 1 to 1, "), "{found}");
    fs::remove_file(directory.path().join(LOST_NAME)).expect("is there");
    add(&store, append("a", vec![event(3, "another")])).await;
    drop(store);
    assert_eq!(open_again(directory.path()).await.probe().await, Ok(()));
}

#[tokio::test(start_paused = true)]
async fn a_history_that_differs_from_the_acknowledged_one_is_named() {
    let [one, two] = [directory(), directory()];
    for (place, body) in [(&one, "1"), (&two, "2")] {
        let store = open(place.path());
        add(&store, append("a", vec![event(1, body), event(2, "same")])).await;
        store.close().await.expect("is merged");
    }
    let mut files = files_of_a_killed(one.path());
    let other = files_of_a_killed(two.path()).remove(FILE_NAME).expect("is there");
    files.insert(FILE_NAME.to_owned(), other);
    let found = fault(&open(written(&files).path())).await;
    let differs = "event 2 of mission a is not the one acknowledged";
    assert!(found.contains(differs), "{found}");
}

#[tokio::test(start_paused = true)]
async fn a_lost_cut_or_damaged_list_is_rewritten_from_the_store() {
    let running = directory();
    let store = with_a(running.path(), "1").await;
    store.close().await.expect("is merged");
    let whole = files_of_a_killed(running.path());
    let list = &whole[LIST_NAME];
    let mut flipped = list.clone();
    flipped[list.len() - 100] ^= 1;
    for damaged in [None, Some(vec![]), Some(list[..list.len() - 100].to_vec()), Some(flipped)] {
        let mut files = whole.clone();
        files.remove(LIST_NAME);
        files.extend(damaged.map(|bytes| (LIST_NAME.to_owned(), bytes)));
        let killed = written(&files);
        let store = open(killed.path());
        assert_eq!(store.probe().await, Ok(()));
        add(&store, append("a", vec![event(2, "2")])).await;
        let mut files = files_of_a_killed(killed.path());
        files.insert(FILE_NAME.to_owned(), whole[FILE_NAME].clone());
        files.remove(&format!("{FILE_NAME}-wal"));
        let found = fault(&open(written(&files).path())).await;
        assert!(found.contains("1 events of mission a from 2 to 2"), "{found}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_store_whose_files_were_deleted_or_replaced_acknowledges_nothing() {
    let cases: [fn(&Path); 4] = [
        |data| fs::remove_dir_all(data).expect("is there"),
        |data| fs::rename(data, data.with_extension("before")).expect("is there"),
        |data| {
            fs::rename(data, data.with_extension("before")).expect("is there");
            drop(open(data));
        },
        |data| fs::remove_file(data.join(format!("{FILE_NAME}-wal"))).expect("is there"),
    ];
    for displace in cases {
        let directory = directory();
        let data = directory.path().join("data");
        let store = with_a(&data, "1").await;
        displace(&data);
        let appended = store.append(append("a", vec![event(2, "2")])).await.map(drop);
        let deleted = delete(&store, "a").await.map(drop);
        let (probed, read) = (store.probe().await, store.reader().map(drop));
        for found in [appended, deleted, probed, read] {
            assert!(matches!(found, Err(StoreError::Displaced(..))), "{found:?}");
        }
    }
}

#[tokio::test(start_paused = true)]
async fn a_directory_that_is_put_back_is_used_again() {
    let directory = directory();
    let (data, away) = (directory.path().join("data"), directory.path().join("away"));
    let store = open(&data);
    fs::rename(&data, &away).expect("is there");
    let append = append("a", vec![event(1, "1")]);
    store.append(append.clone()).await.expect_err("is not stored");
    fs::rename(&away, &data).expect("is there");
    add(&store, append).await;
    assert_eq!(bodies(&store, "a"), [b"1"]);
}

#[tokio::test(start_paused = true)]
async fn a_service_that_stops_leaves_the_write_ahead_file_of_the_store_in_its_place() {
    let directory = directory();
    let data = directory.path().join("data");
    let old = with_a(&data, "1").await;
    fs::rename(&data, directory.path().join("before")).expect("is there");
    let new = open(&data);
    add(&new, append("b", vec![event(1, "1")])).await;
    old.close().await.expect("ends");
    drop(old);
    settle().await;
    add(&new, append("c", vec![event(1, "1")])).await;
}

#[tokio::test(start_paused = true)]
async fn the_lock_needs_no_file_of_its_own() {
    let directory = directory();
    let store = open(directory.path());
    for entry in fs::read_dir(directory.path()).expect("is there") {
        let path = entry.expect("is there").path();
        if !path.to_string_lossy().contains(FILE_NAME) {
            fs::remove_file(path).expect("is there");
        }
    }
    let refused = EventStore::open(directory.path(), &clock()).expect_err("is in use");
    assert!(matches!(refused, StoreError::InUse(_)), "{refused}");
    drop(store);
}

/// Three missions of 300 events; the second has a damaged page.
async fn with_a_damaged_page() -> tempfile::TempDir {
    let directory = directory();
    let store = open(directory.path());
    for mission in ["a", "b", "c"] {
        let mark = format!("\"{}\"", mission.repeat(200));
        let events = (1..=300).map(|k| event(k, &mark)).collect();
        let append = Append { summary: br#"{"sequence":300}"#.to_vec(), ..append(mission, events) };
        add(&store, append).await;
    }
    close(store).await;
    let path = directory.path().join(FILE_NAME);
    let mut bytes = fs::read(&path).expect("is there");
    let has = |page: &[u8], letter: u8| page.windows(200).any(|text| text == [letter; 200]);
    let of_b: Vec<&mut [u8]> = bytes
        .chunks_mut(4096)
        .filter(|page| has(page, b'b') && !has(page, b'a') && !has(page, b'c'))
        .collect();
    let middle = of_b.len() / 2;
    of_b.into_iter().nth(middle).expect("has many pages").fill(0xAA);
    fs::write(&path, &bytes).expect("is written");
    directory
}

#[tokio::test(start_paused = true)]
async fn a_backup_of_a_damaged_log_has_every_whole_mission_and_names_the_others() {
    let directory = with_a_damaged_page().await;
    let reader = EventReader::of(directory.path()).expect("opens");
    let to = directory.path().join("copy");
    let found = reader.inspect().expect_err("is damaged");
    assert!(matches!(found, StoreError::Damaged(_)), "{found}");
    let damage = reader.back_up(&to).expect("is copied");
    let rest = fs::read_to_string(to.join(REST_NAME)).expect("is there");
    let n_read = rest.lines().count();
    assert!((250..300).contains(&n_read), "{n_read} events");
    let named = format!("mission b: {n_read} of 300 events can be read, and are in {REST_NAME}");
    assert_eq!(damage, [named]);
    let copy = open(&to);
    assert_eq!(copy.probe().await, Ok(()));
    copy.inspect();
    assert_eq!(copy.probe().await, Ok(()));
    for mission in ["a", "c"] {
        assert_eq!(bodies(&copy, mission).len(), 300);
    }
    let salt = |reader: &EventReader| reader.salt().expect("is read");
    assert_eq!(salt(&copy.reader().expect("opens")), salt(&reader));
}

#[tokio::test(start_paused = true)]
async fn a_damaged_event_blocks_no_backup_and_its_report_ends_with_its_mission() {
    let directory = directory();
    let store = open(directory.path());
    for mission in ["a", "b"] {
        add(&store, append(mission, vec![event(1, "1"), event(2, "2")])).await;
    }
    let connection = Connection::open(directory.path().join(FILE_NAME)).expect("opens");
    let damage = "UPDATE events SET body = x'00' WHERE mission = 2 AND sequence = 2";
    connection.execute(damage, []).expect("is done");
    store.inspect();
    let found = fault(&store).await;
    assert!(found.contains("mission b: event 2"), "{found}");
    let to = directory.path().join("copy");
    let damage = store.reader().expect("opens").back_up(&to).expect("is copied");
    assert_eq!(damage, ["mission b: event 2 is not what was stored"]);
    assert_eq!(bodies(&open(&to), "a").len(), 2);

    assert_eq!(delete(&store, "b").await, Ok(true));
    settle().await;
    store.probe().await.expect("the damage went with its mission");
}

#[tokio::test(start_paused = true)]
async fn a_clock_set_ahead_makes_no_mission_old_until_a_person_confirms_it() {
    const YEAR: f64 = 365.0 * 86_400.0;
    let directory = directory();
    let store = open(directory.path());
    let finished = Append { status: "finished".to_owned(), ..append("a", vec![event(1, "1")]) };
    add(&store, finished).await;
    close(store).await;
    // As if the log was created a year ago by the clock, and a moment ago by the kernel.
    let earlier = format!(
        "UPDATE guards SET clock_s = clock_s - {YEAR}, trusted_s = trusted_s - {YEAR};
         UPDATE missions SET over_s = over_s - {YEAR}"
    );
    of_version(directory.path(), 0, &earlier);
    let store = open_again(directory.path()).await;
    let older_than = |days: f64| {
        let reader = store.reader().expect("opens");
        let before_s = store.clock().now_s() - 86_400.0 * days;
        reader.over_before(before_s).expect("reads")
    };
    assert!((store.clock().clock_ahead_s() - YEAR).abs() < 60.0);
    store.read_clocks().await.expect("is stored");
    assert_eq!(older_than(90.0), [""; 0]);
    // The kernel counts in hundredths of a second.
    assert_eq!(older_than(-0.001), ["a"]);
    store.believe_clock().await.expect("is stored");
    assert_eq!(older_than(90.0), ["a"]);
}
