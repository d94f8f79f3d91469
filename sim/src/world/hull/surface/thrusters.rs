//! Two fixed stern thrusters: thrust allocation, limits and lag.

use super::SurfaceInput;

/// Thrust of each thruster, N, positive ahead: commanded or present.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Thrust {
    /// Port thruster, N.
    pub port: f64,
    /// Starboard thruster, N.
    pub starboard: f64,
}

/// Two equal thrusters beside the centre line, pointing ahead.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Thrusters {
    /// Largest thrust of one thruster ahead, N, positive.
    pub ahead_max: f64,
    /// Largest thrust of one thruster astern, N, positive.
    pub astern_max: f64,
    /// Distance of each thruster from the centre line, m.
    pub arm: f64,
    /// Least thrust in either direction, N; a smaller command does not turn the propeller.
    pub dead_zone: f64,
    /// Time constant of thrust, s, at least 0.04 for a stable integration (h/τ ≤ 2.78).
    pub lag: f64,
}

/// Health of the thrusters, which the autopilot does not know.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThrusterHealth {
    /// Share of its steady thrust that the port thruster gives: 1 sound, 0 lost.
    pub port: f64,
    /// Share of its steady thrust that the starboard thruster gives.
    pub starboard: f64,
    /// Share of the largest yaw moment at which the steering is stuck, positive to starboard.
    pub steering_stuck: Option<f64>,
    /// Share of the largest thrust ahead at which both thrusters are stuck, if they are, 0 to 1.
    pub thrust_stuck: Option<f64>,
}

impl ThrusterHealth {
    /// Both thrusters as built.
    pub const SOUND: Self = Self { port: 1.0, starboard: 1.0, steering_stuck: None, thrust_stuck: None };
}

impl Thrusters {
    /// Force and moment of both.
    ///
    /// ```text
    /// τ_u = T_port + T_starboard      τ_r = a (T_port − T_starboard)
    /// ```
    pub fn force(&self, thrust: Thrust) -> SurfaceInput {
        SurfaceInput {
            surge_force: thrust.port + thrust.starboard,
            yaw_moment: self.arm * (thrust.port - thrust.starboard),
        }
    }

    /// The commands nearest to `wanted` within the limits of each thruster.
    ///
    /// The moment has priority: a late turn leaves the course, a late acceleration is only late.
    /// With less thrust astern than ahead, the largest moments therefore push ahead.
    ///
    /// ```text
    /// d = clamp(τ_r / 2a, ±(ahead + astern)/2)     c = clamp(τ_u / 2, |d| − astern, ahead − |d|)
    /// T_port = c + d     T_starboard = c − d
    /// ```
    pub fn allocate(&self, wanted: SurfaceInput) -> Thrust {
        let differential_max = 0.5 * (self.ahead_max + self.astern_max);
        let differential = (wanted.yaw_moment / (2.0 * self.arm)).clamp(-differential_max, differential_max);
        let common = (0.5 * wanted.surge_force)
            .max(differential.abs() - self.astern_max)
            .min(self.ahead_max - differential.abs());
        Thrust { port: common + differential, starboard: common - differential }
    }

    /// Steady thrust for `command`, with steering and thrust where they are stuck, within the
    /// limits, 0 in the dead zone, times each thruster's health.
    pub fn steady(&self, command: Thrust, health: ThrusterHealth) -> Thrust {
        let command = match (health.steering_stuck, health.thrust_stuck) {
            (None, None) => command,
            (steering, thrust) => {
                let asked = self.force(command);
                self.allocate(SurfaceInput {
                    surge_force: thrust.map_or(asked.surge_force, |share| 2.0 * share * self.ahead_max),
                    yaw_moment: steering.map_or(asked.yaw_moment, |share| {
                        share * self.arm * (self.ahead_max + self.astern_max)
                    }),
                })
            }
        };
        let one = |command: f64, health: f64| {
            if command.abs() < self.dead_zone {
                0.0
            } else {
                health * command.clamp(-self.astern_max, self.ahead_max)
            }
        };
        Thrust { port: one(command.port, health.port), starboard: one(command.starboard, health.starboard) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{tests::near, world::hull::SurfaceHull};

    const CRAFT: [Thrusters; 2] = [SurfaceHull::MEDUSA.thrusters, SurfaceHull::OTTER.thrusters];

    fn wanted(surge_force: f64, yaw_moment: f64) -> SurfaceInput {
        SurfaceInput { surge_force, yaw_moment }
    }

    #[test]
    fn reachable_forces_and_moments_are_exact() {
        for thrusters in CRAFT {
            for (surge_force, yaw_moment) in [(20.0, 3.0), (-15.0, -4.0), (0.0, 9.0)] {
                let given = thrusters.force(thrusters.allocate(wanted(surge_force, yaw_moment)));
                near(given.surge_force, surge_force, 1e-12);
                near(given.yaw_moment, yaw_moment, 1e-12);
            }
        }
    }

    #[test]
    fn thrusters_stay_within_their_limits_and_the_moment_has_priority() {
        for thrusters in CRAFT {
            let moment_max = thrusters.arm * (thrusters.ahead_max + thrusters.astern_max);
            for moment in (-20..=20).map(|step| 0.1 * f64::from(step) * moment_max) {
                for surge in [-1e3, -30.0, 0.0, 30.0, 1e3] {
                    let command = thrusters.allocate(wanted(surge, moment));
                    for thrust in [command.port, command.starboard] {
                        assert!(-thrusters.astern_max - 1e-12 <= thrust);
                        assert!(thrust <= thrusters.ahead_max + 1e-12);
                    }
                    let reachable = moment.clamp(-moment_max, moment_max);
                    near(thrusters.force(command).yaw_moment, reachable, 1e-9);
                }
            }
        }
    }

    #[test]
    fn a_stuck_actuator_drives_the_craft_under_any_command_and_leaves_the_other() {
        for thrusters in CRAFT {
            let (mut rudder, mut thrust) = (ThrusterHealth::SOUND, ThrusterHealth::SOUND);
            (rudder.steering_stuck, thrust.thrust_stuck) = (Some(0.25), Some(0.25));
            let given = |surge_force, yaw_moment, health| {
                let command = thrusters.allocate(wanted(surge_force, yaw_moment));
                thrusters.force(thrusters.steady(command, health))
            };
            let moment = 0.25 * thrusters.arm * (thrusters.ahead_max + thrusters.astern_max);
            for asked in [-5.0, 0.0, 5.0] {
                near(given(20.0, asked, rudder).yaw_moment, moment, 1e-9);
            }
            for asked in [-5.0, 0.0, 25.0] {
                let given = given(asked, 2.0, thrust);
                near(given.surge_force, 0.5 * thrusters.ahead_max, 1e-9);
                near(given.yaw_moment, 2.0, 1e-9);
            }
        }
    }

    #[test]
    fn full_ahead_with_half_the_moment_stops_the_inner_thruster() {
        // By hand: 5.4 N m at 0.15 m each is a difference of 36 N, and port is full ahead.
        let command = SurfaceHull::MEDUSA.thrusters.allocate(wanted(500.0, 5.4));
        near(command.port, 36.0, 1e-12);
        near(command.starboard, 0.0, 1e-12);
    }

    #[test]
    fn a_command_inside_the_dead_zone_gives_no_thrust() {
        for thrusters in CRAFT {
            let [inside, outside] = [0.99, 1.01].map(|share| Thrust {
                port: share * thrusters.dead_zone,
                starboard: -share * thrusters.dead_zone,
            });
            let sound = ThrusterHealth::SOUND;
            assert_eq!(thrusters.steady(inside, sound), Thrust::default());
            assert_eq!(thrusters.steady(outside, sound), outside);
        }
    }

    #[test]
    fn a_lost_thruster_leaves_force_and_moment_of_the_other() {
        let thrusters = SurfaceHull::MEDUSA.thrusters;
        let health = ThrusterHealth { port: 0.0, ..ThrusterHealth::SOUND };
        let command = Thrust { port: 20.0, starboard: 20.0 };
        let given = thrusters.force(thrusters.steady(command, health));
        assert_eq!(given, wanted(20.0, -0.15 * 20.0));
    }
}
