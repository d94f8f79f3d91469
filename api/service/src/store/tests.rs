use std::{fs, path::Path, time::Duration};

use super::*;

fn event(sequence: u64, body: &str) -> StoredEvent {
    StoredEvent {
        sequence,
        kind: "reported".to_owned(),
        body: body.as_bytes().into(),
    }
}

fn append(mission: &str, events: Vec<StoredEvent>) -> Append {
    Append {
        mission: mission.to_owned(),
        // Tests go on with the first mission only.
        number: events.first().filter(|event| 1 < event.sequence).map(|_| 1),
        events,
        status: "running".to_owned(),
        summary: b"{}".to_vec(),
        snapshot: Some(b"{}".to_vec()),
        answered: None,
        order: None,
        room: Room::Share,
    }
}

fn keyed(sequence: u64, key: &str, request: u8, answer: &str) -> Append {
    Append {
        answered: Some(KeyedAnswer {
            key: key.to_owned(),
            request: [request; 32],
            answer: answer.as_bytes().to_vec(),
        }),
        ..append("a", vec![event(sequence, "x")])
    }
}

fn directory() -> tempfile::TempDir {
    tempfile::tempdir().expect("is made")
}

fn open(directory: &Path) -> EventStore {
    EventStore::open(directory).expect("opens")
}

/// Bodies of all events, whose numbers and digests the reader has checked.
fn bodies(store: &EventStore, id: &str) -> Vec<Vec<u8>> {
    let reader = store.reader().expect("opens");
    let mission = reader.mission(id).expect("reads").expect("is there");
    let events = reader.events(mission.number, 0, usize::MAX).expect("reads");
    events.into_iter().map(|event| event.body.to_vec()).collect()
}

async fn add(store: &EventStore, append: Append) {
    assert_eq!(store.append(append).await.expect("is stored"), Appended::Stored);
}

/// Waits until the writer of a dropped store has let go of its file.
fn open_again(directory: &Path) -> EventStore {
    for _ in 0..500 {
        match EventStore::open(directory) {
            Err(StoreError::InUse { .. }) => thread::sleep(Duration::from_millis(10)),
            opened => return opened.expect("opens again"),
        }
    }
    panic!("the log stays in use");
}

#[tokio::test]
async fn what_was_acknowledged_is_there_after_the_log_is_opened_again() {
    let directory = directory();
    let store = open(directory.path());
    for sequence in 1..=3 {
        add(&store, append("a", vec![event(sequence, &sequence.to_string())])).await;
    }
    drop(store);
    assert_eq!(bodies(&open_again(directory.path()), "a"), [b"1", b"2", b"3"]);
}

#[tokio::test]
async fn appends_that_wait_together_are_stored_each_whole_and_a_bad_one_alone_fails() {
    let directory = directory();
    let store = open(directory.path());
    add(&store, append("a", vec![event(1, "one")])).await;
    // The same number twice in one mission, beside many that are right.
    let all = (0..100_u32).map(|k| match k {
        50 => append("a", vec![event(2, "two"), event(2, "again")]),
        _ => append(&format!("m{k}"), vec![event(1, "x"), event(2, "y")]),
    });
    let tasks: Vec<_> = all
        .map(|append| {
            let store = store.clone();
            tokio::spawn(async move { store.append(append).await })
        })
        .collect();
    let mut failed = vec![];
    for (k, task) in tasks.into_iter().enumerate() {
        if task.await.expect("does not panic").is_err() {
            failed.push(k);
        }
    }
    assert_eq!(failed, [50]);
    assert_eq!(bodies(&store, "a"), [b"one"]);
    assert_eq!(bodies(&store, "m99"), [b"x", b"y"]);
}

#[tokio::test]
async fn a_key_is_answered_once_and_stands_for_one_request() {
    let directory = directory();
    let store = open(directory.path());
    add(&store, keyed(1, "k", 1, "first")).await;
    let again = store.append(keyed(2, "k", 1, "second")).await.expect("is known");
    assert_eq!(again, Appended::AnsweredBefore(b"first".to_vec()));
    let other = store.append(keyed(2, "k", 2, "second")).await.expect("is known");
    assert_eq!(other, Appended::KeyTaken);
    assert_eq!(bodies(&store, "a").len(), 1);
}

#[tokio::test]
async fn an_append_out_of_sequence_stores_nothing() {
    let directory = directory();
    let store = open(directory.path());
    add(&store, append("a", vec![event(1, "one"), event(2, "two")])).await;
    for sequence in [2, 4] {
        let late = store.append(append("a", vec![event(sequence, "late")])).await;
        assert_eq!(late, Ok(Appended::OutOfSequence));
    }
    assert_eq!(bodies(&store, "a"), [b"one", b"two"]);
}

#[tokio::test]
async fn a_deleted_mission_is_gone_at_once_takes_nothing_more_and_gives_its_room_back() {
    let directory = directory();
    let store = open(directory.path());
    add(&store, append("a", (1..=5000).map(|k| event(k, "x")).collect())).await;
    add(&store, append("b", vec![event(1, "y")])).await;
    assert!(
        store
            .delete("a".to_owned(), Order::default())
            .await
            .expect("is deleted")
    );
    assert!(
        !store
            .delete("a".to_owned(), Order::default())
            .await
            .expect("is known not to be there")
    );
    let late = store.append(append("a", vec![event(5001, "late")])).await;
    assert_eq!(late, Ok(Appended::MissionGone));
    let reader = store.reader().expect("opens");
    assert_eq!(reader.mission("a").expect("reads"), None);
    assert_eq!(reader.missions(0, 10).expect("reads").len(), 1);
    let left = || -> i64 {
        let count = "SELECT (SELECT count(*) FROM events) + (SELECT count(*) FROM missions)";
        reader.0.query_row(count, [], |row| row.get(0)).expect("reads")
    };
    // The purge goes on by itself.
    for _ in 0..500 {
        if left() == 2 {
            break;
        }
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
    assert_eq!(left(), 2);
    assert_eq!(bodies(&store, "b"), [b"y"]);
    assert_eq!(
        store.append(append("a", vec![event(5001, "late")])).await,
        Ok(Appended::MissionGone)
    );
    // The name is free again.
    add(&store, append("a", vec![event(1, "anew")])).await;
    assert_eq!(bodies(&store, "a"), [b"anew"]);
    // An actor of the mission that had the name before stores nothing in this one.
    assert_eq!(
        store.append(append("a", vec![event(2, "late")])).await,
        Ok(Appended::MissionGone)
    );
    assert_eq!(bodies(&store, "a"), [b"anew"]);
}

#[tokio::test]
async fn a_full_disk_stores_nothing_says_so_and_goes_on_when_there_is_room() {
    let directory = directory();
    let path = directory.path().join(FILE_NAME);
    drop(open(directory.path()));
    let connection = Connection::open(&path).expect("opens");
    configure(&connection).expect("is configured");
    let limit = |connection: &Connection, pages: u32| {
        let set = format!("PRAGMA max_page_count = {pages}");
        connection
            .query_row(&set, [], |row| row.get::<_, i64>(0))
            .expect("is set");
    };
    limit(&connection, 80);
    let file = File::create(directory.path().join("other.lock")).expect("is made");
    let store = EventStore::start(connection, path, file, u64::MAX).expect("starts");
    let mut stored = 0;
    let full = loop {
        match store
            .append(append("a", vec![event(stored + 1, &"x".repeat(5000))]))
            .await
        {
            Ok(_) => stored += 1,
            Err(error) => break error,
        }
    };
    assert_eq!(full, StoreError::Full);
    assert!(0 < stored && stored < 80);
    assert_eq!(u64::try_from(bodies(&store, "a").len()).expect("small"), stored);
    assert_eq!(store.probe().await, Err(StoreError::Full));
    store
        .delete("a".to_owned(), Order::default())
        .await
        .expect("makes room");
    // Deleting gives the pages back by and by.
    for _ in 0..500 {
        if store
            .append(append("b", vec![event(1, &"y".repeat(5000))]))
            .await
            .is_ok()
        {
            break;
        }
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
    assert_eq!(bodies(&store, "b").len(), 1);
    store.probe().await.expect("has room again");
}

#[tokio::test]
async fn a_second_service_is_refused_while_the_first_one_has_the_log() {
    let directory = directory();
    let store = open(directory.path());
    let refused = EventStore::open(directory.path()).expect_err("is in use");
    assert!(refused.to_string().contains("another pilotfish"), "{refused}");
    drop(store);
    open_again(directory.path());
}

#[test]
fn a_log_of_a_later_program_is_refused_and_left_as_it_is() {
    let directory = directory();
    drop(open(directory.path()));
    let path = directory.path().join(FILE_NAME);
    let connection = Connection::open(&path).expect("opens");
    connection
        .pragma_update(None, "user_version", 99)
        .expect("is written");
    drop(connection);
    for _ in 0..500 {
        match EventStore::open(directory.path()) {
            Err(StoreError::InUse { .. }) => thread::sleep(Duration::from_millis(10)),
            refused => {
                assert!(
                    matches!(refused, Err(StoreError::TooNew { found: 99, .. })),
                    "{refused:?}"
                );
                break;
            }
        }
    }
    assert!(matches!(
        EventReader::of(directory.path()),
        Err(StoreError::TooNew { .. })
    ));
}

#[tokio::test]
async fn a_log_of_the_first_schema_is_brought_to_the_newest_with_everything_in_it() {
    let directory = directory();
    let path = directory.path().join(FILE_NAME);
    let mut connection = Connection::open(&path).expect("opens");
    schema::step(&mut connection, 0);
    connection
        .execute_batch(
            "INSERT INTO missions VALUES (1, 'a', 'running', x'7b7d');
             INSERT INTO events VALUES (1, 1, 'created', x'31'), (1, 2, 'reported', x'32');
             INSERT INTO snapshots VALUES (1, 2, x'7b7d');
             INSERT INTO answered VALUES (1, 'k', zeroblob(32), x'33');",
        )
        .expect("is written");
    drop(connection);
    let refused = EventReader::of(directory.path()).expect_err("is too old to read as it is");
    assert!(
        refused.to_string().contains("start the service once"),
        "{refused}"
    );
    let store = open(directory.path());
    assert_eq!(bodies(&store, "a"), [b"1", b"2"]);
    let reader = store.reader().expect("opens");
    assert_eq!(reader.snapshot(1).expect("is whole"), Some((2, b"{}".to_vec())));
    let known = store.append(keyed(3, "k", 0, "again")).await.expect("is known");
    assert_eq!(known, Appended::AnsweredBefore(b"3".to_vec()));
    add(&store, append("a", vec![event(3, "on")])).await;
}

#[test]
fn a_file_that_is_no_log_is_refused() {
    let directory = directory();
    fs::write(directory.path().join(FILE_NAME), [b'x'; 4096]).expect("is written");
    let refused = EventStore::open(directory.path()).expect_err("is no log");
    assert!(refused.to_string().contains("not a database"), "{refused}");
}

#[tokio::test]
async fn an_event_or_a_snapshot_that_is_not_what_was_stored_is_found_when_it_is_read() {
    let directory = directory();
    let store = open(directory.path());
    add(
        &store,
        append("a", vec![event(1, "one"), event(2, "two"), event(3, "three")]),
    )
    .await;
    let connection = Connection::open(&store.shared.path).expect("opens");
    let reader = store.reader().expect("opens");
    for damage in [
        "UPDATE events SET body = x'00' WHERE sequence = 2",
        "DELETE FROM events WHERE sequence = 2",
    ] {
        connection.execute(damage, []).expect("is done");
        let found = reader.events(1, 0, 10).expect_err("is damaged").to_string();
        assert!(found.contains("event 2 of mission number 1"), "{found}");
        assert_eq!(reader.events(1, 2, 10).expect("the rest is whole").len(), 1);
    }
    connection
        .execute("UPDATE snapshots SET body = x'00'", [])
        .expect("is done");
    let found = reader.snapshot(1).expect_err("is damaged").to_string();
    assert!(found.contains("the snapshot of mission number 1"), "{found}");
}

/// Copies a store as a power cut would leave it: with its write-ahead file.
fn cut(from: &Path, to: &Path) -> std::path::PathBuf {
    for ending in ["", "-wal"] {
        let name = format!("{FILE_NAME}{ending}");
        fs::copy(from.join(&name), to.join(&name)).expect("is copied");
    }
    to.join(format!("{FILE_NAME}-wal"))
}

#[tokio::test]
async fn damage_in_the_write_ahead_file_is_distinguished_from_a_commit_that_was_under_way() {
    let running = directory();
    let store = open(running.path());
    for sequence in 1..=5 {
        add(&store, append("a", vec![event(sequence, &"x".repeat(50))])).await;
    }
    let whole = directory();
    let wal = fs::read(cut(running.path(), whole.path())).expect("is there");
    assert_eq!(bodies(&open(whole.path()), "a").len(), 5);

    // The last page of the last commit, as a power cut in its middle may leave it.
    let last = directory();
    let path = cut(running.path(), last.path());
    let mut bytes = wal.clone();
    let end = bytes.len();
    bytes[end - 100..].fill(0xAA);
    fs::write(&path, &bytes).expect("is written");
    assert_eq!(bodies(&open(last.path()), "a").len(), 4);

    // Cut off in the middle of a frame.
    let short = directory();
    let path = cut(running.path(), short.path());
    fs::write(&path, &wal[..end - 3000]).expect("is written");
    assert_eq!(bodies(&open(short.path()), "a").len(), 4);

    // A page of a commit that others followed: it was acknowledged to their clients.
    let middle = directory();
    let path = cut(running.path(), middle.path());
    let mut bytes = wal;
    bytes[end / 2] ^= 1;
    fs::write(&path, &bytes).expect("is written");
    let refused = EventStore::open(middle.path()).expect_err("would lose what was acknowledged");
    assert!(
        refused
            .to_string()
            .contains("was acknowledged and cannot be read"),
        "{refused}"
    );
}

type Damage = fn(&mut Vec<u8>);

/// Without its parser a start would take the store for whole: SQLite goes back to the commit before the damage, and
/// what is left is in order.
#[tokio::test]
async fn no_check_of_the_log_finds_what_damage_in_the_write_ahead_file_takes_from_it() {
    let running = directory();
    let store = open(running.path());
    for sequence in 1..=2 {
        add(&store, append("a", vec![event(sequence, "x")])).await;
    }
    let connection = Connection::open(&store.shared.path).expect("opens");
    let moved_into_the_log = "PRAGMA wal_checkpoint(TRUNCATE)";
    connection
        .query_row(moved_into_the_log, [], |_| Ok(()))
        .expect("is done");
    for sequence in 3..=6 {
        add(&store, append("a", vec![event(sequence, &"x".repeat(50))])).await;
    }
    let damages: [(usize, Damage); 2] = [
        (2, |wal| wal[20] ^= 1),
        (4, |wal| {
            let middle = wal.len() / 2 + 100;
            wal[middle] ^= 1;
        }),
    ];
    for (n_left, damage) in damages {
        let copy = directory();
        let wal_path = cut(running.path(), copy.path());
        let mut wal = fs::read(&wal_path).expect("is there");
        damage(&mut wal);
        fs::write(&wal_path, &wal).expect("is written");
        let path = copy.path().join(FILE_NAME);
        let found = write_ahead::check(&path);
        assert!(matches!(found, Err(StoreError::Damaged(_))), "{found:?}");

        let connection = Connection::open(&path).expect("opens");
        configure(&connection).expect("is configured");
        let lock = lock(copy.path(), &path).expect("is free");
        let store = EventStore::start(connection, path, lock, u64::MAX).expect("starts");
        let reader = store.reader().expect("opens");
        let whole = "PRAGMA integrity_check";
        let verdict: String = reader.0.query_row(whole, [], |row| row.get(0)).expect("reads");
        store.inspect();
        assert_eq!((verdict.as_str(), store.probe().await), ("ok", Ok(())));
        assert_eq!(bodies(&store, "a").len(), n_left);
    }
}

#[tokio::test]
async fn a_damaged_page_of_the_log_shows_in_the_probe() {
    let directory = directory();
    let store = open(directory.path());
    add(
        &store,
        append("a", (1..=200).map(|k| event(k, &"x".repeat(500))).collect()),
    )
    .await;
    store.probe().await.expect("is whole");
    drop(store);
    drop(open_again(directory.path()));
    for _ in 0..500 {
        // Closing the last connection moves everything into the main file.
        if !directory.path().join(format!("{FILE_NAME}-wal")).exists() {
            break;
        }
        thread::sleep(Duration::from_millis(10));
    }
    let path = directory.path().join(FILE_NAME);
    let mut bytes = fs::read(&path).expect("is there");
    let end = bytes.len();
    bytes[end - 4096..].fill(0xAA);
    fs::write(&path, &bytes).expect("is written");
    match EventStore::open(directory.path()) {
        Ok(store) => {
            store.inspect();
            let found = store.probe().await.expect_err("is damaged");
            assert!(matches!(found, StoreError::Damaged(_)), "{found}");
        }
        Err(found) => assert!(found.to_string().contains("malformed"), "{found}"),
    }
}

#[tokio::test]
async fn a_closed_log_is_whole_without_its_write_ahead_file_and_an_emptied_one_is_refused() {
    let directory = directory();
    let path = directory.path().join(FILE_NAME);
    let ahead = directory.path().join(format!("{FILE_NAME}-wal"));
    let store = open(directory.path());
    add(&store, append("a", vec![event(1, "x")])).await;
    // What a copy of a running service holds, were its main file emptied.
    let emptied = tempfile::tempdir().expect("is made");
    fs::copy(&ahead, emptied.path().join(format!("{FILE_NAME}-wal"))).expect("is copied");
    fs::write(emptied.path().join(FILE_NAME), []).expect("is written");
    let refused = EventStore::open(emptied.path()).expect_err("lost a mission");
    assert!(refused.to_string().contains("is empty or missing"), "{refused}");

    store.close().await.expect("is closed");
    assert_eq!(store.append(append("b", vec![])).await, Err(StoreError::Closed));
    let alone = tempfile::tempdir().expect("is made");
    fs::copy(&path, alone.path().join(FILE_NAME)).expect("is copied");
    assert_eq!(bodies(&open(alone.path()), "a"), [b"x"]);
}

#[tokio::test]
async fn only_the_service_s_user_may_read_the_log() {
    use std::os::unix::fs::PermissionsExt as _;
    let directory = directory();
    let made = directory.path().join("made");
    let store = open(&made);
    add(&store, append("a", vec![event(1, "x")])).await;
    assert_eq!(
        fs::metadata(&made).expect("is there").permissions().mode() & 0o777,
        0o700
    );
    for name in [FILE_NAME.to_owned(), format!("{FILE_NAME}-wal")] {
        let mode = fs::metadata(made.join(&name))
            .expect("is there")
            .permissions()
            .mode();
        assert_eq!(mode & 0o777, 0o600, "{name}");
    }
}

#[tokio::test]
async fn the_file_shrinks_after_a_mission_is_deleted() {
    let directory = directory();
    let store = open(directory.path());
    let long = "x".repeat(10_000);
    add(&store, append("a", (1..=400).map(|k| event(k, &long)).collect())).await;
    let pages = || -> i64 {
        let reader = store.reader().expect("opens");
        reader
            .0
            .query_row("PRAGMA page_count", [], |row| row.get(0))
            .expect("reads")
    };
    let full = pages();
    assert!(
        store
            .delete("a".to_owned(), Order::default())
            .await
            .expect("is deleted")
    );
    for _ in 0..500 {
        if pages() < full / 10 {
            return;
        }
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
    panic!("{full} pages became {}", pages());
}

#[tokio::test]
async fn a_summary_that_is_not_what_was_stored_is_found_and_keeps_no_other_from_being_read() {
    let directory = directory();
    let store = open(directory.path());
    add(&store, append("a", vec![event(1, "x")])).await;
    add(&store, append("b", vec![event(1, "y")])).await;
    store.close().await.expect("is closed");
    let other = Connection::open(directory.path().join(FILE_NAME)).expect("opens");
    other
        .execute("UPDATE missions SET summary = x'5b5d' WHERE id = 'a'", [])
        .expect("is written");
    let reader = store.reader().expect("opens");
    let found = reader.missions_with_status("running").expect("reads");
    assert!(
        matches!(found.as_slice(), [Err(StoreError::Damaged(_)), Ok(mission)] if mission.id == "b"),
        "{found:?}"
    );
    assert!(matches!(reader.mission("a"), Err(StoreError::Damaged(_))));
}

#[tokio::test]
async fn a_log_that_is_read_while_it_is_closed_says_that_its_write_ahead_file_is_needed() {
    let directory = directory();
    let store = open(directory.path());
    add(&store, append("a", vec![event(1, "x")])).await;
    let reader = store.reader().expect("opens");
    reader
        .0
        .execute_batch("BEGIN; SELECT * FROM missions")
        .expect("reads");
    assert_eq!(store.close().await, Err(StoreError::Busy));
}

#[tokio::test]
async fn a_backup_under_writes_is_a_whole_log_of_its_own() {
    let directory = directory();
    let store = open(directory.path());
    add(&store, append("a", vec![event(1, "x")])).await;
    let writer = tokio::spawn({
        let store = store.clone();
        async move {
            for k in 2..400 {
                add(&store, append("a", vec![event(k, "y")])).await;
            }
        }
    });
    let to = directory.path().join("copy");
    let (reader, copy) = (store.reader().expect("opens"), to.clone());
    let copied = tokio::task::spawn_blocking(move || {
        reader.back_up(&copy).expect("is copied");
        reader.back_up(&copy)
    });
    let again = copied
        .await
        .expect("does not panic")
        .expect_err("is there already");
    assert!(again.to_string().contains("name another directory"), "{again}");
    writer.await.expect("is stored");
    let (whole, copied) = (bodies(&store, "a"), bodies(&open(&to), "a"));
    assert!(whole.starts_with(&copied) && !copied.is_empty());
    assert_eq!(
        fs::read_dir(&to)
            .expect("is there")
            .filter(|entry| {
                let name = entry.as_ref().expect("is there").file_name();
                name.to_string_lossy().contains("partial")
            })
            .count(),
        0
    );
}

#[tokio::test]
async fn a_vacuum_gives_room_back_that_an_older_log_keeps() {
    let directory = directory();
    let file = directory.path().join(FILE_NAME);
    // A file whose first table was made without it has no incremental vacuum.
    let older = Connection::open(&file).expect("opens");
    older
        .execute_batch("CREATE TABLE first (x); DROP TABLE first; CREATE TABLE older (x)")
        .expect("is SQL");
    drop(older);
    let size = || fs::metadata(&file).expect("is there").len();

    let store = open(directory.path());
    let big = Append {
        summary: vec![b' '; 1 << 20],
        ..append("a", vec![])
    };
    store.append(big).await.expect("is stored");
    store
        .delete("a".to_owned(), Order::default())
        .await
        .expect("is deleted");
    store.close().await.expect("ends");
    drop(store);
    assert!(1 << 20 < size(), "only a vacuum gives the room back");

    let store = loop {
        match EventStore::open(directory.path()) {
            Err(StoreError::InUse { .. }) => thread::yield_now(),
            opened => break opened.expect("opens"),
        }
    };
    store.vacuum().await.expect("has room");
    store.close().await.expect("ends");
    assert!(size() < 1 << 18, "{} bytes are left", size());
}

#[tokio::test]
async fn a_client_that_has_its_share_of_the_disk_stores_no_more_and_leaves_the_others_theirs() {
    let by = |caller: &str| {
        Some(Order {
            caller: caller.to_owned(),
            action: "create".to_owned(),
            ..Order::default()
        })
    };
    let made = |mission: &str, caller: &str| Append {
        order: by(caller),
        room: Room::Half,
        ..append(mission, vec![event(1, "made")])
    };
    let full = |store: &EventStore, append: Append| {
        let store = store.clone();
        async move {
            assert_eq!(
                store.append(append).await.expect("is answered"),
                Appended::ShareUsed
            );
        }
    };
    let long = "x".repeat(700);
    let directory = directory();
    let store = EventStore::open_with(directory.path(), 2_000).expect("opens");
    add(&store, made("a", "one")).await;
    add(&store, append("a", vec![event(2, &long)])).await;
    add(&store, append("a", vec![event(3, &long)])).await;
    let keyed_at = |sequence| Append {
        number: Some(1),
        ..keyed(sequence, "key", 1, "answer")
    };
    add(&store, keyed_at(4)).await;
    full(&store, append("a", vec![event(5, &long)])).await;
    // A request that is sent again has its answer, and what the mission stores itself goes on.
    let again = store.append(keyed_at(5)).await.expect("is answered");
    assert_eq!(again, Appended::AnsweredBefore(b"answer".to_vec()));
    let own = Append {
        room: Room::Any,
        ..append("a", vec![event(5, &long)])
    };
    add(&store, own).await;
    full(&store, made("b", "one")).await;
    add(&store, made("c", "two")).await;
    // Beyond half of it no mission is made.
    add(
        &store,
        Append {
            number: Some(2),
            ..append("c", vec![event(2, &long)])
        },
    )
    .await;
    full(&store, made("d", "two")).await;
    drop(store);

    let store = loop {
        match EventStore::open_with(directory.path(), 2_000) {
            Err(StoreError::InUse { .. }) => thread::sleep(Duration::from_millis(10)),
            opened => break opened.expect("opens again"),
        }
    };
    full(&store, made("b", "one")).await;
    let deleted = store.delete("a".to_owned(), Order::default()).await;
    assert_eq!(deleted, Ok(true));
    add(&store, made("b", "one")).await;
}
