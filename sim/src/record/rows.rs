//! The record as rows of the table that all formats share.

use ::record::table::{KNOWN, Row as TableRow, SURFACE_CRAFT, VESSEL};
use ::record::{Disc, Entry, ExportError, SCHEMA_VERSION, Scene, Source};
use serde_json::{Value, json};

use super::{AuvRow, OWN_LAW, Origin, Record, Row, SurfaceCraftRow, VesselRow, method_name};

/// The kind of rows with a vehicle's true state.
const TRUTH: &str = "truth";

impl Source for Record {
    type Error = ExportError;

    fn about(&self) -> Vec<(&'static str, Value)> {
        vec![
            ("schema_version", json!(SCHEMA_VERSION)),
            ("scenario", json!(self.scenario)),
            ("title", json!(self.title)),
            ("guide", json!(self.guide)),
            ("seed", json!(self.seed)),
            ("interval_s", json!(self.interval)),
        ]
    }

    fn origin(&self) -> Option<Origin> {
        self.origin
    }

    fn scene(&self) -> Scene<'_> {
        let paths = self.auv_ids.iter().zip(&self.paths);
        let discs =
            self.bounds.keep_outs.iter().map(|disc| Disc { centre: disc.centre(), radius: disc.radius_m });
        Scene {
            paths: paths.map(|(id, path)| (id.as_str(), path.as_slice())).collect(),
            keep_outs: discs.collect(),
            area: &self.bounds.area,
        }
    }

    fn for_each(
        &self,
        take: &mut dyn FnMut(&Entry<'_>) -> Result<(), ExportError>,
    ) -> Result<(), ExportError> {
        self.rows
            .iter()
            .try_for_each(|row| take(&Entry { logged_s: row.time, event: None, rows: self.table_rows(row) }))
    }
}

impl Record {
    /// One instant: the plan, and each vehicle as it was and as it was known.
    fn table_rows(&self, row: &Row) -> Vec<TableRow<'_>> {
        let at = TableRow { t_s: Some(row.time), ..TableRow::default() };
        let craft = row.craft().enumerate().flat_map(|(number, craft)| {
            let id = self.fleet.get(number).map(|craft| craft.id.as_str());
            surface_craft(&at, id, craft)
        });
        let auvs = self.auv_ids.iter().zip(&row.auvs);
        let vessels = self.vessel_ids.iter().zip(&row.vessels).map(|(id, is)| vessel(&at, id, is));
        craft.chain(auvs.flat_map(|(id, is)| auv(&at, id, is))).chain(vessels).collect()
    }
}

fn vessel<'a>(at: &TableRow<'a>, id: &'a str, row: &VesselRow) -> TableRow<'a> {
    TableRow {
        kind: Some(VESSEL),
        vehicle: Some(id),
        length_m: Some(row.length),
        north_m: Some(row.position.x),
        east_m: Some(row.position.y),
        course_rad: Some(row.course),
        speed_mps: Some(row.speed),
        ..*at
    }
}

/// Rows of the craft called `id` of several, or of the only one.
fn surface_craft<'a>(at: &TableRow<'a>, id: Option<&'a str>, row: &SurfaceCraftRow) -> [TableRow<'a>; 3] {
    let asc = TableRow { vehicle: id.or(Some(SURFACE_CRAFT)), ..*at };
    let planned = TableRow {
        kind: Some("planned"),
        vehicle: id,
        reference_speed_mps: Some(row.reference.speed),
        reference_heading_rad: Some(row.reference.heading.radians()),
        method: Some(row.method.map_or(OWN_LAW, method_name)),
        predicted_rms_m: row.predicted_rms,
        solve_ms: row.solve_ms,
        ..*at
    };
    let truth = TableRow {
        kind: Some(TRUTH),
        north_m: Some(row.position.x),
        east_m: Some(row.position.y),
        depth_m: Some(0.0),
        heading_rad: Some(row.heading),
        speed_mps: Some(row.surge),
        sway_mps: Some(row.sway),
        yaw_rate_radps: Some(row.yaw_rate),
        current_north_mps: Some(row.current.x),
        current_east_mps: Some(row.current.y),
        thrust_port_n: Some(row.thrust_port),
        thrust_starboard_n: Some(row.thrust_starboard),
        energy_j: Some(row.energy),
        heading_travel_rad: Some(row.heading_travel),
        goal_north_m: Some(row.goal.x),
        goal_east_m: Some(row.goal.y),
        goal_distance_m: Some(row.distance()),
        ..asc
    };
    let known = TableRow {
        kind: Some(KNOWN),
        clock_s: Some(row.known.time),
        north_m: Some(row.known.position.x),
        east_m: Some(row.known.position.y),
        heading_rad: Some(row.known.heading.radians()),
        speed_mps: Some(row.known.surge),
        current_north_mps: row.known.current.map(|current| current.x),
        current_east_mps: row.known.current.map(|current| current.y),
        ..asc
    };
    [planned, truth, known]
}

fn auv<'a>(at: &TableRow<'a>, id: &'a str, row: &AuvRow) -> impl Iterator<Item = TableRow<'a>> + use<'a> {
    let auv = TableRow { vehicle: Some(id), ..*at };
    let truth = TableRow {
        kind: Some(TRUTH),
        north_m: Some(row.position.x),
        east_m: Some(row.position.y),
        depth_m: Some(row.depth),
        pitch_rad: Some(row.pitch),
        heading_rad: Some(row.heading),
        speed_mps: Some(row.surge),
        current_north_mps: Some(row.current.x),
        current_east_mps: Some(row.current.y),
        path_north_m: Some(row.path_point.x),
        path_east_m: Some(row.path_point.y),
        along_track_m: Some(row.along_track),
        cross_track_m: Some(row.cross_track),
        reference_speed_mps: Some(row.reference.surge),
        reference_heading_rad: Some(row.reference.heading),
        reference_pitch_rad: Some(row.reference.pitch),
        ..auv
    };
    let known = row.known.map(|known| TableRow {
        kind: Some(KNOWN),
        north_m: Some(known.position.x),
        east_m: Some(known.position.y),
        depth_m: Some(known.depth),
        course_rad: Some(known.course),
        speed_mps: Some(known.speed),
        age_s: Some(known.age),
        ..auv
    });
    [truth].into_iter().chain(known)
}
