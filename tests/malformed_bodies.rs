//! A thousand broken requests: no panic, no server error, always a pointer to the fault, and 400 only for
//! what is not JSON.

use std::collections::BTreeMap;

use axum::http::StatusCode;
use rand::{RngExt, SeedableRng, seq::IndexedRandom};
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};
use service::{Settings, app, examples::EXAMPLES};
use tests::client::{post, send_to};

/// How many refusals to see.
const BODIES: usize = 1_000;
const SEED: u64 = 20_260_114;

/// Every place in a document, as pointers; the root is the empty one.
fn places(value: &Value, at: &str, found: &mut Vec<String>) {
    found.push(at.to_owned());
    match value {
        Value::Array(items) => {
            for (i, item) in items.iter().enumerate() {
                places(item, &format!("{at}/{i}"), found);
            }
        }
        Value::Object(members) => {
            for (name, member) in members {
                places(member, &format!("{at}/{name}"), found);
            }
        }
        _ => {}
    }
}

fn numbers(value: &Value) -> Vec<String> {
    let mut found = Vec::new();
    places(value, "", &mut found);
    found.retain(|place| value.pointer(place).is_some_and(Value::is_number));
    found
}

fn pick<'a, T>(rng: &mut ChaCha8Rng, list: &'a [T]) -> &'a T {
    list.choose(rng)
        .expect("the list is a constant or comes from an example")
}

/// Ends anywhere before its last brace.
fn truncated(body: &str, rng: &mut ChaCha8Rng) -> Vec<u8> {
    body.as_bytes()[..rng.random_range(0..body.trim_end().len())].to_vec()
}

/// A few bytes overwritten with anything.
fn scrambled(body: &str, rng: &mut ChaCha8Rng) -> Vec<u8> {
    let mut bytes = body.as_bytes().to_vec();
    for _ in 0..rng.random_range(1..8) {
        let i = rng.random_range(0..bytes.len());
        bytes[i] = rng.random();
    }
    bytes
}

/// A value of another type somewhere.
fn wrong_type(body: &str, rng: &mut ChaCha8Rng) -> Vec<u8> {
    let mut value: Value = serde_json::from_str(body).expect("examples are JSON");
    let mut found = Vec::new();
    places(&value, "", &mut found);
    let place = pick(rng, &found).clone();
    let others = [
        json!(null),
        json!(true),
        json!("text"),
        json!(-7),
        json!([]),
        json!([1, 2]),
        json!({}),
        json!({ "a": 1 }),
    ];
    *value.pointer_mut(&place).expect("was just found") = pick(rng, &others).clone();
    value.to_string().into_bytes()
}

/// A number that is far too large, too small, or none that JSON or physics knows.
fn strange_number(body: &str, rng: &mut ChaCha8Rng) -> Vec<u8> {
    let mut value: Value = serde_json::from_str(body).expect("examples are JSON");
    let place = pick(rng, &numbers(&value)).clone();
    *value.pointer_mut(&place).expect("was just found") = json!("HERE");
    let strange = [
        "NaN",
        "Infinity",
        "-Infinity",
        "1e308",
        "-1e308",
        "1e309",
        "-1e999",
        "1e-320",
        "-0.0",
        "1e12",
        "-1e12",
        "0x10",
        "1_000",
        "9007199254740993",
        "99999999999999999999999999",
        "--1",
        "1e",
        ".5",
        "+1",
        "٣",
    ];
    value
        .to_string()
        .replace("\"HERE\"", pick::<&str>(rng, &strange))
        .into_bytes()
}

/// A member gone, renamed, or written twice.
fn wrong_member(body: &str, rng: &mut ChaCha8Rng) -> Vec<u8> {
    let mut value: Value = serde_json::from_str(body).expect("examples are JSON");
    let mut found = Vec::new();
    places(&value, "", &mut found);
    found.retain(|place| value.pointer(place).is_some_and(Value::is_object));
    let members = value
        .pointer_mut(pick::<String>(rng, &found))
        .and_then(Value::as_object_mut)
        .expect("is an object");
    let names: Vec<_> = members.keys().cloned().collect();
    let Some(name) = names.choose(rng) else {
        return b"{\"t_s\":1,\"t_s\":2}".to_vec();
    };
    let member = members.remove(name).expect("was just listed");
    match rng.random_range(0..3) {
        0 => {}
        1 => drop(members.insert(format!("{name}/~\u{7}"), member)),
        _ => {
            members.insert("TWICE".to_owned(), member.clone());
            let twice = format!("{}:{member},{}", json!(name), json!(name));
            return value.to_string().replace("\"TWICE\"", &twice).into_bytes();
        }
    }
    value.to_string().into_bytes()
}

/// Deep, wide or long enough to hurt a careless reader.
fn excessive(body: &str, rng: &mut ChaCha8Rng) -> Vec<u8> {
    let mut value: Value = serde_json::from_str(body).expect("examples are JSON");
    let n = rng.random_range(17..3_000);
    match rng.random_range(0..4) {
        0 => return [b"[".repeat(n), b"]".repeat(n)].concat(),
        // With its reports a vehicle is a kilobyte, and a body of over a mebibyte would be another refusal.
        1 => value["auvs"] = json!(vec![value["auvs"][0].clone(); n.min(500)]),
        2 => value["auvs"][0]["id"] = json!("é".repeat(n)),
        _ => value["metadata"] = json!({ "pad": "x".repeat(n + 4_096) }),
    }
    value.to_string().into_bytes()
}

#[tokio::test]
async fn a_thousand_broken_bodies_are_refused_with_a_pointer_and_never_by_a_server_error() {
    type Breaker = fn(&str, &mut ChaCha8Rng) -> Vec<u8>;
    let breakers: [(&str, Breaker); 6] = [
        ("truncated", truncated),
        ("scrambled", scrambled),
        ("wrong type", wrong_type),
        ("strange number", strange_number),
        ("wrong member", wrong_member),
        ("excessive", excessive),
    ];
    let service = app(Settings::default());
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    let mut tally: BTreeMap<(&str, u16), usize> = BTreeMap::new();
    let mut refused = 0;
    for (kind, break_it) in breakers.iter().cycle() {
        let body = break_it(pick(&mut rng, &EXAMPLES).body, &mut rng);
        let shown = String::from_utf8_lossy(&body[..body.len().min(1_500)]).into_owned();
        let answer = send_to(service.clone(), post("/v1/plan", body.clone())).await;
        let context = format!("{kind}: {} to {shown}", answer.text);
        *tally.entry((kind, answer.status.as_u16())).or_default() += 1;
        assert!(!answer.status.is_server_error(), "{context}");
        if answer.status == StatusCode::OK {
            // A change may leave a request valid, and then the answer must be whole: `null` is how a
            // number that is not finite would look.
            assert!(!answer.text.contains("null"), "{context}");
        } else {
            let is_json = serde_json::from_slice::<Value>(&body).is_ok();
            let expected = if is_json {
                StatusCode::UNPROCESSABLE_ENTITY
            } else {
                StatusCode::BAD_REQUEST
            };
            assert_eq!(answer.status, expected, "{context}");
            let faults = answer.faults();
            assert!(!faults.is_empty(), "{context}");
            assert!(
                faults
                    .iter()
                    .all(|(pointer, _)| pointer.is_empty() || pointer.starts_with('/')),
                "{context}"
            );
            refused += 1;
        }
        if refused == BODIES {
            break;
        }
    }
    for ((kind, status), count) in &tally {
        println!("{kind:>15} {status} {count:>4}");
    }
    let sent: usize = tally.values().sum();
    println!("{sent} bodies, {refused} refused, seed {SEED}");
    // Most changes break the request: a service that took them for valid would not be checking.
    assert!(sent < BODIES * 5 / 4, "{tally:?}");
}
