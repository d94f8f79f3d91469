//! Broken requests, by every way of breaking one.

use rand::{RngExt, seq::IndexedRandom};
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};

/// Breaks a body, which is JSON.
pub type Breaker = fn(&str, &mut ChaCha8Rng) -> Vec<u8>;

/// Every way of breaking a body.
pub const BREAKERS: [Breaker; 6] =
    [truncated, scrambled, wrong_type, strange_number, wrong_member, excessive];

/// Every place in a document, as pointers; the root is the empty one.
fn places(value: &Value, at: &str, found: &mut Vec<String>) {
    found.push(at.to_owned());
    match value {
        Value::Array(items) => {
            items.iter().enumerate().for_each(|(i, item)| places(item, &format!("{at}/{i}"), found));
        }
        Value::Object(members) => {
            members.iter().for_each(|(name, member)| places(member, &format!("{at}/{name}"), found));
        }
        _ => {}
    }
}

/// Every place of such a value.
pub fn places_of(value: &Value, such: fn(&Value) -> bool) -> Vec<String> {
    let mut found = vec![];
    places(value, "", &mut found);
    found.retain(|place| value.pointer(place).is_some_and(such));
    found
}

/// Any one of them.
pub fn pick<'a, T>(rng: &mut ChaCha8Rng, list: &'a [T]) -> &'a T {
    list.choose(rng).expect("the list is a constant or comes from an example")
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
    let place = pick(rng, &places_of(&value, |_| true)).clone();
    let others = json!([null, true, "text", -7, [], [1, 2], {}, { "a": 1 }]);
    let other = pick(rng, others.as_array().expect("is a list")).clone();
    *value.pointer_mut(&place).expect("was just found") = other;
    value.to_string().into_bytes()
}

/// A number far too large or small, or unknown to JSON or physics.
fn strange_number(body: &str, rng: &mut ChaCha8Rng) -> Vec<u8> {
    let mut value: Value = serde_json::from_str(body).expect("examples are JSON");
    let place = pick(rng, &places_of(&value, Value::is_number)).clone();
    *value.pointer_mut(&place).expect("was just found") = json!("HERE");
    let strange = "NaN Infinity -Infinity 1e308 -1e308 1e309 -1e999 1e-320 -0.0 1e12 -1e12 0x10 1_000 \
        9007199254740993 99999999999999999999999999 --1 1e .5 +1 ٣";
    let strange: Vec<_> = strange.split(' ').collect();
    let text = value.to_string();
    text.replace("\"HERE\"", pick::<&str>(rng, &strange)).into_bytes()
}

/// A member gone, renamed, or written twice.
fn wrong_member(body: &str, rng: &mut ChaCha8Rng) -> Vec<u8> {
    let mut value: Value = serde_json::from_str(body).expect("examples are JSON");
    let found = places_of(&value, Value::is_object);
    let members =
        value.pointer_mut(pick::<String>(rng, &found)).and_then(Value::as_object_mut).expect("is an object");
    let names: Vec<_> = members.keys().cloned().collect();
    let Some(name) = names.choose(rng) else { return b"{\"t_s\":1,\"t_s\":2}".to_vec() };
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
        // A vehicle with reports is a kilobyte; a body of over a mebibyte is refused elsewhere.
        1 => value["auvs"] = json!(vec![value["auvs"][0].clone(); n.min(500)]),
        2 => value["auvs"][0]["id"] = json!("é".repeat(n)),
        _ => value["metadata"] = json!({ "pad": "x".repeat(n + 4_096) }),
    }
    value.to_string().into_bytes()
}
