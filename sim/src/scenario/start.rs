//! From a scenario and a seed to a world and its observer.

use std::sync::Arc;

use ::record::table::SURFACE_CRAFT;
use planner::{
    path::{Path, Segment},
    snapshot::{AUVS_MAX, ID_LENGTH_MAX, Limits},
};

use crate::observe::{Ais, Briefing, Observer, ReportedAs};
use crate::own_navigation::{OwnNavigation, RangingFaults};
use crate::record::{Bounds, Origin};
use crate::scenario::ScenarioError;
use crate::scenario::file::{AisFile, Declares, Scenario};
use crate::world::World;

mod craft;
mod draw;
mod environment;
mod fleet;
mod goal;
mod invalid;
mod path;
mod survey;
mod track;
mod traffic;
mod turns;
mod vehicles;

pub use invalid::InvalidScenario;

use draw::{Draw, ais_stream, check_count, navigation_stream};
use environment::{bounds, ranging};
use invalid::{invalid, refused};

/// Time between two points of a declared track, s: a few metres.
const DECLARED_INTERVAL: f64 = 4.0;
/// Largest number of points of a declared track, short of those that a path may have.
const DECLARED_MAX: f64 = 5000.0;

/// A mission about to begin.
#[derive(Clone, Debug)]
pub struct Start {
    /// The truth.
    pub world: World,
    /// The observer of the truth, if there is a surface craft.
    pub observer: Option<Observer>,
    /// The limits by which the surface craft is judged, if there is one.
    pub limits: Option<Limits>,
    /// Slant range that counts as contact, m, if there is a surface craft.
    pub contact_range: Option<f64>,
    /// The navigation of the AUVs, if the surface craft localises them.
    pub own_navigation: Option<OwnNavigation>,
    /// Duration of the mission, s.
    pub duration: f64,
    /// Start of the settled metrics, s.
    pub settled_after: f64,
    /// Bounds of the surface craft.
    pub bounds: Bounds,
    /// Position of the datum on Earth.
    pub origin: Option<Origin>,
}

impl Scenario {
    /// The start of the mission with `seed`, with the first of several surface craft. The numbers
    /// of one seed may not fit together even if those of another do.
    pub fn start(&self, seed: u64) -> Result<Start, ScenarioError> {
        self.begin(seed, 0).map_err(|wrong| self.source.wrong(wrong))
    }

    /// The starts of all surface craft, each in a world of its own that differs by the craft alone.
    pub fn starts(&self, seed: u64) -> Result<Vec<Start>, ScenarioError> {
        let starts = (0..self.surface_craft.len()).map(|number| self.begin(seed, number));
        starts.collect::<Result<_, _>>().map_err(|wrong| self.source.wrong(wrong))
    }

    /// The start of the surface craft with this number, if there is one.
    fn begin(&self, seed: u64, number: usize) -> Result<Start, InvalidScenario> {
        let mut draw = Draw { seed, taken: 0 };
        self.check_names()?;
        let duration = draw.take(&self.duration_s);
        let settled_after = draw.take(&self.settled_after_s);
        // The last row of a record is at most a second before the end.
        if duration.floor() - 1.0 < settled_after {
            let reason =
                format_args!("{settled_after} s is less than a second before the end at {duration} s");
            return refused("settled_after_s", reason);
        }
        let origin = self.origin.as_ref().map(|origin| Origin {
            latitude: draw.take(&origin.lat_deg).to_radians(),
            longitude: draw.take(&origin.lon_deg).to_radians(),
        });
        let craft = self.all_craft(&mut draw)?.into_iter().nth(number);
        let tracks = self.tracks(origin)?;
        let auvs = (0..).zip(self.auvs.iter().zip(tracks));
        let auvs = auvs.map(|(i, (file, track))| self.auv(i, file, track, origin, &mut draw));
        let auvs = auvs.collect::<Result<Vec<_>, _>>()?;
        let water = self.water(&self.water, seed, &mut draw)?;
        let mut bounds = bounds(&self.bounds, &mut draw)?;
        let faults = self.faults(number, &mut draw)?;
        let (surface_craft, briefing, contact_range) = match craft {
            Some((craft, briefing, range)) => {
                let bounds = bounds.clone();
                (Some(craft), Some(Briefing { bounds, ..briefing }), Some(range))
            }
            None => (None, None, None),
        };
        let mut world = World::new(surface_craft, auvs, water, faults);
        self.declare_tracks(&mut world, duration)?;
        let limits = briefing.as_ref().map(|briefing| briefing.limits);
        let navigates = |briefing: &&Briefing| briefing.reported_as != ReportedAs::Ranges;
        let own_navigation = briefing.as_ref().filter(navigates).and_then(|briefing| {
            let faults = self.knowledge.ranging.as_ref();
            let faults = faults.map_or_else(RangingFaults::default, |file| ranging(file, &mut draw));
            let random = navigation_stream(seed);
            let anchored = self.knowledge.ranging.as_ref().map_or(&[][..], |file| &file.anchored);
            let anchored = draw.points(anchored);
            OwnNavigation::new(&briefing.goal, faults, bounds.range_max, anchored, &mut world, random)
        });
        let observer = briefing.map(|briefing| self.observer(&world, briefing, (seed, number), &mut draw));
        let mut observer = observer.transpose()?;
        // Drawn last: other numbers of a scenario do not depend on its vessels.
        if !self.traffic.is_empty() {
            world.vessels = self.traffic.iter().map(|file| traffic::vessel(file, &mut draw)).collect();
            let setup = traffic::ais(self.knowledge.ais.as_ref().unwrap_or(&AisFile::default()), &mut draw);
            if let Some(observer) = &mut observer {
                observer.ais = Some(Ais::new(setup, world.vessels.len(), ais_stream(seed)));
            }
        }
        if !self.traffic.is_empty() || self.has_fleet() {
            bounds.vessel_separation = draw.take_optional(self.bounds.vessel_separation_m.as_ref());
            if let Some(observer) = &mut observer {
                observer.briefing.bounds.vessel_separation = bounds.vessel_separation;
            }
        }
        Ok(Start {
            world,
            observer,
            limits,
            contact_range,
            own_navigation,
            duration,
            settled_after,
            bounds,
            origin,
        })
    }

    /// Lets the vehicles that declare what they will sail do so.
    fn declare_tracks(&self, world: &mut World, duration: f64) -> Result<(), InvalidScenario> {
        if self.auvs.iter().all(|file| file.declares == Declares::Plan) {
            return Ok(());
        }
        let interval = DECLARED_INTERVAL.max(duration / DECLARED_MAX);
        let tracks = world.tracks_ahead(duration, interval);
        for (i, (auv, track)) in world.auvs.iter_mut().zip(tracks).enumerate() {
            if self.auvs[i].declares == Declares::Sailed {
                let waypoints = Segment::Waypoints {
                    points: track.into_iter().map(Into::into).collect(),
                    fillet_m: None,
                    turn_radius_m: None,
                    legs: vec![],
                };
                let path = Path::from_segments(&[waypoints], false);
                let path = path.map_err(|error| invalid(format!("auvs[{i}].declares"), error))?;
                auv.declared = Arc::new(path);
            }
        }
        Ok(())
    }

    fn check_names(&self) -> Result<(), InvalidScenario> {
        check_name("name", &self.name)?;
        if !(1..=AUVS_MAX).contains(&self.auvs.len()) {
            return refused(
                "auvs",
                format_args!("{} vehicles; 1 to {AUVS_MAX} are allowed", self.auvs.len()),
            );
        }
        for (i, auv) in self.auvs.iter().enumerate() {
            let (field, id) = (format!("auvs[{i}].id"), &auv.id);
            check_name(&field, id)?;
            if id == SURFACE_CRAFT {
                return refused(field, format_args!("{SURFACE_CRAFT:?} is the name of the surface craft"));
            }
            if self.auvs[..i].iter().any(|earlier| earlier.id == *id) {
                return refused(field, format_args!("{id:?} is the name of two vehicles"));
            }
        }
        self.check_fleet()?;
        check_count("traffic", self.traffic.len())?;
        for (i, vessel) in self.traffic.iter().enumerate() {
            let (field, id) = (format!("traffic[{i}].id"), &vessel.id);
            check_name(&field, id)?;
            if self.traffic[..i].iter().any(|earlier| earlier.id == *id) {
                return refused(field, format_args!("{id:?} is the identity of two vessels"));
            }
        }
        Ok(())
    }

    /// The index of the vehicle with this `id`.
    fn auv_called(&self, field: &str, id: &str) -> Result<usize, InvalidScenario> {
        self.auvs.iter().position(|auv| auv.id == id).ok_or_else(|| {
            let known: Vec<&str> = self.auvs.iter().map(|auv| auv.id.as_str()).collect();
            let known = known.join(", ");
            invalid(field, format_args!("there is no vehicle {id:?}; the vehicles are {known}"))
        })
    }
}

/// Names must be safe in files, tables and URLs.
fn check_name(field: &str, name: &str) -> Result<(), InvalidScenario> {
    let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
    if (1..=ID_LENGTH_MAX).contains(&name.len()) && name.chars().all(plain) {
        return Ok(());
    }
    let reason = format_args!("{name:?} is not 1 to {ID_LENGTH_MAX} lower-case letters, digits and hyphens");
    refused(field, reason)
}
