//! Metrics of several craft together.

use std::collections::BTreeMap;

use planner::snapshot::VESSEL_SEPARATION_DEFAULT;
use serde::Serialize;

use crate::metrics::{SurfaceCraftMetrics, Violation, rms};
use crate::record::{Record, Row};

/// Metrics of several craft that share AUVs, by true positions.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FleetMetrics {
    /// Least distance between two of them, m.
    pub craft_separation_m: f64,
    /// Nearer to each other than the distance to keep.
    pub too_near_m: Violation,
    /// Number of times that an AUV changed its craft.
    pub reassignments: usize,
    /// Root mean square horizontal distance of the AUVs that have a craft from it, m.
    pub company_rms_m: f64,
    /// Time for which each had each AUV, s, by their names.
    pub served_s: BTreeMap<String, BTreeMap<String, f64>>,
    /// Each one's own metrics; those of AUVs are by all craft.
    pub craft: BTreeMap<String, SurfaceCraftMetrics>,
}

impl FleetMetrics {
    /// The metrics of `record`; none with fewer than two craft.
    pub fn of(record: &Record) -> Option<Self> {
        let least = |row: &Row| {
            let craft: Vec<_> = row.craft().map(|craft| craft.position).collect();
            let pairs = craft
                .iter()
                .enumerate()
                .flat_map(|(i, one)| craft[..i].iter().map(move |other| (one - other).norm()));
            pairs.reduce(f64::min)
        };
        let craft_separation_m = record.rows.iter().filter_map(least).reduce(f64::min)?;
        let kept = record.bounds.vessel_separation.unwrap_or(VESSEL_SEPARATION_DEFAULT);
        let changed = |pair: &[Row], auv: usize| {
            let [before, after] = [&pair[0], &pair[1]].map(|row| row.auvs[auv].craft);
            before.is_some() && after.is_some() && before != after
        };
        let changes = |pair: &[Row]| (0..record.auv_ids.len()).filter(|auv| changed(pair, *auv)).count();
        let company = record.rows.iter().flat_map(|row| {
            row.auvs
                .iter()
                .filter_map(|auv| Some((row.craft().nth(auv.craft?)?.position - auv.position).norm()))
        });
        let each = || record.fleet.iter().enumerate();
        Some(Self {
            craft_separation_m,
            too_near_m: Violation::of(record, &|row| least(row).map_or(0.0, |least| kept - least)),
            reassignments: record.rows.windows(2).map(changes).sum(),
            company_rms_m: rms(&company.collect::<Vec<_>>()),
            served_s: each().map(|(number, craft)| (craft.id.clone(), served(record, number))).collect(),
            craft: each()
                .filter_map(|(number, craft)| {
                    Some((craft.id.clone(), SurfaceCraftMetrics::of(&record.of_craft(number))?))
                })
                .collect(),
        })
    }
}

/// Time for which the craft with this number had each AUV, s.
fn served(record: &Record, number: usize) -> BTreeMap<String, f64> {
    let seconds = |auv: usize| {
        let has = record.rows.iter().filter(|row| row.auvs[auv].craft == Some(number));
        has.fold(0.0, |seconds, _| seconds + record.interval)
    };
    record.auv_ids.iter().enumerate().map(|(auv, id)| (id.clone(), seconds(auv))).collect()
}
