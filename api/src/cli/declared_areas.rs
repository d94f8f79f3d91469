//! `--no-go`: areas to keep out of, from GeoJSON files.

use std::error::Error;
use std::fs;
use std::path::PathBuf;

use clap::Args;
use geodesy::Datum;
use planner::snapshot::Origin;
use route::{Area, Place, RoutePoint};
use serde_json::{Value, json};
use sim::scenario::{NoGoFile, Point, Scenario};

use super::declared_routes::fixed;
use super::failure::{Failure, because_of};

/// Areas to keep out of.
#[derive(Debug, Args)]
pub(crate) struct DeclaredAreas {
    /// Areas to keep out of: the polygons of a GeoJSON file (docs/no-go.md), added to those that
    /// are there. May be repeated.
    #[arg(long, value_name = "FILE")]
    no_go: Vec<PathBuf>,
}

impl DeclaredAreas {
    pub(crate) fn is_empty(&self) -> bool {
        self.no_go.is_empty()
    }

    fn read(&self) -> Result<Vec<Area>, Failure> {
        let mut areas = Vec::new();
        for file in &self.no_go {
            let bytes = fs::read(file).map_err(because_of(format!("cannot read {}", file.display())))?;
            areas.extend(route::areas(&bytes).map_err(because_of(file.display().to_string()))?);
        }
        Ok(areas)
    }

    /// Adds the areas to `body`, a snapshot or the live part of a mission. The planner reports
    /// other bodies.
    pub(crate) fn put_into(&self, body: &mut Value) -> Result<(), Failure> {
        let ring = |ring: &Vec<RoutePoint>| json!(ring.iter().map(|point| point.place).collect::<Vec<_>>());
        let areas = self.read()?;
        let Some(body) = body.as_object_mut().filter(|_| !areas.is_empty()) else { return Ok(()) };
        let there = body.entry("no_go").or_insert(Value::Null);
        let mut all = there.as_array().cloned().unwrap_or_default();
        for area in areas {
            let rings: Vec<Value> = area.rings.iter().map(ring).collect();
            let mut put = json!({ "polygon": rings.first(), "holes": rings.get(1..) });
            if !area.name.is_empty() {
                put["name"] = json!(area.name);
            }
            all.push(put);
        }
        *there = json!(all);
        Ok(())
    }

    /// Adds the areas to `scenario`, which has an origin.
    pub(crate) fn add_to(&self, scenario: &mut Scenario, seed: u64) -> Result<(), Box<dyn Error>> {
        for area in self.read()? {
            let origin = scenario.start(seed)?.origin;
            let datum = Datum::new(&origin.ok_or("--no-go: the scenario has no origin")?)?;
            let corner = |point: &RoutePoint| -> Result<Point, Box<dyn Error>> {
                let Place::Earth { lat_deg, lon_deg } = point.place else {
                    return Err("--no-go: areas have latitudes and longitudes".into());
                };
                let local = datum.to_local(&Origin { lat_deg, lon_deg }.into())?;
                let metres = |value| fixed("coordinates", value);
                Ok(Point(vec![metres(local.x)?, metres(local.y)?]))
            };
            let mut rings =
                area.rings.iter().map(|ring| ring.iter().map(corner).collect::<Result<Vec<_>, _>>());
            let polygon = rings.next().transpose()?.unwrap_or_default();
            let holes = rings.collect::<Result<_, _>>()?;
            scenario.bounds.no_go.push(NoGoFile { polygon, holes });
        }
        Ok(())
    }
}
