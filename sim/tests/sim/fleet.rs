//! Several surface craft that share AUVs.

use nalgebra::Vector2;
use pilotfish_sim::fleet::{self, Assigner, FleetMetrics};
use pilotfish_sim::metrics::SurfaceCraftMetrics;
use pilotfish_sim::record::{Record, Row};
use pilotfish_sim::scenario::{Files, Scenario};

use crate::{flown_by, mpc, named, near, parsed, rows};

fn text(name: &str) -> &'static str {
    Scenario::text(name).expect("is built in")
}

fn flown(scenario: &Scenario, assigner: Assigner, seed: u64) -> Record {
    fleet::run(scenario, assigner, (seed, None), &mut |_| {}).expect("flies")
}

/// Positions of the craft in a row.
fn craft(row: &Row) -> Vec<Vector2<f64>> {
    row.craft().map(|craft| craft.position).collect()
}

#[test]
fn a_list_of_one_craft_is_that_craft() {
    let table = text("paper-tracking");
    let list = table.replace("[surface_craft]", "[[surface_craft]]");
    let [one, same] = [table, &list].map(|text| flown_by(&parsed(text).lasting(40.0), &mut mpc(), 3));
    assert_eq!(one, same);
}

#[test]
fn a_craft_has_what_it_leaves_out_from_the_first_and_draws_of_its_own() {
    let scenario = named("fleet-survey");
    let [first, second] = &scenario.surface_craft[..] else { panic!("two craft") };
    assert_eq!((first.class.clone(), first.north_m.clone()), (second.class.clone(), second.north_m.clone()));
    assert_ne!((&first.id, &first.east_m), (&second.id, &second.east_m));
    let starts = scenario.starts(5).expect("start");
    let [one, two] = &starts[..] else { panic!("two starts") };
    let north = |start: &pilotfish_sim::scenario::Start| {
        start.world.surface_craft.as_ref().expect("has one").position().x
    };
    assert!((north(one) - north(two)).abs() > 1e-3, "both are drawn");
    // The AUVs are the same.
    for (here, there) in one.world.auvs.iter().zip(&two.world.auvs) {
        assert_eq!(here.state, there.state);
    }
    let alone = scenario.start(5).expect("starts").world;
    assert_eq!(
        alone.surface_craft.expect("has one").position(),
        one.world.surface_craft.as_ref().expect("has one").position()
    );
}

#[test]
fn craft_move_no_auv_and_equal_seeds_give_equal_records() {
    let scenario = named("fleet-survey").lasting(40.0);
    let record = flown(&scenario, Assigner::Planner, 2);
    assert_eq!(record, flown(&scenario, Assigner::Planner, 2));
    assert_ne!(record.rows, flown(&scenario, Assigner::Planner, 3).rows);
    let alone = flown_by(&scenario, &mut mpc(), 2);
    for (row, other) in record.rows.iter().zip(&alone.rows) {
        assert_eq!(row.craft().count(), 2);
        for (auv, same) in row.auvs.iter().zip(&other.auvs) {
            assert_eq!((auv.position, auv.depth), (same.position, same.depth));
        }
    }
}

#[test]
fn ranges_of_all_craft_fix_an_auv_that_one_of_them_serves() {
    let scenario = named("fleet-square").lasting(500.0);
    let error = |record: &Record| {
        let settled = record.rows.iter().filter(|row| 200.0 <= row.time);
        let errors = settled.filter_map(|row| Some(row.auvs[0].navigation?.error.powi(2)));
        let errors: Vec<f64> = errors.collect();
        (errors.iter().sum::<f64>() / errors.len() as f64).sqrt()
    };
    let (mut three, mut one) = (0.0, 0.0);
    for seed in 1..3 {
        three += error(&flown(&scenario, Assigner::Planner, seed));
        one += error(&flown_by(&scenario, &mut mpc(), seed));
    }
    assert!(three < one, "{three} and {one}");
}

#[test]
fn a_dead_craft_drifts_and_its_auvs_have_another_craft_in_the_next_second() {
    let scenario = parsed(&text("fleet-dies").replace("from_s = 600", "from_s = 30")).lasting(60.0);
    let record = flown(&scenario, Assigner::Planner, 1);
    let (sound, dead) = (&record.rows[29], &record.rows[30]);
    assert!(sound.auvs.iter().any(|auv| auv.craft == Some(1)), "it had one");
    for row in &record.rows[30..] {
        assert!(row.auvs.iter().all(|auv| [Some(0), Some(2)].contains(&auv.craft)));
    }
    let [before, after] = [dead, &record.rows[59]].map(|row| *row.craft().nth(1).expect("is still there"));
    // Its thrusters run down in a second; what is left of its speed is spent by drag.
    assert!(after.surge < 0.5 * before.surge && after.thrust_port.abs() < 1e-3, "{after:?}");
    assert!(record.faults.len() == 1);
    let alive = flown(&named("fleet-dies").lasting(60.0), Assigner::Planner, 1);
    assert_eq!(record.rows[..30], alive.rows[..30]);
}

#[test]
fn each_craft_keeps_clear_of_vessels_that_it_hears_and_the_nearest_pass_of_any_counts() {
    let record = flown(&named("fleet-traffic").lasting(420.0), Assigner::Planner, 1);
    let traffic = SurfaceCraftMetrics::of(&record).and_then(|all| all.traffic).expect("met vessels");
    assert!(traffic.too_near_m.count == 0, "{traffic:?}");
    let fleet = FleetMetrics::of(&record).expect("has several");
    let each = fleet.craft.values().filter_map(|craft| craft.traffic.map(|of| of.least_m));
    assert_eq!((each.clone().count(), each.reduce(f64::min)), (2, Some(traffic.least_m)));
    let goes_straight = |row: &Row| row.craft().all(|craft| craft.manoeuvre.is_none());
    assert!(!record.rows.iter().all(goes_straight), "some have to dodge");
}

#[test]
fn rules_assign_what_craft_may_serve_and_one_craft_leaves_the_others_where_they_are() {
    let limited = text("fleet-survey").replace("id = \"asc-2\"", "id = \"asc-2\"\nserves = [\"auv-4\"]");
    let scenario = parsed(&limited).lasting(30.0);
    for assigner in Assigner::RULES.into_iter().chain([Assigner::Planner]) {
        let record = flown(&scenario, assigner.clone(), 1);
        assert_eq!(record.guide, assigner.guide());
        for row in &record.rows {
            let others = row.auvs[..3].iter();
            assert!(others.clone().all(|auv| auv.craft == Some(0)), "{assigner:?}");
        }
        let moved = (craft(&record.rows[29])[1] - craft(&record.rows[0])[1]).norm();
        let stays = record.rows[29].auvs[3].craft == Some(0);
        assert_eq!(moved < 5.0, stays, "{assigner:?}: {moved} m");
    }
}

#[test]
fn craft_that_call_without_the_planner_s_table_drown_each_other() {
    let oldest = |calls: &str| {
        let scenario = parsed(&text("fleet-dies").replace("\"planned\"", calls)).lasting(150.0);
        let record = flown(&scenario, Assigner::Fixed(vec![0, 1, 2, 0, 1]), 1);
        let ages = record.rows[149].auvs.iter().map(|auv| auv.known.expect("is known").age);
        ages.map(f64::round).collect::<Vec<_>>()
    };
    // A frame lasts 15 s, and a fix takes 2 s and the way of sound.
    assert!(oldest("\"planned\"").iter().all(|age| *age <= 18.0), "{:?}", oldest("\"planned\""));
    // In the first slot all three call; in the second the first two, in range of each other.
    assert_eq!(oldest("\"unplanned\""), [149.0; 5]);
}

#[test]
fn metrics_of_a_fleet_are_those_of_its_craft_together() {
    let record = flown(&named("fleet-speeds").lasting(120.0), Assigner::Nearest, 4);
    let together = SurfaceCraftMetrics::of(&record).expect("has craft");
    let fleet = FleetMetrics::of(&record).expect("has several");
    let each: Vec<_> = fleet.craft.values().collect();
    near(together.energy_j, each.iter().map(|craft| craft.energy_j).sum(), 1e-6);
    let squares = each.iter().map(|craft| craft.rms_m.powi(2)).sum::<f64>() / 2.0;
    near(together.rms_m, squares.sqrt(), 1e-9);
    let apart = record.rows.iter().map(|row| (craft(row)[0] - craft(row)[1]).norm());
    assert_eq!(fleet.craft_separation_m, apart.fold(f64::INFINITY, f64::min));
    let served = fleet.served_s.values().flat_map(|auvs| auvs.values()).sum::<f64>();
    assert_eq!(served, 4.0 * 120.0);
    assert!(FleetMetrics::of(&record.of_craft(1)).is_none());
    // The faster of two hulls is judged by its own limits.
    assert_eq!(together.violations.speed_mps.count, 0);
    assert!(1.7 < record.rows[119].consorts[0].surge, "{}", record.rows[119].consorts[0].surge);
}

#[test]
fn what_does_not_fit_several_craft_is_refused_with_its_field() {
    let whole = text("fleet-dies");
    let five = "[[surface_craft]]\nid = \"asc-4\"\n\n".repeat(5);
    for [right, wrong, says] in rows(
        r#"
        id = "asc-2" | id = "asc-1" | surface_craft[1].id: "asc-1" is the name of two vehicles
        id = "asc-2" | id = "auv-1" | surface_craft[1].id: "auv-1" is the name of two vehicles
        id = "asc-2" | id = "Asc" | surface_craft[1].id: "Asc" is not 1 to
        id = "asc-2" | serves = [] | surface_craft[1].id: is missing
        id = "asc-2" | id = "asc-2"\nserves = ["auv-9"] | surface_craft[1].serves[0]: there is no vehicle "auv-9"
        id = "asc-2" | id = "asc-2"\ngoal.track.auv = "auv-1" | surface_craft[1].goal: all craft have that of the first
        id = "asc-2" | id = "asc-2"\nspeed_mps = 4 | surface_craft[1].speed_mps: 4 m/s needs more
        id = "asc-2" | id = "asc-2"\nspeed_mps = 40 | surface_craft[1].speed_mps: 40 is outside
        id = "asc-2" | id = "asc-2"\nsped_mps = 4 | surface_craft[1].sped_mps: unknown field
        craft = "asc-2" | craft = "asc-4" | faults[0].craft: there is no surface craft "asc-4"
        [[faults]] | [[traffic]]\nid = "a"\nnorth_m = 0\neast_m = 0\ncourse_rad = 0\nspeed_mps = 1\nbehaviour = "gives_way"\n[[faults]] | traffic[0].behaviour: no vessel gives way to several craft
        [[faults]] | MANY[[faults]] | surface_craft: 8 craft; at most 6
        "#,
    ) {
        assert!(whole.contains(&right), "{right}");
        let text = whole.replacen(&right, &wrong.replace("MANY", &five), 1);
        let read = Scenario::parse(&text, "my.toml", Files::default());
        let refused = read.and_then(Scenario::checked).expect_err(&wrong);
        assert!(refused.to_string().contains(&says), "{refused}");
    }
    let nobody = ["asc-1", "asc-2", "asc-3"].into_iter().fold(whole.to_owned(), |text, id| {
        text.replacen(&format!("id = \"{id}\""), &format!("id = \"{id}\"\nserves = [\"auv-1\"]"), 1)
    });
    let refused = parsed(&nobody).checked().expect_err("nobody serves the others").to_string();
    assert!(refused.contains("surface_craft[0].goal: no craft may serve \"auv-2\""), "{refused}");
}
