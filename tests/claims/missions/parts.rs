//! Records in parts, through the API.

use super::*;

/// The lines of a record as CSV, its head first.
async fn csv(service: &Service, mission: &str, query: &str) -> Vec<String> {
    let answer = service.get(&format!("{mission}/record?format=csv&{query}")).await;
    assert_eq!(answer.status, StatusCode::OK, "{}", answer.text);
    answer.text.lines().map(str::to_owned).collect()
}

#[tokio::test(start_paused = true)]
async fn two_parts_of_a_live_record_make_the_whole_on_the_mission_s_clock() {
    let service = Service::start().await;
    let mission = service.create(&live()).await;
    service.order(&mission, "run", json!({})).await;
    let mut after = 0;
    for _ in 0..3 {
        let now = service.mission_now(&service.ask(&mission).await);
        service.order(&mission, "reports", heard(now)).await;
        let next = format!("{mission}/reference?wait_s=10&after={after}");
        after = service.ask(&next).await["sequence"]
            .as_u64()
            .expect("is a number");
    }
    service.order(&mission, "pause", json!({})).await;
    service.order(&mission, "finish", json!({})).await;
    let last = service.ask(&mission).await["sequence"]
        .as_u64()
        .expect("is a number");

    let whole = csv(&service, &mission, "").await;
    for after in [1, 2, 3, last / 2, last - 1] {
        let mut parts = csv(&service, &mission, &format!("max_events={after}")).await;
        let rest = csv(&service, &mission, &format!("after={after}")).await;
        assert_eq!(rest[0], parts[0], "the head");
        parts.extend_from_slice(&rest[1..]);
        assert_eq!(parts, whole, "after {after} of {last}");
    }
    let orders = csv(&service, &mission, "kinds=planned,ran,finished").await;
    let is_of = |line: &&String, kinds: &[&str]| kinds.contains(&line.split(',').nth(1).unwrap_or_default());
    let expected = whole.iter().filter(|line| {
        is_of(
            line,
            &["kind", "planned", "estimated", "refused", "ran", "finished"],
        )
    });
    assert!(orders.iter().eq(expected), "{orders:?}");
    // Tenfold speed from its creation: far from 0 and from the time of the service.
    let t_s = |kind: &str| -> f64 {
        let row = orders.iter().find(|line| is_of(line, &[kind])).expect("is there");
        let cell = row.split(',').nth(2).expect("has a time");
        cell.parse().expect("is a number")
    };
    assert!(service.clock.unix_s() - 600.0 < t_s("ran") && t_s("ran") < t_s("finished"));
}
