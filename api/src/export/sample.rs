//! A record made by hand, for the tests of the formats.

use nalgebra::Vector2;
use planner::{
    angle::Heading,
    los::Reference,
    plan::Method,
    snapshot::{KeepOut, Limits},
};
use sim::record::{
    Bounds, DiverReference, DiverRow, KnownDiver, KnownSurfaceCraft, Origin, Record, Row, SurfaceCraftRow,
};

/// Three ticks of a surface craft and one vehicle off Sesimbra. Both go north-east; some of what was known
/// is missing at times.
pub(super) fn record() -> Record {
    Record {
        scenario: "by-hand".to_owned(),
        title: "Three ticks, made by hand".to_owned(),
        guide: "mpc".to_owned(),
        seed: 7,
        interval: 0.5,
        origin: Some(Origin {
            latitude: 38.41_f64.to_radians(),
            longitude: (-9.12_f64).to_radians(),
        }),
        settled_after: 0.0,
        contact_range: Some(10.0),
        limits: Some(Limits::MEDUSA),
        plant: None,
        bounds: Bounds {
            keep_outs: vec![KeepOut {
                centre: Vector2::new(40.0, 30.0),
                radius: 12.0,
            }],
            // Clockwise seen from above: north-east corner, then south.
            area: vec![
                Vector2::new(100.0, 100.0),
                Vector2::new(-50.0, 100.0),
                Vector2::new(-50.0, -50.0),
                Vector2::new(100.0, -50.0),
            ],
            range_max: Some(100.0),
            energy_max: None,
        },
        diver_ids: vec!["auv-1".to_owned()],
        paths: vec![(0..=20).map(|i| Vector2::new(f64::from(i), 3.0)).collect()],
        rows: (0..3).map(row).collect(),
    }
}

fn row(k: u32) -> Row {
    let time = 0.5 * f64::from(k);
    Row {
        time,
        surface_craft: Some(surface_craft(time)),
        divers: vec![diver(time)],
    }
}

fn surface_craft(time: f64) -> SurfaceCraftRow {
    SurfaceCraftRow {
        position: Vector2::new(1.0 + time, 2.0 + 0.3 * time),
        heading: 0.3 + time,
        surge: 1.1,
        sway: -0.1,
        yaw_rate: 0.02,
        thrust_port: 10.0,
        thrust_starboard: 12.5,
        current: Vector2::new(0.01, -0.02),
        goal: Vector2::new(4.0 + time, 5.0),
        energy: 30.0 * time,
        heading_travel: 0.1 * time,
        known: KnownSurfaceCraft {
            time,
            position: Vector2::new(1.5 + time, 2.5),
            heading: Heading::new(0.31),
            surge: 1.0,
            current: (0.0 < time).then(|| Vector2::new(0.0, -0.02)),
        },
        reference: Reference {
            speed: 1.2,
            heading: Heading::new(-0.4),
        },
        method: if 0.0 < time {
            Method::Mpc
        } else {
            Method::SaturatedLos
        },
        predicted_rms: (0.0 < time).then_some(0.25),
        solve_ms: None,
    }
}

fn diver(time: f64) -> DiverRow {
    DiverRow {
        position: Vector2::new(4.0 + time, 5.0),
        depth: 9.0 + time,
        pitch: -0.87,
        heading: 0.5,
        surge: 0.3,
        current: Vector2::new(0.01, -0.02),
        reference: DiverReference {
            surge: 0.3,
            pitch: -0.873,
            heading: 0.45,
        },
        path_point: Vector2::new(4.0 + time, 3.0),
        along_track: 0.0,
        cross_track: 2.0,
        known: (0.0 < time).then(|| KnownDiver {
            position: Vector2::new(3.9, 5.1),
            depth: 8.0,
            course: 0.5,
            speed: 0.19,
            age: 0.4 * time,
        }),
    }
}
