//! The true state of the vehicles and the water, which advances in steps of one inner-loop period.
//!
//! From the bottom up: [`hull`] has masses, drag and thrusters; [`inner_loop`] their autopilots;
//! [`path_following`] and [`dive`] guide an AUV. [`surface_craft`] and [`auv`] are whole vehicles
//! (AUV classes: [`underwater_vehicle`]), which [`integrate`] moves in [`water`], with [`fault`]s.
//! [`plant`] has a hull's physical limits; [`vessel`]s are points. An AUV may repeat a
//! [`recorded_track`] instead.

use nalgebra::Vector2;
use planner::{angle::Heading, los::Reference};

pub mod auv;
pub mod dive;
pub mod fault;
pub mod hull;
pub mod inner_loop;
pub mod integrate;
pub mod path_following;
pub mod plant;
pub mod recorded_track;
pub mod surface_craft;
pub mod underwater_vehicle;
pub mod vessel;
pub mod water;

pub use surface_craft::{Sea, SurfaceCraft};

use auv::SimulatedAuv;
use fault::Faults;
use inner_loop::PERIOD;
use vessel::SimulatedVessel;
use water::Water;

/// The true state of vehicles and water.
#[derive(Clone, Debug)]
pub struct World {
    /// The surface craft, if the scenario has one.
    pub surface_craft: Option<SurfaceCraft>,
    /// The underwater vehicles, in the scenario's order.
    pub auvs: Vec<SimulatedAuv>,
    /// Other vessels, in the scenario's order.
    pub vessels: Vec<SimulatedVessel>,
    /// The water.
    pub water: Water,
    /// The faults.
    pub faults: Faults,
    periods: u32,
}

impl World {
    /// The world at the start.
    pub fn new(
        surface_craft: Option<SurfaceCraft>,
        mut auvs: Vec<SimulatedAuv>,
        water: Water,
        faults: Faults,
    ) -> Self {
        for auv in &mut auvs {
            let current = water.current(&auv.position(), auv.depth());
            auv.repeat_track(0.0, &current);
        }
        Self { surface_craft, auvs, vessels: Vec::new(), water, faults, periods: 0 }
    }

    /// Time since the start, s.
    pub fn time(&self) -> f64 {
        f64::from(self.periods) * PERIOD
    }

    /// Inner-loop periods since the start.
    pub fn periods(&self) -> u32 {
        self.periods
    }

    /// The positions (north, east), m, of every underwater vehicle in the next `duration` s, about
    /// `interval` s apart. The surface craft has no influence on them.
    pub fn tracks_ahead(&self, duration: f64, interval: f64) -> Vec<Vec<Vector2<f64>>> {
        let mut world = self.clone();
        let mut tracks = vec![vec![]; self.auvs.len()];
        let mut due = self.time();
        while world.time() <= self.time() + duration {
            if due <= world.time() {
                due += interval;
                for (track, auv) in tracks.iter_mut().zip(&world.auvs) {
                    track.push(auv.position());
                }
            }
            world.step(None);
        }
        tracks
    }

    /// Advances by one inner-loop period. Without a `reference`, the surface craft does not move.
    pub fn step(&mut self, reference: Option<&Reference>) {
        let time = self.time();
        if let (Some(craft), Some(reference)) = (&mut self.surface_craft, reference) {
            let sea = Sea {
                current: self.water.current(&craft.position(), 0.0),
                waves: self.water.wave_acceleration(),
            };
            let sound = craft.autopilot.heading;
            craft.autopilot.heading = sound.slowed(self.faults.heading_loop_slowed(time));
            let heading = reference.heading.radians() + self.faults.heading_offset(time);
            let reference = Reference { heading: Heading::new(heading), ..*reference };
            craft.step(&reference, self.faults.thrusters(time), &sea);
            craft.autopilot.heading = sound;
        }
        for (i, auv) in self.auvs.iter_mut().enumerate() {
            let current = self.water.current(&auv.position(), auv.depth());
            if !auv.repeat_track(f64::from(self.periods + 1) * PERIOD, &current) {
                auv.step(self.faults.behaviour(i, time), &current);
            }
        }
        if !self.vessels.is_empty() {
            let craft = self.surface_craft.as_ref();
            let seen = craft.map(|craft| (craft.position(), craft.water_velocity()));
            self.vessels.iter_mut().for_each(|vessel| vessel.step(time, seen));
        }
        self.water.step();
        self.periods += 1;
    }
}
