//! Tables of refused bodies.

use serde_json::{Value, json};

use crate::client::{Answer, fault};

/// Puts `value` at `place`, in new objects where there are none; none removes the member.
pub fn put(body: &mut Value, place: &str, value: Option<Value>) {
    let Some((parent, name)) = place.rsplit_once('/') else {
        *body = value.expect("a body is not taken away");
        return;
    };
    if body.pointer(parent).is_none() {
        put(body, parent, Some(json!({})));
    }
    let name = name.replace("~1", "/").replace("~0", "~");
    match (body.pointer_mut(parent).expect("was made"), value) {
        (Value::Array(items), Some(value)) => items[name.parse::<usize>().expect("a number")] = value,
        (parent, Some(value)) => parent[name] = value,
        (parent, None) => drop(parent.as_object_mut().expect("an object").remove(&name)),
    }
}

/// Asserts the answers of `send` to `base` with one change each. Each row is a place (`.`: the
/// body), the value put there (`absent`: none), and the code of the refusal; then in any order:
/// another pointer, limits, a part of the answer behind `~`, detail. Two spaces separate cells.
pub async fn assert_refused(base: &Value, table: &str, send: impl AsyncFn(Value) -> Answer) {
    let rows = table.lines().map(str::trim);
    for row in rows.filter(|row| !row.is_empty() && !row.starts_with('#')) {
        let cells = row.split("  ").map(str::trim).filter(|cell| !cell.is_empty());
        let cells: Vec<_> = cells.collect();
        let [place, value, code, rest @ ..] = &*cells else { panic!("{row}") };
        let value: Option<Value> = (*value != "absent").then(|| serde_json::from_str(value).expect(row));
        let place = place.trim_start_matches('.');
        let mut body = base.clone();
        put(&mut body, place, value.clone());
        let answer = send(body).await;
        assert_eq!(answer.status, 422, "{row}: {}", answer.text);
        let error = answer.problem()["errors"][0].clone();
        let mut pointer = place;
        for cell in rest {
            if cell.starts_with('/') {
                pointer = cell;
            } else if let Some(part) = cell.strip_prefix('~') {
                answer.must_say(part);
            } else if let Some((least, most)) = cell.split_once("..") {
                let limits = [least, most].map(|limit| limit.parse::<f64>().expect(row));
                let named = ["least", "most"].map(|name| error["limit"][name].as_f64().expect(row));
                assert_eq!(named, limits, "{row}");
                let number = value.as_ref().filter(|value| value.is_number());
                let is_named = number.is_none_or(|number| error["given"].as_f64() == number.as_f64());
                assert!(is_named, "{row}");
            } else {
                assert_eq!(error["detail"], *cell, "{row}");
            }
        }
        assert_eq!(answer.faults(), fault(pointer, code), "{row}");
    }
}
