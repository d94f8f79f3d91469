//! Reports that are refused: each with the place and the reason of its fault.

use serde_json::{Value, json};
use tests::client::fault;

use super::{Service, asc, fix, heard, live};

#[tokio::test(start_paused = true)]
async fn reports_without_an_acceptable_one_are_refused_with_each_fault_s_place() {
    let service = Service::start().await;
    let mission = service.create(&live()).await;
    let now = service.now(&mission).await;
    let mut body = heard(now);
    body["auvs"]["auv-1"][0]["north_m"] = json!(1e9);
    body["auvs"]["auv-2"][0]["sigma_m"] = json!(-1.0);
    body["auvs"]["a/b"] = json!([fix(now, 0.0, 0.0)]);
    body["asc"][0]["state"]["speed_mps"] = json!(1e6);
    body["asc"][0]["t_s"] = json!(5.0);
    body["asc"][0]["current"] = json!({ "north_mps": 1e6, "east_mps": 0 });
    let note = |t_s: f64, length: usize| json!({ "t_s": t_s, "text": "x".repeat(length) });
    body["notes"] = json!([note(5.0, 3), note(now, 501)]);
    let post = async |body: &Value| service.post(&format!("{mission}/reports"), body).await;
    let mut pointers: Vec<_> = post(&body).await.faults().into_iter().map(|(pointer, _)| pointer).collect();
    pointers.sort();
    let expected = "/asc/0/current/north_mps /asc/0/state/speed_mps /asc/0/t_s /auvs/auv-1/0/north_m \
        /auvs/auv-2/0/sigma_m /auvs/a~1b /notes/0/t_s /notes/1/text";
    assert_eq!(pointers.join(" "), expected);
    let ahead = json!({ "auvs": { "auv-1": [fix(now + 1000.0, 0.0, 0.0)] } });
    assert_eq!(post(&ahead).await.faults(), fault("/auvs/auv-1/0/t_s", "out_of_range"));
    let others: serde_json::Map<String, Value> = (0..1000).map(|k| (k.to_string(), json!([]))).collect();
    for (body, code) in [
        (json!({}), "missing"),
        (json!({ "received_s": now }), "missing"),
        (json!({ "auvs": { "auv-1": vec![fix(now, 0.0, 0.0); 65] } }), "too_long"),
        (json!({ "auvs": others }), "too_long"),
    ] {
        assert_eq!(post(&body).await.faults()[0].1, code);
    }
    // A map would keep one of two equal names.
    let fix = fix(now, 0.0, 0.0);
    let twice = format!(r#"{{"auvs":{{"auv-1":[{fix}],"auv-1":[{fix}]}}}}"#);
    let refused = service.send(tests::client::post(&format!("{mission}/reports"), twice)).await;
    assert_eq!(refused.faults(), fault("/auvs/auv-1", "duplicate_field"));
    assert_eq!(service.ask(&mission).await["sequence"], 1);
}

#[tokio::test(start_paused = true)]
async fn a_rejected_report_affects_no_other() {
    let service = Service::start().await;
    let mission = service.create(&live()).await;
    let now = service.now(&mission).await;
    let mut body = heard(now);
    let mut odd = fix(now, 3.0, 4.0);
    odd["sigma_m"] = json!(1e9);
    let list = body["auvs"]["auv-1"].as_array_mut().expect("a list");
    list.splice(0..0, [odd, json!({ "t_s": now, "sigma_m": 1.0 })]);
    body["auvs"]["auv-9"] = json!([fix(now, 0.0, 0.0), fix(now, 1.0, 0.0)]);
    body["notes"] = json!([{ "t_s": now, "text": 5 }, { "t_s": now, "text": "kept" }]);
    let reports = format!("{mission}/reports");
    let accepted = service.post_keyed(&reports, &body, "some").await.expected(200);
    let mut rejected = accepted["rejected"].as_array().expect("a list").clone();
    rejected.sort_by_key(|error| error["pointer"].to_string());
    let pointers: Vec<_> = rejected.iter().map(|error| &error["pointer"]).collect();
    let expected = ["/auvs/auv-1/0/sigma_m", "/auvs/auv-1/1/north_m", "/auvs/auv-9", "/notes/0/text"];
    assert_eq!(pointers, expected);
    let sigma = &rejected[0];
    let fault = json!([sigma["given"], sigma["code"]]);
    assert_eq!(fault, json!([1e9, "out_of_range"]));
    assert!(sigma["limit"]["most"].is_number(), "{sigma}");
    assert_eq!(service.post_keyed(&reports, &body, "some").await.json(), accepted);

    let stored = &service.events(&mission).await[1]["heard"];
    assert_eq!(stored["auvs"], heard(now)["auvs"]);
    assert_eq!(stored["notes"], json!([{ "t_s": now, "text": "kept" }]));
    assert_eq!(stored["rejected"], accepted["rejected"]);
    assert_eq!(service.ask(&mission).await["sequence"], 2);
}

#[tokio::test(start_paused = true)]
async fn a_wrong_clock_is_reported_in_seconds() {
    let service = Service::start().await;
    let mission = service.create(&live()).await;
    let reports = format!("{mission}/reports");
    for (off, told) in [(1000.0, "1000.0 s ahead of"), (-90_000.0, "90000.0 s behind")] {
        let now = service.now(&mission).await + off;
        let off_clock =
            json!({ "received_s": now, "auvs": { "auv-1": [fix(now, 0.0, 0.0)] }, "asc": asc(now) });
        let document = service.post(&reports, &off_clock).await.problem();
        for error in document["errors"].as_array().expect("a list") {
            let pointer = error["pointer"].as_str().expect("a text");
            let expected = ["/received_s", "/auvs/auv-1/0/t_s", "/asc/0/t_s"];
            assert!(expected.contains(&pointer), "{document}");
            let detail = error["detail"].as_str().expect("a text");
            let told = format!("is {told} the mission's clock");
            assert!(detail.starts_with(&told), "{detail}");
        }
    }
    for (factor, unit) in [(1e3, "milliseconds"), (1e6, "microseconds"), (1e9, "nanoseconds")] {
        let now = factor * service.now(&mission).await;
        let document = service.post(&reports, &json!({ "asc": asc(now) })).await.problem();
        assert_eq!(document["errors"][0]["detail"], format!("is in {unit}: give seconds"), "{document}");
    }
    // A receiver on local time: an AUV's fix may be that old, a state of the craft not.
    let late = service.now(&mission).await - 3600.0;
    let body = json!({ "auvs": { "auv-1": [fix(late, 0.0, 0.0)] }, "asc": asc(late) });
    let accepted = service.post(&reports, &body).await.json();
    let rejected = accepted["rejected"].as_array().expect("a list");
    assert_eq!(rejected.len(), 1, "{accepted}");
    assert_eq!(rejected[0]["pointer"], "/asc/0/t_s");
}
