//! The vehicles and the water, moving in steps of one inner-loop period.

use nalgebra::Vector2;
use planner::los::Reference;

use crate::{
    diver::Diver,
    fault::Faults,
    inner_loop::{PERIOD, SurfaceAutopilot, SurgeLoop},
    integrate::rk4,
    surface_craft::{SurfaceHull, SurfaceInput, SurfaceState, ThrusterHealth},
    water::{Water, WaveAcceleration},
};

/// The truth.
#[derive(Clone, Debug)]
pub struct World {
    /// The surface craft, where the scenario has one.
    pub surface_craft: Option<SurfaceCraft>,
    /// The underwater vehicles, in the scenario's order.
    pub divers: Vec<Diver>,
    /// The water.
    pub water: Water,
    /// What goes wrong, and when.
    pub faults: Faults,
    periods: u32,
}

impl World {
    /// The world at the start.
    #[must_use]
    pub fn new(
        surface_craft: Option<SurfaceCraft>,
        divers: Vec<Diver>,
        water: Water,
        faults: Faults,
    ) -> Self {
        Self {
            surface_craft,
            divers,
            water,
            faults,
            periods: 0,
        }
    }

    /// Time since the start, s.
    #[must_use]
    pub fn time(&self) -> f64 {
        f64::from(self.periods) * PERIOD
    }

    /// Inner-loop periods since the start.
    #[must_use]
    pub fn periods(&self) -> u32 {
        self.periods
    }

    /// Lets one inner-loop period pass. `reference` is for the surface craft, which without one stays out
    /// of time.
    pub fn step(&mut self, reference: Option<&Reference>) {
        let time = self.time();
        if let (Some(craft), Some(reference)) = (&mut self.surface_craft, reference) {
            let sea = Sea {
                current: self.water.current(&craft.position(), 0.0),
                waves: self.water.wave_acceleration(),
            };
            craft.step(reference, self.faults.thrusters(time), &sea);
        }
        for (i, diver) in self.divers.iter_mut().enumerate() {
            let current = self.water.current(&diver.position(), diver.depth());
            diver.step(self.faults.conduct(i, time), &current);
        }
        self.water.step(PERIOD);
        self.periods += 1;
    }
}

/// The surface craft with its autopilot.
#[derive(Clone, Debug)]
pub struct SurfaceCraft {
    /// Its hull.
    pub hull: SurfaceHull,
    /// Its state.
    pub state: SurfaceState,
    /// Gains of its autopilot.
    pub autopilot: SurfaceAutopilot,
    /// What the autopilot's surge loop remembers.
    pub surge: SurgeLoop,
    /// Propulsion energy since the start ∫ |T u| dt, J.
    pub energy: f64,
    /// Heading travel since the start ∫ |r| dt, rad.
    pub heading_travel: f64,
}

/// The water around the surface craft during one period.
struct Sea {
    current: Vector2<f64>,
    waves: WaveAcceleration,
}

impl SurfaceCraft {
    /// Position (north, east), m.
    #[must_use]
    pub fn position(&self) -> Vector2<f64> {
        self.state.fixed_rows::<2>(0).into_owned()
    }

    fn step(&mut self, reference: &Reference, health: ThrusterHealth, sea: &Sea) {
        let command = self
            .autopilot
            .command(&self.hull, &mut self.surge, &self.state, reference);
        let thrust = self.hull.thrusters.steady(command, health);
        // The load that gives a free hull the motion of the waves.
        let waves = SurfaceInput {
            surge_force: self.hull.mass_surge * sea.waves.surge,
            yaw_moment: self.hull.inertia_yaw * sea.waves.yaw,
        };
        let before = self.state;
        self.state = rk4(&before, PERIOD, |state| {
            self.hull.derivative(state, thrust, waves, &sea.current)
        });
        let mean = (before + self.state) * 0.5;
        self.energy += self.hull.propulsion_power(&mean) * PERIOD;
        self.heading_travel += mean[5].abs() * PERIOD;
    }
}
