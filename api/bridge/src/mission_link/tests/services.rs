//! Several services that share the mission.

use super::*;

#[tokio::test(start_paused = true)]
async fn a_silent_service_is_left_for_the_next_with_the_same_key() {
    let urls = [
        "http://without-log",
        "http://refuses",
        "http://silent",
        "http://healthy",
    ]
    .map(str::to_owned);
    let clock = Clock::simulated(0.0);
    let (transport, calls) = services(&clock, |call| {
        let answer = match call.service.as_str() {
            "http://without-log" if is_report(call) => (503, problem("mission_log_unavailable")),
            "http://without-log" if is_for_plan(call) => no_plan_yet(),
            "http://healthy" if is_for_plan(call) => (200, planned(1)),
            "http://without-log" | "http://healthy" => (200, mission("m-1")),
            "http://refuses" => return Fate::Refused,
            _ => return Fate::Unanswered,
        };
        Fate::Answered(answer.0, answer.1)
    });
    let client = MissionClient::new(&urls, None, transport);
    let link = opened(&clock, client, MissionChoice::Joined("m-1".to_owned()));
    noted_for(&clock, &link, 20).await;
    let calls = lock(&calls);
    let reports: Vec<_> = calls.iter().filter(|(_, call)| is_report(call)).collect();
    let key = |call: &Call| call.posted.as_ref().map(|posted| posted.key.clone());
    let first = reports.iter().filter(|(_, call)| key(call) == key(&reports[0].1));
    let asked: Vec<&String> = first.map(|(_, call)| &call.service).collect();
    // The task that waits for plans also leaves silent services.
    assert!(
        asked.is_sorted_by_key(|service| urls.iter().position(|url| url == *service)),
        "{asked:?}"
    );
    assert_eq!((asked.first(), asked.last()), (Some(&&urls[0]), Some(&&urls[3])));
    let found = calls.iter().position(|(_, call)| call.service == urls[3]);
    let rest = &calls[found.expect("is asked")..];
    assert!(3 < rest.len() && rest.iter().all(|(_, call)| call.service == urls[3]));
    // No answer within half of the ten seconds for which a plan is followed.
    assert!(rest[0].0 < Duration::from_secs(5), "{:?}", rest[0].0);
    assert_eq!((link.status().trouble, link.status().has_failed), (None, false));
}

#[tokio::test(start_paused = true)]
async fn the_wait_for_a_single_service_is_four_seconds() {
    let clock = Clock::simulated(0.0);
    let (transport, calls) = services(&clock, |call| {
        if is_report(call) || is_for_plan(call) {
            Fate::Unanswered
        } else {
            Fate::Answered(200, mission("m-1"))
        }
    });
    let link = joined(&clock, None, transport);
    noted_for(&clock, &link, 14).await;
    let trouble = link.status().trouble.expect("is said");
    assert_eq!(trouble, "no answer: nothing within 4s");
    let calls = lock(&calls);
    let posted: Vec<Duration> = calls
        .iter()
        .filter(|(_, call)| is_report(call))
        .map(|(at, _)| *at)
        .collect();
    let again = Duration::from_secs(4) + RETRY;
    assert!(
        2 < posted.len() && posted.windows(2).all(|pair| pair[1] == pair[0] + again),
        "{posted:?}"
    );
}

#[tokio::test(start_paused = true)]
async fn an_older_plan_of_another_service_does_not_replace_a_newer_one() {
    let clock = Clock::simulated(0.0);
    let mut answers = 0;
    let (transport, _) = service(&clock, move |call| {
        if !is_for_plan(call) {
            return (200, mission("m-1"));
        }
        answers += 1;
        (200, planned(if answers == 1 { 7 } else { 5 }))
    });
    let link = joined(&clock, None, transport);
    clock.sleep(Duration::from_secs(10)).await;
    let plan = link.status().plan.expect("is kept for as long as it is valid");
    assert_eq!(plan.method, "mpc-7 ok");
}
