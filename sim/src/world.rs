//! The vehicles and the water, moving in steps of one inner-loop period.

use nalgebra::Vector2;
use planner::{angle::Heading, los::Reference};

use crate::{
    diver::Diver,
    fault::Faults,
    inner_loop::{AutopilotMemory, Measured, PERIOD, SurfaceAutopilot},
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
            let sound = craft.autopilot.heading;
            craft.autopilot.heading = sound.slowed(self.faults.heading_loop_slowed(time));
            let heading = reference.heading.radians() + self.faults.heading_offset(time);
            let reference = Reference {
                heading: Heading::new(heading),
                ..*reference
            };
            craft.step(&reference, self.faults.thrusters(time), &sea);
            craft.autopilot.heading = sound;
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
    /// Its autopilot.
    pub autopilot: SurfaceAutopilot,
    /// What the autopilot remembers.
    pub memory: AutopilotMemory,
    /// Propulsion energy since the start ∫ |T u| dt, J.
    pub energy: f64,
    /// Heading travel since the start ∫ |r| dt, rad.
    pub heading_travel: f64,
}

/// The water around the surface craft during one period.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sea {
    /// Current (north, east), m/s.
    pub current: Vector2<f64>,
    /// What the waves do.
    pub waves: WaveAcceleration,
}

impl Sea {
    /// Still water.
    #[must_use]
    pub fn calm() -> Self {
        Self {
            current: Vector2::zeros(),
            waves: WaveAcceleration::default(),
        }
    }
}

impl SurfaceCraft {
    /// A craft on a straight course at a steady `speed` through the water, m/s, its loops settled.
    /// Position (north, east), m; heading ψ, rad.
    #[must_use]
    pub fn cruising(
        hull: SurfaceHull,
        autopilot: SurfaceAutopilot,
        position: &Vector2<f64>,
        heading: f64,
        speed: f64,
    ) -> Self {
        Self {
            hull,
            state: hull.cruising(position, heading, speed),
            autopilot,
            memory: AutopilotMemory::settled_at(&autopilot, hull.drag_surge, speed, heading),
            energy: 0.0,
            heading_travel: 0.0,
        }
    }

    /// Position (north, east), m.
    #[must_use]
    pub fn position(&self) -> Vector2<f64> {
        self.state.fixed_rows::<2>(0).into_owned()
    }

    /// Lets one inner-loop period pass.
    pub fn step(&mut self, reference: &Reference, health: ThrusterHealth, sea: &Sea) {
        let measured = Measured::of(&self.state, &sea.current);
        let command = self
            .autopilot
            .command(&self.hull, &mut self.memory, &measured, reference);
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
