//! A record made by hand, for the tests of the formats.

use nalgebra::Vector2;
use serde_json::{Value, json};

use crate::table::{KNOWN, Row, SURFACE_CRAFT};
use crate::{Disc, Entry, ExportError, Origin, SCHEMA_VERSION, Scene, Source};

/// Three instants of a surface craft and one AUV off Sesimbra. Both go north-east; some knowledge
/// is missing at times.
pub(super) fn record() -> Sample {
    Sample {
        origin: Some(Origin { latitude: 38.41_f64.to_radians(), longitude: (-9.12_f64).to_radians() }),
        path: (0..=20).map(|i| Vector2::new(f64::from(i), 3.0)).collect(),
        keep_outs: vec![Disc { centre: Vector2::new(40.0, 30.0), radius: 12.0 }],
        // Clockwise seen from above: north-east corner, then south.
        area: vec![
            Vector2::new(100.0, 100.0),
            Vector2::new(-50.0, 100.0),
            Vector2::new(-50.0, -50.0),
            Vector2::new(100.0, -50.0),
        ],
        instants: 3,
        events: vec![],
        true_headings: false,
    }
}

pub(super) struct Sample {
    pub(super) origin: Option<Origin>,
    pub(super) path: Vec<Vector2<f64>>,
    pub(super) keep_outs: Vec<Disc>,
    pub(super) area: Vec<Vector2<f64>>,
    pub(super) instants: u32,
    /// JSON of one event an instant, if there are any.
    pub(super) events: Vec<&'static str>,
    pub(super) true_headings: bool,
}

impl Sample {
    pub(super) fn rows(&self) -> Vec<Row<'static>> {
        (0..self.instants).flat_map(|k| rows(0.5 * f64::from(k))).collect()
    }
}

impl Source for Sample {
    type Error = ExportError;

    fn about(&self) -> Vec<(&'static str, Value)> {
        vec![("schema_version", json!(SCHEMA_VERSION)), ("scenario", json!("by-hand")), ("seed", json!(7))]
    }

    fn origin(&self) -> Option<Origin> {
        self.origin
    }

    fn has_true_headings(&self) -> bool {
        self.true_headings
    }

    fn scene(&self) -> Scene<'_> {
        Scene { paths: vec![("auv-1", &self.path)], keep_outs: self.keep_outs.clone(), area: &self.area }
    }

    fn for_each(
        &self,
        take: &mut dyn FnMut(&Entry<'_>) -> Result<(), ExportError>,
    ) -> Result<(), ExportError> {
        (0..self.instants).try_for_each(|k| {
            let logged_s = 0.5 * f64::from(k);
            take(&Entry {
                logged_s,
                event: self.events.get(k as usize).map(|event| event.as_bytes()),
                rows: rows(logged_s),
            })
        })
    }
}

fn rows(time: f64) -> Vec<Row<'static>> {
    let row = Row { t_s: Some(time), ..Row::default() };
    let asc = Row {
        kind: Some("truth"),
        vehicle: Some(SURFACE_CRAFT),
        north_m: Some(1.0 + time),
        east_m: Some(2.0 + 0.3 * time),
        depth_m: Some(0.0),
        heading_rad: Some(0.3 + time),
        goal_north_m: Some(4.0 + time),
        goal_east_m: Some(5.0),
        ..row
    };
    let auv = Row {
        kind: Some("truth"),
        vehicle: Some("auv-1"),
        north_m: Some(4.0 + time),
        east_m: Some(5.0),
        depth_m: Some(9.0 + time),
        pitch_rad: Some(-0.87),
        heading_rad: Some(0.5),
        ..row
    };
    let known = Row {
        kind: Some(KNOWN),
        vehicle: Some("auv-1"),
        north_m: Some(3.9),
        east_m: Some(5.1),
        age_s: (0.0 < time).then_some(0.4 * time),
        ..row
    };
    let planned = Row {
        kind: Some("planned"),
        sequence: Some(7),
        reference_speed_mps: Some(0.1 + 0.2),
        method: Some("mpc"),
        ..row
    };
    vec![planned, asc, auv, known]
}
