use std::{fs, path::Path};

use super::*;

fn event(sequence: u64, body: &str) -> Event {
    Event {
        sequence,
        kind: "reported".to_owned(),
        body: body.as_bytes().to_vec(),
    }
}

fn append(mission: &str, events: Vec<Event>) -> Append {
    Append {
        mission: mission.to_owned(),
        // Tests go on with the first mission only.
        number: events.first().filter(|event| 1 < event.sequence).map(|_| 1),
        events,
        status: "running".to_owned(),
        summary: b"{}".to_vec(),
        snapshot: Some(b"{}".to_vec()),
        answered: None,
    }
}

fn keyed(sequence: u64, key: &str, request: u8, answer: &str) -> Append {
    Append {
        answered: Some(Answered {
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

fn open(directory: &Path) -> Log {
    Log::open(directory).expect("opens")
}

/// Bodies of all events, whose numbers and digests the reader has checked.
fn bodies(log: &Log, id: &str) -> Vec<Vec<u8>> {
    let reader = log.reader().expect("opens");
    let mission = reader.mission(id).expect("reads").expect("is there");
    let events = reader.events(mission.number, 0, usize::MAX).expect("reads");
    events.into_iter().map(|event| event.body).collect()
}

async fn store(log: &Log, append: Append) {
    assert_eq!(log.append(append).await.expect("is stored"), Appended::Now);
}

/// Waits until the writer of a dropped log has let go of its file.
fn open_again(directory: &Path) -> Log {
    for _ in 0..500 {
        match Log::open(directory) {
            Err(LogError::InUse { .. }) => thread::sleep(Duration::from_millis(10)),
            opened => return opened.expect("opens again"),
        }
    }
    panic!("the log stays in use");
}

#[tokio::test]
async fn what_was_acknowledged_is_there_after_the_log_is_opened_again() {
    let directory = directory();
    let log = open(directory.path());
    for sequence in 1..=3 {
        store(&log, append("a", vec![event(sequence, &sequence.to_string())])).await;
    }
    drop(log);
    assert_eq!(bodies(&open_again(directory.path()), "a"), [b"1", b"2", b"3"]);
}

#[tokio::test]
async fn appends_that_wait_together_are_stored_each_whole_and_a_bad_one_alone_fails() {
    let directory = directory();
    let log = open(directory.path());
    store(&log, append("a", vec![event(1, "one")])).await;
    // The same number twice in one mission, beside many that are right.
    let all = (0..100_u32).map(|k| match k {
        50 => append("a", vec![event(2, "two"), event(2, "again")]),
        _ => append(&format!("m{k}"), vec![event(1, "x"), event(2, "y")]),
    });
    let tasks: Vec<_> = all
        .map(|append| {
            let log = log.clone();
            tokio::spawn(async move { log.append(append).await })
        })
        .collect();
    let mut failed = vec![];
    for (k, task) in tasks.into_iter().enumerate() {
        if task.await.expect("does not panic").is_err() {
            failed.push(k);
        }
    }
    assert_eq!(failed, [50]);
    assert_eq!(bodies(&log, "a"), [b"one"]);
    assert_eq!(bodies(&log, "m99"), [b"x", b"y"]);
}

#[tokio::test]
async fn a_key_is_answered_once_and_stands_for_one_request() {
    let directory = directory();
    let log = open(directory.path());
    store(&log, keyed(1, "k", 1, "first")).await;
    let again = log.append(keyed(2, "k", 1, "second")).await.expect("is known");
    assert_eq!(again, Appended::Before(b"first".to_vec()));
    let other = log.append(keyed(2, "k", 2, "second")).await.expect("is known");
    assert_eq!(other, Appended::KeyTaken);
    assert_eq!(bodies(&log, "a").len(), 1);
}

#[tokio::test]
async fn whoever_was_overtaken_is_told_and_stores_nothing() {
    let directory = directory();
    let log = open(directory.path());
    store(&log, append("a", vec![event(1, "one"), event(2, "two")])).await;
    for sequence in [2, 4] {
        let late = log.append(append("a", vec![event(sequence, "late")])).await;
        assert_eq!(late, Ok(Appended::Overtaken));
    }
    assert_eq!(bodies(&log, "a"), [b"one", b"two"]);
}

#[tokio::test]
async fn a_deleted_mission_is_gone_at_once_takes_nothing_more_and_gives_its_room_back() {
    let directory = directory();
    let log = open(directory.path());
    store(&log, append("a", (1..=5000).map(|k| event(k, "x")).collect())).await;
    store(&log, append("b", vec![event(1, "y")])).await;
    assert!(log.delete("a".to_owned()).await.expect("is deleted"));
    assert!(
        !log.delete("a".to_owned())
            .await
            .expect("is known not to be there")
    );
    let late = log.append(append("a", vec![event(5001, "late")])).await;
    assert_eq!(late, Ok(Appended::Gone));
    let reader = log.reader().expect("opens");
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
    assert_eq!(bodies(&log, "b"), [b"y"]);
    assert_eq!(
        log.append(append("a", vec![event(5001, "late")])).await,
        Ok(Appended::Gone)
    );
    // The name is free again.
    store(&log, append("a", vec![event(1, "anew")])).await;
    assert_eq!(bodies(&log, "a"), [b"anew"]);
    // Whoever knew the mission that had the name before has nothing to say in this one.
    assert_eq!(
        log.append(append("a", vec![event(2, "late")])).await,
        Ok(Appended::Gone)
    );
    assert_eq!(bodies(&log, "a"), [b"anew"]);
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
    let log = Log::start(connection, path, file).expect("starts");
    let mut stored = 0;
    let full = loop {
        match log
            .append(append("a", vec![event(stored + 1, &"x".repeat(5000))]))
            .await
        {
            Ok(_) => stored += 1,
            Err(error) => break error,
        }
    };
    assert_eq!(full, LogError::Full);
    assert!(0 < stored && stored < 80);
    assert_eq!(u64::try_from(bodies(&log, "a").len()).expect("small"), stored);
    assert_eq!(log.probe().await, Err(LogError::Full));
    log.delete("a".to_owned()).await.expect("makes room");
    // Deleting gives the pages back by and by.
    for _ in 0..500 {
        if log
            .append(append("b", vec![event(1, &"y".repeat(5000))]))
            .await
            .is_ok()
        {
            break;
        }
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
    assert_eq!(bodies(&log, "b").len(), 1);
    log.probe().await.expect("has room again");
}

#[tokio::test]
async fn a_second_service_is_refused_while_the_first_one_has_the_log() {
    let directory = directory();
    let log = open(directory.path());
    let refused = Log::open(directory.path()).expect_err("is in use");
    assert!(refused.to_string().contains("another pilotfish"), "{refused}");
    drop(log);
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
        match Log::open(directory.path()) {
            Err(LogError::InUse { .. }) => thread::sleep(Duration::from_millis(10)),
            refused => {
                assert!(
                    matches!(refused, Err(LogError::TooNew { found: 99, .. })),
                    "{refused:?}"
                );
                break;
            }
        }
    }
    assert!(matches!(
        Reader::of(directory.path()),
        Err(LogError::TooNew { .. })
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
    let refused = Reader::of(directory.path()).expect_err("is too old to read as it is");
    assert!(
        refused.to_string().contains("start the service once"),
        "{refused}"
    );
    let log = open(directory.path());
    assert_eq!(bodies(&log, "a"), [b"1", b"2"]);
    let reader = log.reader().expect("opens");
    assert_eq!(reader.snapshot(1).expect("is whole"), Some((2, b"{}".to_vec())));
    let known = log.append(keyed(3, "k", 0, "again")).await.expect("is known");
    assert_eq!(known, Appended::Before(b"3".to_vec()));
    store(&log, append("a", vec![event(3, "on")])).await;
}

#[test]
fn a_file_that_is_no_log_is_refused() {
    let directory = directory();
    fs::write(directory.path().join(FILE_NAME), [b'x'; 4096]).expect("is written");
    let refused = Log::open(directory.path()).expect_err("is no log");
    assert!(refused.to_string().contains("not a database"), "{refused}");
}

#[tokio::test]
async fn an_event_or_a_snapshot_that_is_not_what_was_stored_is_found_when_it_is_read() {
    let directory = directory();
    let log = open(directory.path());
    store(
        &log,
        append("a", vec![event(1, "one"), event(2, "two"), event(3, "three")]),
    )
    .await;
    let connection = Connection::open(&log.shared.path).expect("opens");
    let reader = log.reader().expect("opens");
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

/// Copies a log as a power cut would leave it: with its write-ahead file.
fn cut(from: &Path, to: &Path) -> std::path::PathBuf {
    for ending in ["", "-wal"] {
        let name = format!("{FILE_NAME}{ending}");
        fs::copy(from.join(&name), to.join(&name)).expect("is copied");
    }
    to.join(format!("{FILE_NAME}-wal"))
}

#[tokio::test]
async fn damage_in_the_write_ahead_file_is_told_apart_from_a_commit_that_was_under_way() {
    let running = directory();
    let log = open(running.path());
    for sequence in 1..=5 {
        store(&log, append("a", vec![event(sequence, &"x".repeat(50))])).await;
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

    // A page of a commit that others followed: those had been told that it is on the disk.
    let middle = directory();
    let path = cut(running.path(), middle.path());
    let mut bytes = wal;
    bytes[end / 2] ^= 1;
    fs::write(&path, &bytes).expect("is written");
    let refused = Log::open(middle.path()).expect_err("would lose what was acknowledged");
    assert!(
        refused
            .to_string()
            .contains("was acknowledged and cannot be read"),
        "{refused}"
    );
}

#[tokio::test]
async fn a_damaged_page_of_the_log_shows_in_the_probe() {
    let directory = directory();
    let log = open(directory.path());
    store(
        &log,
        append("a", (1..=200).map(|k| event(k, &"x".repeat(500))).collect()),
    )
    .await;
    log.probe().await.expect("is whole");
    drop(log);
    drop(open_again(directory.path()));
    for _ in 0..500 {
        // Whoever drops the last connection moves everything into the log itself.
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
    match Log::open(directory.path()) {
        Ok(log) => {
            log.inspect();
            let found = log.probe().await.expect_err("is damaged");
            assert!(matches!(found, LogError::Damaged(_)), "{found}");
        }
        Err(found) => assert!(found.to_string().contains("malformed"), "{found}"),
    }
}
