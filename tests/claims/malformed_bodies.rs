//! A thousand broken requests: no panic, no server error, always a pointer to the fault, and 400
//! only for invalid JSON.

use std::collections::BTreeMap;

use axum::http::StatusCode;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde_json::Value;
use service::{app, examples::EXAMPLES};
use tests::{
    broken::{BREAKERS, pick},
    client::{post, send_to, simulated_machine},
};

/// Number of refusals.
const BODIES: usize = 1_000;
const SEED: u64 = 20_260_114;

#[tokio::test(start_paused = true)]
async fn a_thousand_broken_bodies_are_refused_with_a_pointer_and_no_server_error() {
    let service = app(simulated_machine());
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    let mut tally: BTreeMap<(&str, u16), usize> = BTreeMap::new();
    let mut refused = 0;
    for (kind, break_it) in BREAKERS.iter().cycle() {
        let body = break_it(pick(&mut rng, &EXAMPLES).body, &mut rng);
        let shown = String::from_utf8_lossy(&body[..body.len().min(1_500)]).into_owned();
        let answer = send_to(service.clone(), post("/v1/plan", body.clone())).await;
        let context = format!("{kind}: {} to {shown}", answer.text);
        *tally.entry((kind, answer.status.as_u16())).or_default() += 1;
        assert!(!answer.status.is_server_error(), "{context}");
        if answer.status == StatusCode::OK {
            // A change may leave a request valid; then the answer is whole, without `null`s.
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
    // Most changes break a request: the service checks them.
    assert!(sent < BODIES * 5 / 4, "{tally:?}");
}
