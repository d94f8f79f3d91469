//! The surface craft: hull, thrusters and autopilot in water.

use nalgebra::Vector2;
use planner::{angle::ned_from_body, craft::CraftDescription, los::Reference, snapshot::Limits};

pub use super::hull::{
    CoriolisMasses, Drag, SurfaceHull, SurfaceInput, SurfaceState, Thrust, ThrusterHealth, Thrusters,
};
use super::{
    inner_loop::{AutopilotMemory, DragFeedForward, PERIOD, SurfaceAutopilot},
    integrate::rk4,
    water::WaveAcceleration,
};

pub mod random;
pub mod step_response;

/// A class of surface craft.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SurfaceClass {
    /// MEDUSA class: 30 kg, 1.6 m/s.
    Medusa,
    /// Maritime Robotics Otter with 25 kg of payload: 80 kg, 3 m/s.
    Otter,
}

impl SurfaceClass {
    /// Its hull and thrusters.
    pub fn hull(self) -> SurfaceHull {
        match self {
            Self::Medusa => SurfaceHull::MEDUSA,
            Self::Otter => SurfaceHull::OTTER,
        }
    }

    /// Its inner loops, with this mode of the surge loop.
    pub fn autopilot(self, feed_forward: DragFeedForward) -> SurfaceAutopilot {
        let gains = match self {
            Self::Medusa => SurfaceAutopilot::MEDUSA,
            Self::Otter => SurfaceAutopilot::OTTER,
        };
        SurfaceAutopilot { feed_forward, ..gains }
    }

    /// Its closed-loop response with drag feed-forward on, as given to the planner.
    pub fn craft(self) -> CraftDescription {
        let name = match self {
            Self::Medusa => "medusa",
            Self::Otter => "otter",
        };
        CraftDescription::of_preset(name)
    }

    /// Its limits, as given to the planner.
    pub fn limits(self) -> Limits {
        match self {
            Self::Medusa => Limits::MEDUSA,
            Self::Otter => OTTER_LIMITS,
        }
    }
}

/// Limits of the Otter. Each propeller is well out of its dead zone at the slowest speed, and has
/// thrust to turn at the fastest (docs/rationale.md#sim-otter-limits). The rest is the hull's.
const OTTER_LIMITS: Limits = Limits {
    speed_min: 0.1,
    speed_max: 2.0,
    turn_rate_max: 0.2,
    acceleration_max: 0.20,
    deceleration_max: 0.20,
};

/// The surface craft with its autopilot.
#[derive(Clone, Debug)]
pub struct SurfaceCraft {
    /// Its hull.
    pub hull: SurfaceHull,
    /// Its state.
    pub state: SurfaceState,
    /// Its autopilot.
    pub autopilot: SurfaceAutopilot,
    /// State of the autopilot.
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
    /// Acceleration by waves.
    pub waves: WaveAcceleration,
}

impl Sea {
    /// Still water.
    pub fn calm() -> Self {
        Self { current: Vector2::zeros(), waves: WaveAcceleration::default() }
    }
}

impl SurfaceCraft {
    /// A craft with settled loops at a steady `speed` through the water, m/s, along `heading`.
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
    pub fn position(&self) -> Vector2<f64> {
        self.state.fixed_rows::<2>(0).into_owned()
    }

    /// Velocity through the water (north, east), m/s.
    pub fn water_velocity(&self) -> Vector2<f64> {
        let [_, _, heading, surge, sway, ..]: [f64; 8] = self.state.into();
        ned_from_body(heading) * Vector2::new(surge, sway)
    }

    /// Advances by one inner-loop period.
    pub fn step(&mut self, reference: &Reference, health: ThrusterHealth, sea: &Sea) {
        let command =
            self.autopilot.command(&self.hull, &mut self.memory, &self.state, &sea.current, reference);
        let thrust = self.hull.thrusters.steady(command, health);
        // The load that gives a free hull the waves' acceleration.
        let waves = SurfaceInput {
            surge_force: self.hull.mass_surge * sea.waves.surge,
            yaw_moment: self.hull.inertia_yaw * sea.waves.yaw,
        };
        let before = self.state;
        self.state = rk4(&before, PERIOD, |state| self.hull.derivative(state, thrust, waves, &sea.current));
        let mean = (before + self.state) * 0.5;
        self.energy += self.hull.propulsion_power(&mean) * PERIOD;
        self.heading_travel += mean[5].abs() * PERIOD;
    }
}
