//! The vehicles and the water, moving in steps of one inner-loop period.

use nalgebra::Vector2;
use planner::{los::Reference, path::Path, snapshot::VehicleId};

use crate::{
    dive::{Dive, Leg},
    inner_loop::{PERIOD, SurfaceAutopilot, SurgeLoop, UnderwaterLoops, UnderwaterReference},
    integrate::rk4,
    path_following::{PathCommand, PathError, PathFollowingGains, follow_path},
    surface_craft::{SurfaceHull, SurfaceInput, SurfaceState, ThrusterHealth},
    underwater_vehicle::{UnderwaterHull, UnderwaterState, heading_rate},
};

/// The truth.
#[derive(Clone, Debug)]
pub struct World {
    /// The surface craft, where the scenario has one.
    pub surface_craft: Option<SurfaceCraft>,
    /// The underwater vehicles, in the scenario's order.
    pub divers: Vec<Diver>,
    /// Current (north, east), m/s, the same everywhere and always.
    pub current: Vector2<f64>,
}

impl World {
    /// Lets one inner-loop period pass. `reference` is for the surface craft.
    pub fn step(&mut self, reference: Option<&Reference>) {
        if let (Some(craft), Some(reference)) = (&mut self.surface_craft, reference) {
            craft.step(reference, &self.current);
        }
        for diver in &mut self.divers {
            diver.step(&self.current);
        }
    }
}

/// The surface craft with its inner loops.
#[derive(Clone, Debug)]
pub struct SurfaceCraft {
    /// Its hull.
    pub hull: SurfaceHull,
    /// Its state.
    pub state: SurfaceState,
    /// Its inner loops.
    pub autopilot: SurfaceAutopilot,
    /// Its surge loop.
    pub surge: SurgeLoop,
    /// Propulsion energy since the start ∫ |τ_u u| dt, J.
    pub energy: f64,
    /// Heading travel since the start ∫ |r| dt, rad.
    pub heading_travel: f64,
}

impl SurfaceCraft {
    /// Position (north, east), m.
    #[must_use]
    pub fn position(&self) -> Vector2<f64> {
        self.state.fixed_rows::<2>(0).into_owned()
    }

    fn step(&mut self, reference: &Reference, current: &Vector2<f64>) {
        let command = self
            .autopilot
            .command(&self.hull, &mut self.surge, &self.state, reference);
        let steady = self.hull.thrusters.steady(command, ThrusterHealth::SOUND);
        let before = self.state;
        self.state = rk4(&before, PERIOD, |state| {
            self.hull
                .derivative(state, steady, SurfaceInput::default(), current)
        });
        let mean = (before + self.state) * 0.5;
        self.energy += ((mean[6] + mean[7]) * mean[3]).abs() * PERIOD;
        self.heading_travel += mean[5].abs() * PERIOD;
    }
}

/// An underwater vehicle with its inner loops, its path follower and its sawtooth.
#[derive(Clone, Debug)]
pub struct Diver {
    /// Its name.
    pub id: VehicleId,
    /// Its hull.
    pub hull: UnderwaterHull,
    /// Its state.
    pub state: UnderwaterState,
    /// Its inner loops.
    pub loops: UnderwaterLoops,
    /// Its surge loop.
    pub surge: SurgeLoop,
    /// Gains of its path follower.
    pub gains: PathFollowingGains,
    /// The path it follows.
    pub path: Path,
    /// Arc length of the point it follows γ, m.
    pub gamma: f64,
    /// Speed reference along the body `U_d`, m/s.
    pub speed: f64,
    /// Its sawtooth.
    pub dive: Dive,
    /// The leg it is on.
    pub leg: Leg,
}

impl Diver {
    /// Horizontal position (north, east), m.
    #[must_use]
    pub fn position(&self) -> Vector2<f64> {
        self.state.fixed_rows::<2>(0).into_owned()
    }

    /// Depth, m.
    #[must_use]
    pub fn depth(&self) -> f64 {
        self.state[2]
    }

    /// Pitch θ, rad.
    #[must_use]
    pub fn pitch(&self) -> f64 {
        self.state[3]
    }

    /// Heading ψ, rad, not wrapped.
    #[must_use]
    pub fn heading(&self) -> f64 {
        self.state[4]
    }

    /// Horizontal speed through the water u cosθ, m/s.
    #[must_use]
    pub fn horizontal_speed(&self) -> f64 {
        self.state[5] * self.pitch().cos()
    }

    /// Heading rate ψ̇ = r / cosθ, rad/s.
    #[must_use]
    pub fn heading_rate(&self) -> f64 {
        heading_rate(self.pitch(), self.state[7])
    }

    /// Deviation from the point it follows.
    #[must_use]
    pub fn path_error(&self) -> PathError {
        PathError::new(&self.position(), self.heading(), &self.path.at(self.gamma))
    }

    /// What the path-following law asks for.
    fn path_command(&self) -> PathCommand {
        let curvature = self.path.at(self.gamma).curvature;
        follow_path(
            &self.path_error(),
            curvature,
            self.horizontal_speed(),
            &self.gains,
        )
    }

    /// What the inner loops are told: the law's rate is ψ̇, theirs the body's yaw rate r = cosθ ψ̇.
    fn reference(&self, command: &PathCommand) -> UnderwaterReference {
        UnderwaterReference {
            surge: self.speed,
            pitch: self.leg.pitch(&self.dive),
            yaw_rate: command.heading_rate * self.pitch().cos(),
        }
    }

    fn step(&mut self, current: &Vector2<f64>) {
        self.leg = self.leg.next(self.depth(), &self.dive);
        let command = self.path_command();
        let reference = self.reference(&command);
        let input = self
            .loops
            .command(&self.hull, &mut self.surge, &self.state, &reference);
        self.state = rk4(&self.state, PERIOD, |state| {
            self.hull.derivative(state, input, current)
        });
        self.gamma += command.point_speed * PERIOD;
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector2;

    use crate::{scenario::Scenario, underwater_vehicle::UnderwaterInput};

    #[test]
    fn a_pitched_vehicle_told_its_yaw_rate_turns_at_the_rate_that_the_law_asked_for() {
        let mut diver = Scenario::named("paper-path-following")
            .expect("exists")
            .world(1)
            .divers
            .remove(0);
        for pitch_degrees in [0.0_f64, -50.0, 50.0] {
            diver.state[3] = pitch_degrees.to_radians();
            let command = diver.path_command();
            assert!(command.heading_rate.abs() > 0.01, "off its path it must turn");
            let told = diver.reference(&command).yaw_rate;
            // A vehicle that obeys at once: the kinematics turn what it was told into ψ̇.
            diver.state[7] = told;
            let turned = diver
                .hull
                .derivative(&diver.state, UnderwaterInput::default(), &Vector2::zeros())[4];
            assert!((turned - command.heading_rate).abs() < 1e-12, "{turned}");
        }
    }
}
