//! A part of a record has the rows of the whole, which depend on the state before the part.

use super::*;

/// A rehearsal at ten times real speed that refuses a fix, accepts it again, and is changed.
fn rehearsal() -> Vec<Event> {
    let mut made = made_live();
    let Event::Created { mission, .. } = &mut made else { unreachable!("is made first") };
    mission.live.as_mut().expect("is live").clock_rate = 10.0;
    let fix = json!({"t_s": MADE + 9.0, "north_m": 7.0, "east_m": 0.0, "sigma_m": 0.5});
    let changed = json!({"kind": "changed", "at_s": MADE + 2.5, "setting": {"keep_outs": null}, "replaced": {"keep_outs": null}});
    vec![
        made,
        Event::Ran { at_s: MADE + 0.5, speed_factor: None },
        reported(MADE + 1.0, json!({"auvs": {"auv-2": [fix]}})),
        planned_without(MADE + 12.0, &[]),
        planned_without(MADE + 13.0, &[MADE + 9.0]),
        Event::Paused { at_s: MADE + 1.5 },
        planned_without(MADE + 20.0, &[MADE + 9.0, MADE + 8.0]),
        serde_json::from_value(changed).expect("is an event"),
        planned_without(MADE + 27.0, &[]),
        planned_without(MADE + 28.0, &[MADE + 9.0]),
        Event::Finished { at_s: MADE + 3.0 },
    ]
}

/// The second fix of a simulated mission is refused by its last plans.
fn simulated_with_a_refused_fix() -> Vec<Event> {
    let with_truth = |event: Event, t_s: f64| match event {
        Event::Planned(plan) => {
            Event::Planned(Box::new(Planned { truth: Some(Box::new(truth(t_s))), ..*plan }))
        }
        other => other,
    };
    let plans = [(3.0, vec![]), (4.0, vec![2.5]), (5.0, vec![2.5])];
    let plans = plans.map(|(t_s, refused)| with_truth(planned_without(t_s, &refused), t_s));
    [made_simulated(), Event::Ran { at_s: MADE + 1.0, speed_factor: None }]
        .into_iter()
        .chain(plans)
        .chain([Event::Paused { at_s: MADE + 2.0 }, Event::Finished { at_s: MADE + 3.0 }])
        .collect()
}

/// Each craft of a fleet refuses a fix of its own AUV in all of its plans.
fn fleet() -> Vec<Event> {
    let mut made = made_live();
    let Event::Created { mission, .. } = &mut made else { unreachable!("is made first") };
    let craft = json!([{"id": "asc-1"}, {"id": "asc-2"}]);
    mission.live.as_mut().expect("is live").surface_craft = serde_json::from_value(craft).expect("are craft");
    let plan = |(t_s, id): (f64, &str)| {
        let Event::Planned(mut plan) = planned_without(t_s, &[MADE]) else { unreachable!("is a plan") };
        id.clone_into(&mut plan.prediction.as_mut().expect("has one").auvs[0].id);
        Event::Planned(plan)
    };
    let plans = [3.0, 4.0, 5.0].into_iter().flat_map(|t_s| [(MADE + t_s, ODD), (MADE + t_s, "auv-2")]);
    [made].into_iter().chain(plans.map(plan)).collect()
}

fn text(bytes: Vec<u8>) -> String {
    String::from_utf8(bytes).expect("is text")
}

#[tokio::test(start_paused = true)]
async fn a_record_in_two_parts_is_the_whole_wherever_it_is_split() {
    for events in [rehearsal(), simulated_with_a_refused_fix(), fleet()] {
        let n = events.len() as u64;
        let logged = Logged::of(events).await;
        let csv =
            |part: &EventFilter| text(logged.write_part(RecordFormat::Csv, part).expect("can be written"));
        let whole = csv(&WHOLE);
        let (head, rows) = whole.split_once('\n').expect("has a head");
        for after in 0..=n {
            let before = csv(&EventFilter { limit: Some(after), ..EventFilter::default() });
            let rest = csv(&EventFilter { after, ..EventFilter::default() });
            let rows_of = |part: &str| {
                let (its_head, rows) = part.split_once('\n').expect("has a head");
                assert_eq!(its_head, head);
                rows.to_owned()
            };
            assert_eq!(rows_of(&before) + &rows_of(&rest), rows, "after {after}");
        }
    }
}

#[tokio::test(start_paused = true)]
async fn rows_of_selected_kinds_equal_those_of_the_whole() {
    for events in [rehearsal(), simulated_with_a_refused_fix(), fleet()] {
        let n = events.len() as u64;
        let logged = Logged::of(events.clone()).await;
        let whole = table(&logged.written(RecordFormat::Csv));
        for kinds in [&["planned", "ran"][..], &["ran", "finished"], &["paused"], &["reported"]] {
            for after in 0..=n {
                let part = EventFilter {
                    after,
                    limit: None,
                    kinds: kinds.iter().map(|kind| (*kind).to_owned()).collect(),
                };
                let written = logged.write_part(RecordFormat::Csv, &part);
                let is_wanted = |row: &&BTreeMap<String, String>| {
                    let sequence: usize = row["sequence"].parse().expect("is a number");
                    after < sequence as u64 && kinds.contains(&events[sequence - 1].kind())
                };
                let expected: Vec<_> = whole.iter().filter(is_wanted).cloned().collect();
                assert_eq!(table(&written.expect("can be written")), expected, "{kinds:?} after {after}");
            }
        }
    }
}

#[tokio::test(start_paused = true)]
async fn a_simulated_mission_has_a_row_when_a_fix_begins_to_be_refused() {
    let logged = Logged::of(simulated_with_a_refused_fix()).await;
    let rows = table(&logged.written(RecordFormat::Csv));
    let refused = rows.iter().filter(|row| row["kind"] == "refused");
    let refused: Vec<_> =
        refused.map(|row| [&row["sequence"], &row["t_s"], &row["vehicle"]].map(String::as_str)).collect();
    assert_eq!(refused, [["4", "2.5", "auv-2"]]);
}

#[tokio::test(start_paused = true)]
async fn a_known_row_has_the_position_and_the_age_of_one_fix() {
    let mut events = simulated_with_a_refused_fix();
    for event in &mut events {
        let Event::Planned(plan) = event else { continue };
        let auv = &mut plan.prediction.as_mut().expect("has one").auvs[0];
        // The estimate is 1.5 s old: it is from an older fix than the newest, which is refused.
        auv.heard = Some(wire::Heard { t_s: 2.5, north_m: 11.0, east_m: -4.0 });
    }
    let rows = table(&Logged::of(events).await.written(RecordFormat::Csv));
    let known: Vec<_> = rows.iter().filter(|row| row["kind"] == "known").collect();
    assert_eq!(known.len(), 3);
    for row in known {
        let number = |name: &str| -> f64 { row[name].parse().expect("is a number") };
        assert_eq!((number("t_s") - number("age_s"), number("north_m"), number("east_m")), (2.5, 11.0, -4.0));
    }
}
