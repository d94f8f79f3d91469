//! Snapshots from the whole accepted range, extremes included.

use std::f64::consts::PI;

use nalgebra::{Matrix4, Vector2, Vector4};
use planner::{
    angle::{Course, Heading},
    craft::{
        CraftDescription, CraftEstimate, HeadingLoop, HeadingReference, MEMORY_LENGTH, PRESETS, Power,
        SpeedReference, SurgeLoop,
    },
    los::Reference,
    path::Segment,
    snapshot::{
        Acoustics, Asc, Auv, AuvState, Current, DeclaredPath, Dive, Drift, Forecast, Goal, GroundTrack, Hold,
        KeepOut, Limits, Offset, PlanRequest, PreviousCraft, PreviousEstimate, PreviousPlan, PreviousTarget,
        Report, Task, TrajectoryPoint, Tuning, VehicleId, Vessel, VesselStatus,
    },
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::both;

mod measured;

/// The goals that the planner knows, each with the AUVs of [`observation`](crate::observation).
pub fn goals() -> [Goal; 5] {
    [
        Goal::Track { auv: VehicleId("auv-1".into()) },
        Goal::Intermittent { auvs: both(), dwell_s: 240.0, epoch_s: 0.0 },
        Goal::Midpoint { auvs: both() },
        Goal::Weighted { weights: both().into_iter().zip([0.7, 0.3]).collect() },
        Goal::Range { auvs: both(), range_m: 60.0 },
    ]
}

/// A snapshot's facts, different for every seed. Half are usual. In the others, numbers may be at
/// the edge of their range, vehicles coincide or rest, and an earlier plan be another's.
pub fn observation(seed: u64) -> PlanRequest {
    let mut draw = Draw { rng: ChaCha8Rng::seed_from_u64(seed), ugly: seed % 2 == 1 };
    draw.observation()
}

/// The planner's levers, each set by every other seed, in the range that a debug build solves.
pub fn tuning(seed: u64) -> Tuning {
    let mut draw = Draw { rng: ChaCha8Rng::seed_from_u64(seed), ugly: true };
    let mut weight = |usual: f64, accepted: (f64, f64)| {
        let given = draw.number((0.5 * usual, 2.0 * usual), accepted);
        draw.chance(0.5).then_some(given)
    };
    Tuning {
        position_weight_per_m2: weight(1.0, (0.01, 10.0)),
        velocity_weight_per_m2ps2: weight(15.0, (0.0, 150.0)),
        acceleration_weight_per_m2ps4: weight(100.0, (0.0, 1.0e4)),
        terminal_position_weight_per_m2: weight(10.0, (0.0, 100.0)),
        terminal_velocity_weight_per_m2ps2: weight(150.0, (0.0, 1500.0)),
        energy_weight_per_j: weight(0.1, (0.0, 10.0)),
        scp_iterations: draw.chance(0.5).then(|| draw.rng.random_range(1..=4)),
        steps_s: draw.chance(0.5).then(|| {
            let n = draw.rng.random_range(2..=60);
            let least = 5.0 / f64::from(n);
            (0..n)
                .map(|_| draw.number((least.max(0.5), 4.0_f64.max(least)), (least.max(0.1), 10.0)))
                .collect()
        }),
    }
}

#[derive(Clone)]
struct Draw {
    rng: ChaCha8Rng,
    ugly: bool,
}

impl Draw {
    fn chance(&mut self, share: f64) -> bool {
        self.rng.random::<f64>() < share
    }

    /// A usual number; in an ugly snapshot often one from the whole range or its very end.
    fn number(&mut self, usual: (f64, f64), accepted: (f64, f64)) -> f64 {
        let (low, high) = if self.ugly && self.chance(0.3) {
            if self.chance(0.3) {
                let end = if self.chance(0.5) { accepted.0 } else { accepted.1 };
                return end;
            }
            accepted
        } else {
            usual
        };
        low + (high - low) * self.rng.random::<f64>()
    }

    fn angle(&mut self) -> f64 {
        PI * (2.0 * self.rng.random::<f64>() - 1.0)
    }

    /// A place about a centre.
    fn place(&mut self, centre: Vector2<f64>, spread: f64) -> Vector2<f64> {
        let mut axis = |centre: f64| {
            let far = 1.0e6 - centre.abs();
            let near = spread.min(far);
            centre + self.number((-near, near), (-far, far))
        };
        Vector2::new(axis(centre.x), axis(centre.y))
    }

    fn observation(&mut self) -> PlanRequest {
        let time = self.number((0.0, 1.0e4), (-1.0e11, 1.0e11));
        let n_auvs = 1 + self.rng.random_range(0..if self.ugly { 16 } else { 3 });
        let centre = self.place(Vector2::zeros(), 500.0);
        let asc = self.asc(centre);
        let mut auvs: Vec<_> = (0..n_auvs).map(|i| self.auv(i, time, asc.position())).collect();
        if self.ugly && self.chance(0.2) {
            let (state, reports) = (auvs[0].state, auvs[0].reports.clone());
            for auv in &mut auvs {
                (auv.state, auv.reports) = (state, reports.clone());
            }
        }
        let goal = self.goal(&auvs, time);
        // A generator of its own: goals that measure change nothing else of a snapshot.
        let goal = self.clone().measured_goal(&auvs, time).unwrap_or(goal);
        let localises = matches!(goal, Goal::Localise(_));
        let speed_min = self.number((0.0, 0.3), (0.0, 2.0));
        let limits = Limits {
            speed_min,
            speed_max: self.number((speed_min + 0.5, speed_min + 2.0), (speed_min + 0.05, 20.0)),
            turn_rate_max: self.number((0.1, 0.5), (0.01, 3.0)),
            acceleration_max: self.number((0.03, 0.3), (0.001, 5.0)),
            deceleration_max: self.number((0.03, 0.3), (0.001, 5.0)),
        };
        let craft = self.craft();
        let n_discs = self.chance(0.4).then(|| {
            let most = if self.ugly && self.chance(0.2) { 33 } else { 4 };
            self.rng.random_range(1..most)
        });
        let in_one_place = self.chance(0.1);
        let spread = if in_one_place { 0.0 } else { 60.0 };
        let mut disc = || {
            let centre = self.place(asc.position(), spread);
            KeepOut::new(centre, self.number((2.0, 20.0), (0.1, 1.0e4)))
        };
        let keep_outs = (0..n_discs.unwrap_or(0)).map(|_| disc()).collect();
        let area = self.chance(0.3).then(|| self.area(asc.position()));
        let previous_plan = self.chance(0.5).then(|| self.previous_plan(&asc, &auvs, time));
        let by = Vector2::new(
            self.number((-30.0, 30.0), (-1.0e3, 1.0e3)),
            self.number((-30.0, 30.0), (-1.0e3, 1.0e3)),
        );
        let offset = match self.rng.random_range(0..6) {
            _ if localises => None,
            0 => Some(Offset::ned(by)),
            1 => Some(Offset::target(by)),
            _ => None,
        };
        // A generator of its own: vessels change nothing else of a snapshot.
        let (traffic, vessel_separation_m) = self.clone().traffic(&asc, time);
        PlanRequest {
            traffic,
            vessel_separation_m,
            current: self.chance(0.6).then(|| self.current()),
            limits: Some(limits.into()),
            craft: Some(craft),
            keep_outs,
            area: area.unwrap_or_default(),
            acoustics: self
                .chance(0.4)
                .then(|| Acoustics { range_max_m: self.number((20.0, 200.0), (1.0, 2.0e4)) }),
            surfacing_separation_m: self.chance(0.3).then(|| self.number((2.0, 20.0), (0.5, 100.0))),
            forecast: [
                Forecast::Auto,
                Forecast::Auto,
                Forecast::Hold,
                Forecast::ConstantVelocity,
                Forecast::ConstantTurn,
                Forecast::Path,
                Forecast::Declared,
            ][self.rng.random_range(0..7)],
            hold: [Hold::SlowTurn, Hold::Stop][usize::from(self.chance(0.5))],
            previous_plan,
            ..PlanRequest::new(time, asc, auvs, Task { goal, offset })
        }
    }

    /// Vessels, in a third of the snapshots, and the distance to keep from them.
    fn traffic(&mut self, asc: &Asc, time: f64) -> (Vec<Vessel>, Option<f64>) {
        if self.chance(0.67) {
            return (Vec::new(), None);
        }
        // A program keeps clear of eight at most.
        let n_vessels = self.rng.random_range(1..if self.ugly { 9 } else { 3 });
        let vessel = |i: usize| {
            let place = self.place(asc.position(), 400.0);
            let age = self.number((0.0, 20.0), (-2.0, 1000.0));
            Vessel {
                id: format!("vessel {i}").as_str().into(),
                name: None,
                t_s: self.chance(0.8).then_some((time - age).clamp(-1.0e11, 1.0e11)),
                north_m: place.x,
                east_m: place.y,
                lat_deg: None,
                lon_deg: None,
                course_rad: self.chance(0.9).then(|| self.angle()),
                speed_mps: self.chance(0.9).then(|| self.number((0.0, 10.0), (0.0, 60.0))),
                heading_rad: self.chance(0.3).then(|| self.angle()),
                length_m: self.chance(0.7).then(|| self.number((5.0, 100.0), (1.0, 500.0))),
                sigma_m: self.chance(0.5).then(|| self.number((1.0, 20.0), (0.0, 1.0e4))),
                plan: self.vessel_plan(place, time),
                status: [VesselStatus::UnderWay, VesselStatus::AtAnchor][usize::from(self.chance(0.2))],
            }
        };
        let vessels = (0..n_vessels).map(vessel).collect();
        (vessels, self.chance(0.7).then(|| self.number((5.0, 60.0), (1.0, 2.0e3))))
    }

    /// A third of the vessels say where they will be.
    fn vessel_plan(&mut self, from: Vector2<f64>, time: f64) -> Vec<[f64; 3]> {
        let (n, mut at) = (if self.chance(0.67) { 0 } else { self.rng.random_range(1..33) }, time - 10.0);
        let mut point = |_| {
            at += self.number((1.0, 20.0), (1.0e-3, 1.0e4));
            let place = self.place(from, 200.0);
            [at, place.x, place.y]
        };
        (0..n).map(&mut point).collect()
    }

    fn current(&mut self) -> Current {
        let mut axis = || self.number((-0.3, 0.3), (-3.0, 3.0));
        Current { north_mps: axis(), east_mps: axis() }
    }

    fn asc(&mut self, position: Vector2<f64>) -> Asc {
        Asc {
            sway_mps: self.number((-0.1, 0.1), (-5.0, 5.0)),
            yaw_rate_radps: self.number((-0.3, 0.3), (-3.0, 3.0)),
            ..Asc::new(position, Heading::new(self.angle()), self.number((0.0, 1.5), (-5.0, 20.0)))
                .with_ground_velocity(self.chance(0.3).then(|| {
                    let mut axis = || self.number((-1.5, 1.5), (-25.0, 25.0));
                    Vector2::new(axis(), axis())
                }))
        }
    }

    fn auv(&mut self, i: usize, time: f64, near: Vector2<f64>) -> Auv {
        let spread = if self.chance(0.1) { 0.0 } else { 80.0 };
        let position = self.place(near, spread);
        let course = self.angle();
        let id = VehicleId(format!("auv-{i}"));
        let auv = if self.chance(0.4) {
            Auv::reported(id, self.reports(time, position, course))
        } else {
            let state = AuvState {
                turn_rate_radps: self.number((-0.05, 0.05), (-1.0, 1.0)),
                age_s: self.number((0.0, 60.0), (0.0, 3600.0)),
                covariance: self.chance(0.3).then(|| {
                    let (p, v) =
                        (self.number((0.1, 9.0), (0.0, 1.0e4)), self.number((0.001, 0.01), (0.0, 1.0)));
                    Matrix4::from_diagonal(&Vector4::new(p, p, v, v)).into()
                }),
                ..AuvState::new(
                    position,
                    self.number((0.0, 30.0), (-10.0, 12_000.0)),
                    Course::new(course),
                    if self.chance(0.15) { 0.0 } else { self.number((0.0, 0.5), (0.0, 10.0)) },
                )
            };
            Auv::new(id, state)
        };
        Auv {
            path: self.chance(0.3).then(|| self.path(position, course)),
            dive: self.chance(0.4).then(|| self.dive()),
            ..auv
        }
    }

    fn reports(&mut self, time: f64, position: Vector2<f64>, course: f64) -> Vec<Report> {
        let n = 1 + self.rng.random_range(0..if self.ugly { 64 } else { 20 });
        let speed = self.number((0.0, 0.4), (0.0, 3.0));
        (0..n)
            .map(|_| {
                let age = self.number((0.0, 200.0), (0.0, 3600.0));
                let way = Course::new(course).unit() * (-age * speed);
                let spread = if self.chance(0.05) { 60.0 } else { 2.0 };
                let there = (position + way).map(|axis| axis.clamp(-9.9e5, 9.9e5));
                if self.chance(0.2) {
                    let range = self.number((5.0, 200.0), (0.1, 2.0e4));
                    let from = Some(self.place(there, 50.0));
                    return Report::ranged(time - age, range, from, self.number((0.5, 3.0), (0.05, 100.0)));
                }
                Report {
                    depth_m: self.chance(0.5).then(|| self.number((0.0, 30.0), (-10.0, 12_000.0))),
                    turn_rate_radps: self.chance(0.3).then(|| self.number((-0.05, 0.05), (-1.0, 1.0))),
                    ..Report::new(
                        time - age,
                        self.place(there, spread),
                        self.number((0.5, 3.0), (0.05, 100.0)),
                    )
                    .with_ground_track(
                        self.chance(0.5)
                            .then(|| GroundTrack { course: Course::new(course + 0.1 * self.angle()), speed }),
                    )
                }
            })
            .collect()
    }

    fn path(&mut self, position: Vector2<f64>, course: f64) -> DeclaredPath {
        let inside = |point: Vector2<f64>| point.map(|axis| axis.clamp(-9.9e5, 9.9e5));
        let (along, abeam) = (Course::new(course).unit(), Course::new(course + PI / 2.0).unit());
        let from = inside(position - along * 30.0);
        let segment = Segment::Waypoints {
            points: vec![
                from.into(),
                (from + along * 100.0).into(),
                (from + along * 100.0 + abeam * 50.0).into(),
                (from + abeam * 50.0).into(),
            ],
            fillet_m: Some(10.0),
            turn_radius_m: None,
            legs: vec![],
        };
        DeclaredPath {
            segments: vec![segment],
            closed: false,
            speed_mps: self.number((0.1, 0.4), (0.01, 10.0)),
        }
    }

    fn dive(&mut self) -> Dive {
        let depth_min = self.number((0.0, 3.0), (0.0, 1.0e4));
        Dive {
            depth_min_m: depth_min,
            depth_max_m: depth_min + self.number((5.0, 30.0), (0.5, 1.0e3)),
            pitch_rad: self.number((0.3, 0.9), (0.05, 1.4)),
            reversal_s: Some(self.number((1.0, 10.0), (0.1, 120.0))),
            descending: [None, Some(true), Some(false)][self.rng.random_range(0..3)],
        }
    }

    fn goal(&mut self, auvs: &[Auv], time: f64) -> Goal {
        let n = 1 + self.rng.random_range(0..auvs.len());
        let named: Vec<_> = auvs.iter().take(n).map(|auv| auv.id.clone()).collect();
        match self.rng.random_range(0..5) {
            3 => Goal::Weighted {
                weights: named.into_iter().map(|id| (id, self.number((0.1, 1.0), (1.0e-6, 1.0e6)))).collect(),
            },
            4 => Goal::Range { auvs: named, range_m: self.number((20.0, 200.0), (1.0, 2.0e4)) },
            0 => Goal::Track { auv: named[n - 1].clone() },
            1 => Goal::Midpoint { auvs: named },
            _ => Goal::Intermittent {
                auvs: named,
                dwell_s: self.number((30.0, 300.0), (1.0, 1.0e6)),
                epoch_s: time - self.number((0.0, 1000.0), (0.0, 1.0e5)),
            },
        }
    }

    /// A rectangle about or beside the craft, or anywhere.
    fn area(&mut self, near: Vector2<f64>) -> Vec<[f64; 2]> {
        let centre = self.place(near, 40.0).map(|axis| axis.clamp(-9.9e5, 9.9e5));
        let (along, abeam) =
            (self.number((20.0, 200.0), (1.0, 9.0e3)), self.number((20.0, 200.0), (1.0, 9.0e3)));
        let turn = nalgebra::Rotation2::new(self.angle());
        [(1.0, 1.0), (1.0, -1.0), (-1.0, -1.0), (-1.0, 1.0)]
            .map(|(a, b)| (centre + turn * Vector2::new(0.5 * a * along, 0.5 * b * abeam)).into())
            .to_vec()
    }

    /// A recent plan, mostly from near the craft's place; or any plan.
    fn previous_plan(&mut self, asc: &Asc, auvs: &[Auv], time: f64) -> PreviousPlan {
        let began = time - self.number((0.5, 2.0), (0.0, 20.0));
        let (mut place, mut heading) = (asc.position(), asc.heading().radians() + 0.2 * self.angle());
        if self.chance(0.2) {
            place = self.place(asc.position(), 100.0);
        }
        let (speed, rate) = (self.number((0.1, 1.0), (0.0, 40.0)), 0.02 * self.angle());
        let trajectory = (0..self.rng.random_range(0..40))
            .map(|k| {
                let point = TrajectoryPoint::new(
                    began + 2.0 * f64::from(k),
                    place.map(|axis| axis.clamp(-1.0e6, 1.0e6)),
                    speed,
                    Heading::new(heading),
                );
                place += Heading::new(heading).unit() * (2.0 * speed);
                heading += 2.0 * rate;
                point
            })
            .collect();
        let current = self.chance(0.5).then(|| self.current());
        let goal_course_rad = self.chance(0.5).then(|| self.angle());
        let asked = self.chance(0.8).then(|| self.reference());
        let reference = self.chance(0.8).then(|| self.reference().into());
        let craft = self.chance(0.8).then(|| self.craft_memory(asc));
        let craft_estimate = asked.zip(craft).map(|(asked, craft)| PreviousCraft {
            asked_speed_mps: asked.speed,
            asked_heading_rad: asked.heading.radians(),
            memory: craft.memory().to_vec(),
        });
        PreviousPlan {
            origin: None,
            trajectory,
            goal_course_rad,
            craft_estimate,
            current,
            reference,
            targets: Some(auvs.iter().map(|auv| self.previous_target(auv, asc, time)).collect()),
            schedule: None,
            figure: None,
            avoidance: None,
        }
    }

    /// The declared craft: nothing, a name, or any of its numbers.
    fn craft(&mut self) -> CraftDescription {
        let most_is_said = self.chance(0.5);
        let said = |draw: &mut Self| draw.chance(if most_is_said { 0.9 } else { 0.2 });
        CraftDescription {
            preset: self.chance(0.5).then(|| {
                let preset = PRESETS[self.rng.random_range(0..PRESETS.len())];
                preset.name.to_owned()
            }),
            heading_loop: self.heading_loop(said),
            surge_loop: self.surge_loop(said),
            sway_per_yaw_rate_s: said(self).then(|| self.number((0.0, 2.0), (-5.0, 20.0))),
            power: said(self).then(|| Power {
                linear_w_per_mps: self.number((0.0, 50.0), (0.0, 1.0e6)),
                cubic_w_per_mps3: self.number((0.0, 50.0), (0.0, 1.0e6)),
            }),
            speed_held: said(self).then(|| {
                [SpeedReference::ThroughWater, SpeedReference::OverGround][self.rng.random_range(0..2)]
            }),
            heading_held: said(self)
                .then(|| [HeadingReference::Heading, HeadingReference::Course][self.rng.random_range(0..2)]),
            relative_uncertainty: said(self).then(|| self.number((0.05, 0.3), (0.0, 2.0))),
        }
    }

    fn heading_loop(&mut self, said: impl Fn(&mut Self) -> bool) -> HeadingLoop {
        let mut heading = HeadingLoop::default();
        if said(self) {
            if self.chance(0.5) {
                heading.time_constant_s = Some(self.number((0.5, 8.0), (0.0, 60.0)));
            } else {
                heading.natural_frequency_radps = Some(self.number((0.3, 2.0), (0.02, 20.0)));
                heading.damping = Some(self.number((0.5, 1.2), (0.1, 5.0)));
            }
        }
        HeadingLoop {
            delay_s: said(self).then(|| self.number((0.0, 2.0), (0.0, 10.0))),
            rate_max_radps: said(self).then(|| self.number((0.1, 0.5), (0.001, 3.0))),
            ..heading
        }
    }

    fn surge_loop(&mut self, said: impl Fn(&mut Self) -> bool) -> SurgeLoop {
        let mut surge = SurgeLoop {
            time_constant_s: said(self).then(|| self.number((0.5, 8.0), (0.0, 60.0))),
            delay_s: said(self).then(|| self.number((0.0, 2.0), (0.0, 10.0))),
            acceleration_max_mps2: said(self).then(|| self.number((0.03, 0.3), (0.001, 10.0))),
            deceleration_max_mps2: said(self).then(|| self.number((0.03, 0.3), (0.001, 10.0))),
            ..SurgeLoop::default()
        };
        if said(self) {
            if self.chance(0.5) {
                surge.integrates = Some(false);
            } else {
                surge.integral_time_s = Some(self.number((3.0, 30.0), (0.5, 600.0)));
            }
        }
        surge
    }

    fn reference(&mut self) -> Reference {
        Reference {
            speed: self.number((0.0, 1.5), (0.0, 40.0)),
            heading: Heading::new(self.number((-3.0, 3.0), (-3.1, 3.1))),
        }
    }

    /// A filter's memory: each number inside its range, and most of the time near `asc`.
    fn craft_memory(&mut self, asc: &Asc) -> CraftEstimate {
        let mut memory: Vec<f64> = Vec::with_capacity(MEMORY_LENGTH);
        let psi = asc.heading().radians();
        let psi = if self.chance(0.8) { psi } else { self.angle() };
        memory.extend([psi, self.number((-1.0, 2.0), (-6.0, 6.0)), self.number((-0.2, 0.2), (-4.0, 4.0))]);
        memory.extend(self.covariance());
        let surge = self.number((0.0, 1.5), (-40.0, 40.0));
        memory.extend([
            surge,
            self.number((-1.0, 2.0), (-6.0, 6.0)),
            self.number((-0.1, 0.1), (-20.0, 20.0)),
        ]);
        memory.extend(self.covariance());
        memory.extend([(); 2].map(|()| self.number((0.0, 2.0), (0.0, 70.0))));
        let (followed, commanded) = (self.reference(), self.reference());
        memory.extend([
            followed.heading.radians(),
            followed.speed,
            commanded.heading.radians(),
            commanded.speed,
        ]);
        memory.extend([(); 2].map(|()| self.number((-6.0, 6.0), (-10.0, 10.0))));
        memory.extend([self.number((-1.0, 2.0), (-5.0, 5.0)), self.number((0.0, 0.5), (0.0, 100.0))]);
        memory.extend([(); 2].map(|()| self.number((-0.3, 0.3), (-3.0, 3.0))));
        memory.push(self.number((0.0, 0.1), (0.0, 100.0)));
        let place = self.place(asc.position(), 2.0);
        memory.extend([place.x, place.y]);
        let alarm = f64::from(u8::from(self.chance(0.3)));
        memory.extend([psi, surge, self.number((0.0, 8.0), (0.0, 1.0e3)), alarm]);
        memory.extend([self.number((-0.3, 0.3), (-3.0, 3.0)), self.number((-0.3, 0.3), (-40.0, 40.0))]);
        let nearness = [(); 2].map(|()| self.number((0.0, 100.0), (0.0, 1.0e9)));
        memory.extend(nearness);
        memory.extend([f64::from(u8::from(self.chance(0.3))), self.number((0.0, 100.0), (0.0, 1.0e12))]);
        for seen in [psi, surge] {
            memory.extend([seen, seen]);
            memory.extend([(); 2].map(|()| self.number((-0.5, 0.5), (-100.0, 100.0))));
            memory.push(self.number((0.0, 10.0), (0.0, 16.0)));
        }
        CraftEstimate::from_memory(&memory).expect("is a memory")
    }

    /// The upper triangle of a covariance: a diagonal, and correlations that keep it positive.
    fn covariance(&mut self) -> [f64; 6] {
        let [a, b, c] = [(); 3].map(|()| self.number((1.0e-4, 0.5), (0.0, 100.0)));
        let rho = self.number((-0.4, 0.4), (-0.5, 0.5));
        let between = |a: f64, b: f64| rho * (a * b).sqrt();
        [a, between(a, b), between(a, c), b, between(b, c), c]
    }

    /// A previous plan's AUV: somewhere near the craft, or anywhere.
    fn previous_target(&mut self, auv: &Auv, asc: &Asc, t_s: f64) -> PreviousTarget {
        let position = self.place(asc.position(), 100.0);
        let mut axis = |usual: f64, most: f64| self.number((-usual, usual), (-most, most));
        let (north_mps, east_mps) = (axis(0.3, 20.0), axis(0.3, 20.0));
        let drift = Drift { north_mps: axis(0.1, 3.0), east_mps: axis(0.1, 3.0) };
        let estimate = PreviousEstimate {
            north_m: position.x,
            east_m: position.y,
            north_mps,
            east_mps,
            depth_m: self.number((0.0, 30.0), (-10.0, 12_000.0)),
            turn_rate_radps: self.number((-0.02, 0.02), (-1.0, 1.0)),
            age_s: self.number((0.0, 30.0), (0.0, 3600.0)),
        };
        let models = [Forecast::ConstantVelocity, Forecast::ConstantTurn, Forecast::Path, Forecast::Hold];
        PreviousTarget {
            id: auv.id.clone(),
            estimate: Some(estimate),
            forecast: Some(models[self.rng.random_range(0..4)]),
            drift: Some(drift),
            track: self.track(asc, t_s),
            states: self.states(asc, t_s),
            // As goals, it changes nothing else.
            ranging: self.clone().ranging(asc, t_s),
        }
    }

    /// Past states along such a track, or anything.
    fn states(&mut self, asc: &Asc, t_s: f64) -> Vec<[f64; 6]> {
        let track = self.track(asc, t_s);
        let mut state = |[t_s, north, east]: [f64; 3]| {
            let velocity = [(); 2].map(|()| self.number((-1.0, 1.0), (-1.0e3, 1.0e3)));
            [t_s, north, east, self.number((0.5, 5.0), (-1.0, 1.0e9)), velocity[0], velocity[1]]
        };
        track.into_iter().map(&mut state).collect()
    }

    /// Lanes, as a vehicle sails them, or anything.
    fn track(&mut self, asc: &Asc, t_s: f64) -> Vec<[f64; 3]> {
        let start = self.place(asc.position(), 100.0);
        let (lane, spacing) =
            (self.number((20.0, 200.0), (0.0, 1.0e9)), self.number((2.0, 40.0), (0.0, 1.0e9)));
        let n: u32 = self.rng.random_range(0..40);
        let corner = |k: u32| {
            let north = if k.div_ceil(2).is_multiple_of(2) { 0.0 } else { lane };
            let time = t_s - 100.0 * f64::from(n - k);
            [time, start.x + north, start.y + spacing * f64::from(k / 2)]
        };
        (0..n).map(corner).collect()
    }
}
