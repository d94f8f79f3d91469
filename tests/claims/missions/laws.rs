//! Predictions of a simulated mission that a line-of-sight law steers.

use std::collections::BTreeMap;

use super::*;

/// The laws by name.
const LAWS: [&str; 4] = ["saturated_los", "saturated_los_tracker_frame", "integral_los", "waypoint_box"];

const PLANS: &str = "events_ndjson&kinds=planned";

/// A plan's time and prediction, and the craft's true position.
struct KeptPlan {
    t_s: f64,
    prediction: wire::Prediction,
    reference: wire::Reference,
    truth: [f64; 2],
}

/// The first 120 plans of a mission that `law` steers, and the last of them whole.
async fn flown(service: &Service, scenario: &str, law: &str) -> (Vec<KeptPlan>, Value) {
    let mut new = simulated(scenario);
    new["simulated"]["controller"] = json!(law);
    let mission = service.create(&new).await;
    for _ in 0..2 {
        service.order(&mission, "step", json!({ "ticks": 60 })).await;
    }
    let of = |event: &Value| {
        let truth = &event["truth"]["asc"];
        KeptPlan {
            t_s: number(&event["t_s"]),
            prediction: serde_json::from_value(event["prediction"].clone()).expect("has the shape"),
            reference: serde_json::from_value(event["reference"].clone()).expect("has the shape"),
            truth: [number(&truth["north_m"]), number(&truth["east_m"])],
        }
    };
    let plans = service.record(&mission, PLANS).await.iter().map(of).collect();
    let last = service.ask(&format!("{mission}/reference")).await;
    (plans, last["plan"].clone())
}

/// Mean distance of the craft from its `predicted` position 8 s after each plan, m.
fn miss(plans: &[KeptPlan], predicted: impl Fn(&wire::Prediction) -> &[[f64; 2]]) -> f64 {
    let misses = plans.iter().filter_map(|plan| {
        let after = |seconds: f64| plans.iter().find(move |later| later.t_s == plan.t_s + seconds);
        let k = plan.prediction.after_s.iter().position(|after| *after == 8.0)?;
        let ([north, east], truth) = (predicted(&plan.prediction)[k], after(8.0)?.truth);
        Some((truth[0] - north).hypot(truth[1] - east))
    });
    let (sum, n) = misses.fold((0.0, 0.0), |(sum, n), miss| (sum + miss, n + 1.0));
    assert!(100.0 < n);
    sum / n
}

#[tokio::test(start_paused = true)]
async fn a_law_uses_the_gains_of_its_mission_and_the_planner_none() {
    let service = Service::start().await;
    let gains = json!({ "look_ahead_m": 1.0, "along_track_gain_per_s": 0.1 });
    let mut new = simulated("paper-tracking");
    new["simulated"]["controller"] = json!("saturated_los_tracker_frame");
    let mut flown = vec![];
    for gains in [None, Some(&gains)] {
        if let Some(gains) = gains {
            new["simulated"]["gains"] = gains.clone();
        }
        let mission = service.create(&new).await;
        service.order(&mission, "step", json!({ "ticks": 30 })).await;
        let scene = service.ask(&format!("{mission}/scene")).await;
        assert_eq!(scene.get("gains"), gains);
        let plans = service.record(&mission, PLANS).await;
        flown.push(plans[29]["truth"]["asc"].clone());
    }
    // The simulator's own flight with these gains, half a minute from the start.
    let scenario = Scenario::named("paper-tracking").expect("exists").lasting(40.0);
    let given: planner::los::LawGains = serde_json::from_value(gains).expect("has the shape");
    let tuning = given.tuning(planner::los::LosLaw::TrackerFrame, 0.03);
    let guide = &mut sim::guide::LosGuide::tuned(tuning);
    let record = sim::mission::run(&scenario, guide, 1, &mut |_| {}).expect("flies");
    let craft = record.rows[29].surface_craft.as_ref().expect("has one");
    assert_eq!(flown[1]["north_m"].as_f64(), Some(craft.position.x));
    assert_ne!(flown[0]["north_m"], flown[1]["north_m"]);

    let table = "
        /simulated/gains/look_ahead_m  0      out_of_range
        /simulated/controller          \"mpc\"  invalid       /simulated/gains
    ";
    let create = async |body: Value| service.post("/v1/missions", &body).await;
    assert_refused(&new, table, create).await;
}

#[tokio::test(start_paused = true)]
async fn a_scene_lists_the_faults_and_their_effect_on_messages() {
    let service = Service::start().await;
    let mission = service.create(&simulated("faults")).await;
    let scene = service.ask(&format!("{mission}/scene")).await;
    // As the scenario's file has them.
    let found = scene["faults"].as_array().expect("are listed");
    let times: Vec<_> = found.iter().map(|fault| fault["from_s"].as_f64()).collect();
    assert_eq!(times, [300.0, 700.0, 1120.0, 1200.0, 1500.0].map(Some));
    assert_eq!(found[0]["until_s"], 600.0);
    assert_eq!(found[0]["what"], "the port thruster delivers 60 % of its thrust");
    assert!(found[4].get("until_s").is_none());
    assert_eq!(found[4]["what"], "auv-1 loses power and sends nothing");
    let said = |scene: &Value| scene["information"].as_str().map(str::to_owned).expect("is told");
    assert!(said(&scene).contains("except while a fault stops its messages"));
    let sound = service.create(&simulated("calm")).await;
    let scene = service.ask(&format!("{sound}/scene")).await;
    assert!(scene.get("faults").is_none() && !said(&scene).contains("fault"));
}

mod slow {
    use super::*;

    #[tokio::test(start_paused = true)]
    async fn a_mission_steered_by_a_law_predicts_that_law_s_path() {
        let service = Service::start().await;
        for scenario in ["calm", "paper-intermittent"] {
            let mut first = BTreeMap::new();
            for law in LAWS {
                let (plans, last) = flown(&service, scenario, law).await;
                // The response model is not the simulator's hull: 0.4 m on average, goal jumps
                // included.
                let asc = miss(&plans, |prediction| &prediction.asc);
                assert!(asc < 0.5, "{scenario}, {law}: {asc} m");
                // This one leads elsewhere than saturated line of sight.
                let elsewhere = law == "waypoint_box";
                let other = miss(&plans, |prediction| &prediction.line_of_sight);
                assert!(!elsewhere || 3.0 < other, "{scenario}, {law}: {other} m");
                first.insert(law, plans[0].prediction.asc.clone());

                // The first step goes towards the given reference, in heading and speed.
                let trajectory: Vec<wire::TrajectoryPoint> =
                    serde_json::from_value(last["trajectory"].clone()).expect("has the shape");
                let reference = &plans.last().expect("there are plans").reference;
                let off = |point: &wire::TrajectoryPoint| {
                    let turn = planner::angle::wrap(reference.heading_rad - point.heading_rad);
                    (turn.abs(), (reference.speed_mps - point.speed_mps).abs())
                };
                let ((turn, speed), (turn_after, speed_after)) = (off(&trajectory[0]), off(&trajectory[1]));
                assert!(
                    turn_after <= turn.max(0.02) && speed_after <= speed.max(0.01),
                    "{scenario}, {law}: {turn} and {turn_after} rad, {speed} and {speed_after} m/s"
                );
                let predicted = &plans.last().expect("there are plans").prediction;
                let rms = last["predicted"]["rms_error_m"].as_f64().expect("is one");
                assert!((rms - predicted.rms_m).abs() < 1e-4, "{scenario}, {law}");
            }
            // Same world and seed: the first plans differ by the law. An integral is zero at first.
            for (law, asc) in first.iter().filter(|(law, _)| **law != "integral_los") {
                let same = first.iter().filter(|(_, other)| *other == asc);
                let same: Vec<_> =
                    same.map(|(other, _)| *other).filter(|other| *other != "integral_los").collect();
                assert_eq!(same, [*law], "{scenario}");
            }
        }
    }
}
