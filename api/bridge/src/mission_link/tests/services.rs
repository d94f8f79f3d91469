//! Several services that share the mission.

use super::*;

#[test]
fn a_service_that_does_not_answer_is_left_for_the_next_with_the_same_key() {
    let (sender, tried) = channel();
    let without_log = service(move |request| {
        if request.line.contains("/reports") {
            let _ = sender.send(request.key.clone());
            return (503, problem("mission_log_unavailable"));
        }
        if request.line.contains("/reference") {
            (409, problem("no_plan_yet"))
        } else {
            (200, mission("m-1"))
        }
    });
    let stopped = TcpListener::bind("127.0.0.1:0").expect("a free port");
    let silent = format!("http://{}", stopped.local_addr().expect("is bound"));
    let gone = TcpListener::bind("127.0.0.1:0").and_then(|listener| listener.local_addr());
    let refuses = format!("http://{}", gone.expect("a free port"));
    let (sender, posted) = channel();
    let healthy = service(move |request| {
        if request.line.contains("/reports") {
            let _ = sender.send(request.key.clone());
        }
        if request.line.contains("/reference") {
            (200, planned(1))
        } else {
            (200, mission("m-1"))
        }
    });
    let urls = [without_log, refuses, silent, healthy];
    let link = link(&urls, None, MissionChoice::Joined("m-1".to_owned()));
    assert_eq!(waits_for(&tried), waits_for(&posted));
    // Once there, it stays there.
    tried.try_iter().for_each(drop);
    for _ in 0..3 {
        waits_for(&posted);
    }
    assert_eq!(tried.try_iter().count(), 0);
    assert!(!link.status().has_failed);
}

#[test]
fn an_older_plan_of_another_service_does_not_replace_a_newer_one() {
    let (sender, repeated) = channel();
    let mut answers = 0;
    let url = service(move |request| {
        if !request.line.contains("/reference") {
            return (200, mission("m-1"));
        }
        answers += 1;
        let _ = sender.send(());
        (200, planned(if answers == 1 { 7 } else { 5 }))
    });
    let link = link(&[url], None, MissionChoice::Joined("m-1".to_owned()));
    for _ in 0..3 {
        waits_for(&repeated);
    }
    let plan = link.status().plan.expect("is kept for as long as it is valid");
    assert_eq!(plan.method, "mpc-7 ok");
}
