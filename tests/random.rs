//! Snapshots from all over what is accepted, ugly ones included.

use std::{f64::consts::PI, sync::Arc};

use nalgebra::{Matrix4, Vector2};
use planner::{
    angle::{Course, Heading},
    craft::{
        CraftDescription, CraftEstimate, HeadingDynamics, HeadingHeld, Integrator, MEMORY_LENGTH, PRESETS,
        PropulsionPower, SpeedHeld,
    },
    los::Reference,
    path::{Path, Segment},
    snapshot::{
        AscState, Auv, AuvState, Dive, Evidence, Fallback, ForecastChoice, ForecastModel, Goal, GroundTrack,
        HoldStyle, KeepOut, KnownPath, Limits, Observation, Offset, PreviousPlan, PreviousTarget, Report,
        TrajectoryPoint, VehicleId,
    },
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A snapshot's facts, another for every seed. About half are what a mission may meet; in the others any number may
/// be at the edge of what is accepted, vehicles may coincide or be at rest, and an earlier plan may be another's.
#[must_use]
pub fn observation(seed: u64) -> Observation {
    let mut draw = Draw {
        rng: ChaCha8Rng::seed_from_u64(seed),
        ugly: seed % 2 == 1,
    };
    draw.observation()
}

struct Draw {
    rng: ChaCha8Rng,
    ugly: bool,
}

impl Draw {
    fn chance(&mut self, share: f64) -> bool {
        self.rng.random::<f64>() < share
    }

    /// A number that is usual; where the snapshot is ugly, often one from the whole range or its very end.
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

    fn observation(&mut self) -> Observation {
        let time = self.number((0.0, 1.0e4), (-1.0e11, 1.0e11));
        let n_auvs = 1 + self.rng.random_range(0..if self.ugly { 16 } else { 3 });
        let centre = self.place(Vector2::zeros(), 500.0);
        let asc = self.asc(centre);
        let mut auvs: Vec<_> = (0..n_auvs).map(|i| self.auv(i, time, asc.position)).collect();
        if self.ugly && self.chance(0.2) {
            let everyone = auvs[0].evidence.clone();
            for auv in &mut auvs {
                auv.evidence = everyone.clone();
            }
        }
        let goal = self.goal(&auvs, time);
        let speed_min = self.number((0.0, 0.3), (0.0, 2.0));
        let limits = Limits {
            speed_min,
            speed_max: self.number((speed_min + 0.5, speed_min + 2.0), (speed_min + 0.05, 20.0)),
            turn_rate_max: self.number((0.1, 0.5), (0.01, 3.0)),
            acceleration_max: self.number((0.03, 0.3), (0.001, 5.0)),
            deceleration_max: self.number((0.03, 0.3), (0.001, 5.0)),
        };
        let craft = self.craft();
        let n_discs = if self.chance(0.4) {
            let most = if self.ugly && self.chance(0.2) { 33 } else { 4 };
            self.rng.random_range(1..most)
        } else {
            0
        };
        let in_one_place = self.chance(0.1);
        let keep_outs = (0..n_discs)
            .map(|_| KeepOut {
                centre: self.place(asc.position, if in_one_place { 0.0 } else { 60.0 }),
                radius: self.number((2.0, 20.0), (0.1, 1.0e4)),
            })
            .collect();
        let area = if self.chance(0.3) {
            self.area(asc.position)
        } else {
            vec![]
        };
        let previous_plan = self.chance(0.5).then(|| self.previous_plan(&asc, &auvs, time));
        let by = Vector2::new(
            self.number((-30.0, 30.0), (-1.0e3, 1.0e3)),
            self.number((-30.0, 30.0), (-1.0e3, 1.0e3)),
        );
        let offset = match self.rng.random_range(0..6) {
            0 => Some(Offset::Ned(by)),
            1 => Some(Offset::Target(by)),
            _ => None,
        };
        Observation {
            time,
            goal,
            offset,
            current: self.chance(0.6).then(|| {
                let mut axis = || self.number((-0.3, 0.3), (-3.0, 3.0));
                Vector2::new(axis(), axis())
            }),
            limits,
            craft,
            keep_outs,
            area,
            range_max: self.chance(0.4).then(|| self.number((20.0, 200.0), (1.0, 2.0e4))),
            surfacing_separation: self.chance(0.3).then(|| self.number((2.0, 20.0), (0.5, 100.0))),
            forecast: [
                ForecastChoice::Auto,
                ForecastChoice::Auto,
                ForecastChoice::Model(ForecastModel::Hold),
                ForecastChoice::Model(ForecastModel::ConstantVelocity),
                ForecastChoice::Model(ForecastModel::ConstantTurn),
                ForecastChoice::Model(ForecastModel::Path),
            ][self.rng.random_range(0..6)],
            fallback: Fallback::Los,
            hold: if self.chance(0.5) {
                HoldStyle::Stop
            } else {
                HoldStyle::SlowTurn
            },
            previous_plan,
            asc,
            auvs,
        }
    }

    fn asc(&mut self, position: Vector2<f64>) -> AscState {
        AscState {
            position,
            heading: Heading::new(self.angle()),
            surge: self.number((0.0, 1.5), (-5.0, 20.0)),
            sway: self.number((-0.1, 0.1), (-5.0, 5.0)),
            yaw_rate: self.number((-0.3, 0.3), (-3.0, 3.0)),
            ground_velocity: self.chance(0.3).then(|| {
                let mut axis = || self.number((-1.5, 1.5), (-25.0, 25.0));
                Vector2::new(axis(), axis())
            }),
        }
    }

    fn auv(&mut self, i: usize, time: f64, near: Vector2<f64>) -> Auv {
        let spread = if self.chance(0.1) { 0.0 } else { 80.0 };
        let position = self.place(near, spread);
        let course = self.angle();
        let evidence = if self.chance(0.4) {
            Evidence::Reports(self.reports(time, position, course))
        } else {
            Evidence::State(AuvState {
                position,
                depth: self.number((0.0, 30.0), (-10.0, 12_000.0)),
                course: Course::new(course),
                speed: if self.chance(0.15) {
                    0.0
                } else {
                    self.number((0.0, 0.5), (0.0, 10.0))
                },
                turn_rate: self.number((-0.05, 0.05), (-1.0, 1.0)),
                age: self.number((0.0, 60.0), (0.0, 3600.0)),
                covariance: self.chance(0.3).then(|| {
                    let (p, v) = (
                        self.number((0.1, 9.0), (0.0, 1.0e4)),
                        self.number((0.001, 0.01), (0.0, 1.0)),
                    );
                    Matrix4::from_diagonal(&nalgebra::Vector4::new(p, p, v, v))
                }),
            })
        };
        Auv {
            id: VehicleId(format!("auv-{i}")),
            evidence,
            path: self.chance(0.3).then(|| self.path(position, course)),
            dive: self.chance(0.4).then(|| self.dive()),
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
                Report {
                    time: time - age,
                    position: self.place(there, spread),
                    sigma: self.number((0.5, 3.0), (0.05, 100.0)),
                    depth: self
                        .chance(0.5)
                        .then(|| self.number((0.0, 30.0), (-10.0, 12_000.0))),
                    ground_track: self.chance(0.5).then(|| GroundTrack {
                        course: Course::new(course + 0.1 * self.angle()),
                        speed,
                    }),
                    turn_rate: self.chance(0.3).then(|| self.number((-0.05, 0.05), (-1.0, 1.0))),
                }
            })
            .collect()
    }

    fn path(&mut self, position: Vector2<f64>, course: f64) -> KnownPath {
        let inside = |point: Vector2<f64>| point.map(|axis| axis.clamp(-9.9e5, 9.9e5));
        let (along, abeam) = (Course::new(course).unit(), Course::new(course + PI / 2.0).unit());
        let from = inside(position - along * 30.0);
        let segment = Segment::Waypoints {
            points: vec![
                from,
                from + along * 100.0,
                from + along * 100.0 + abeam * 50.0,
                from + abeam * 50.0,
            ],
            fillet_radius: 10.0,
        };
        KnownPath {
            path: Arc::new(Path::from_segments(&[segment], false).expect("corners of a rectangle")),
            horizontal_speed: self.number((0.1, 0.4), (0.01, 10.0)),
        }
    }

    fn dive(&mut self) -> Dive {
        let depth_min = self.number((0.0, 3.0), (0.0, 1.0e4));
        Dive {
            depth_min,
            depth_max: depth_min + self.number((5.0, 30.0), (0.5, 1.0e3)),
            pitch: self.number((0.3, 0.9), (0.05, 1.4)),
            reversal: self.number((1.0, 10.0), (0.1, 120.0)),
            descending: [None, Some(true), Some(false)][self.rng.random_range(0..3)],
        }
    }

    fn goal(&mut self, auvs: &[Auv], time: f64) -> Goal {
        let n = 1 + self.rng.random_range(0..auvs.len());
        let named: Vec<_> = auvs.iter().take(n).map(|auv| auv.id.clone()).collect();
        match self.rng.random_range(0..5) {
            3 => Goal::Weighted {
                weights: named
                    .into_iter()
                    .map(|id| (id, self.number((0.1, 1.0), (1.0e-6, 1.0e6))))
                    .collect(),
            },
            4 => Goal::Range {
                auvs: named,
                radius: self.number((20.0, 200.0), (1.0, 2.0e4)),
            },
            0 => Goal::Track {
                auv: named[n - 1].clone(),
            },
            1 => Goal::Midpoint { auvs: named },
            _ => Goal::Intermittent {
                auvs: named,
                dwell: self.number((30.0, 300.0), (1.0, 1.0e6)),
                epoch: time - self.number((0.0, 1000.0), (0.0, 1.0e5)),
            },
        }
    }

    /// A rectangle about or beside the craft, or anywhere.
    fn area(&mut self, near: Vector2<f64>) -> Vec<Vector2<f64>> {
        let centre = self.place(near, 40.0).map(|axis| axis.clamp(-9.9e5, 9.9e5));
        let (along, abeam) = (
            self.number((20.0, 200.0), (1.0, 9.0e3)),
            self.number((20.0, 200.0), (1.0, 9.0e3)),
        );
        let turn = nalgebra::Rotation2::new(self.angle());
        [(1.0, 1.0), (1.0, -1.0), (-1.0, -1.0), (-1.0, 1.0)]
            .map(|(a, b)| centre + turn * Vector2::new(0.5 * a * along, 0.5 * b * abeam))
            .to_vec()
    }

    /// A plan made a moment ago, by and large from where the craft is; or anybody's.
    fn previous_plan(&mut self, asc: &AscState, auvs: &[Auv], time: f64) -> PreviousPlan {
        let began = time - self.number((0.5, 2.0), (0.0, 20.0));
        let (mut place, mut heading) = (asc.position, asc.heading.radians() + 0.2 * self.angle());
        if self.chance(0.2) {
            place = self.place(asc.position, 100.0);
        }
        let (speed, rate) = (self.number((0.1, 1.0), (0.0, 40.0)), 0.02 * self.angle());
        let trajectory = (0..self.rng.random_range(0..40))
            .map(|k| {
                let point = TrajectoryPoint {
                    time: began + 2.0 * f64::from(k),
                    position: place.map(|axis| axis.clamp(-1.0e6, 1.0e6)),
                    speed,
                    heading: Heading::new(heading),
                };
                place += Heading::new(heading).unit() * (2.0 * speed);
                heading += 2.0 * rate;
                point
            })
            .collect();
        PreviousPlan {
            trajectory,
            current: self.chance(0.5).then(|| {
                let mut axis = || self.number((-0.3, 0.3), (-3.0, 3.0));
                Vector2::new(axis(), axis())
            }),
            goal_course: self.chance(0.5).then(|| Course::new(self.angle())),
            reference: self.chance(0.8).then(|| self.reference()),
            command: self.chance(0.8).then(|| self.reference()),
            craft: self.chance(0.8).then(|| self.craft_memory(asc)),
            targets: auvs.iter().map(|auv| self.previous_target(auv, asc)).collect(),
        }
    }

    /// What is said of the craft: nothing, a name, or any of its numbers.
    fn craft(&mut self) -> CraftDescription {
        let most_is_said = self.chance(0.5);
        let said = |draw: &mut Self| draw.chance(if most_is_said { 0.9 } else { 0.2 });
        CraftDescription {
            preset: self
                .chance(0.5)
                .then(|| &PRESETS[self.rng.random_range(0..PRESETS.len())]),
            heading_dynamics: said(self).then(|| {
                if self.chance(0.5) {
                    HeadingDynamics::FirstOrder {
                        time_constant: self.number((0.5, 8.0), (0.0, 60.0)),
                    }
                } else {
                    HeadingDynamics::SecondOrder {
                        natural_frequency: self.number((0.3, 2.0), (0.02, 20.0)),
                        damping: self.number((0.5, 1.2), (0.1, 5.0)),
                    }
                }
            }),
            heading_delay: said(self).then(|| self.number((0.0, 2.0), (0.0, 10.0))),
            heading_rate_max: said(self).then(|| self.number((0.1, 0.5), (0.001, 3.0))),
            surge_time_constant: said(self).then(|| self.number((0.5, 8.0), (0.0, 60.0))),
            surge_delay: said(self).then(|| self.number((0.0, 2.0), (0.0, 10.0))),
            acceleration_max: said(self).then(|| self.number((0.03, 0.3), (0.001, 10.0))),
            deceleration_max: said(self).then(|| self.number((0.03, 0.3), (0.001, 10.0))),
            integrator: said(self).then(|| {
                if self.chance(0.5) {
                    Integrator::Absent
                } else {
                    Integrator::Gathers {
                        time: self.number((3.0, 30.0), (0.5, 600.0)),
                    }
                }
            }),
            sway_per_yaw_rate: said(self).then(|| self.number((0.0, 2.0), (-5.0, 20.0))),
            power: said(self).then(|| PropulsionPower {
                linear: self.number((0.0, 50.0), (0.0, 1.0e6)),
                cubic: self.number((0.0, 50.0), (0.0, 1.0e6)),
            }),
            speed_held: said(self)
                .then(|| [SpeedHeld::ThroughWater, SpeedHeld::OverGround][self.rng.random_range(0..2)]),
            heading_held: said(self)
                .then(|| [HeadingHeld::Heading, HeadingHeld::Course][self.rng.random_range(0..2)]),
            relative_uncertainty: said(self).then(|| self.number((0.05, 0.3), (0.0, 2.0))),
        }
    }

    fn reference(&mut self) -> Reference {
        Reference {
            speed: self.number((0.0, 1.5), (0.0, 40.0)),
            heading: Heading::new(self.number((-3.0, 3.0), (-3.1, 3.1))),
        }
    }

    /// What a filter may remember: every number by itself inside its range, and most of the time near `asc`.
    fn craft_memory(&mut self, asc: &AscState) -> CraftEstimate {
        let mut memory: Vec<f64> = Vec::with_capacity(MEMORY_LENGTH);
        let psi = if self.chance(0.8) {
            asc.heading.radians()
        } else {
            self.angle()
        };
        memory.extend([
            psi,
            self.number((-1.0, 2.0), (-6.0, 6.0)),
            self.number((-0.2, 0.2), (-4.0, 4.0)),
        ]);
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
        memory.extend([
            self.number((-1.0, 2.0), (-5.0, 5.0)),
            self.number((0.0, 0.5), (0.0, 100.0)),
        ]);
        memory.extend([(); 2].map(|()| self.number((-0.3, 0.3), (-3.0, 3.0))));
        memory.push(self.number((0.0, 0.1), (0.0, 100.0)));
        let place = self.place(asc.position, 2.0);
        memory.extend([place.x, place.y]);
        let alarm = f64::from(u8::from(self.chance(0.3)));
        memory.extend([psi, surge, self.number((0.0, 8.0), (0.0, 1.0e3)), alarm]);
        memory.extend([
            self.number((-0.3, 0.3), (-3.0, 3.0)),
            self.number((-0.3, 0.3), (-40.0, 40.0)),
        ]);
        let nearness = [(); 2].map(|()| self.number((0.0, 100.0), (0.0, 1.0e9)));
        memory.extend(nearness);
        memory.extend([
            f64::from(u8::from(self.chance(0.3))),
            self.number((0.0, 100.0), (0.0, 1.0e12)),
        ]);
        CraftEstimate::from_memory(&memory).expect("is a memory")
    }

    /// The upper triangle of one: a diagonal, and correlations that leave it positive.
    fn covariance(&mut self) -> [f64; 6] {
        let [a, b, c] = [(); 3].map(|()| self.number((1.0e-4, 0.5), (0.0, 100.0)));
        let rho = self.number((-0.4, 0.4), (-0.5, 0.5));
        let between = |a: f64, b: f64| rho * (a * b).sqrt();
        [a, between(a, b), between(a, c), b, between(b, c), c]
    }

    /// What a plan knew of an AUV: somewhere near the craft, or anywhere.
    fn previous_target(&mut self, auv: &Auv, asc: &AscState) -> PreviousTarget {
        let position = self.place(asc.position, 100.0);
        let mut axis = |usual: f64, most: f64| self.number((-usual, usual), (-most, most));
        PreviousTarget {
            id: auv.id.clone(),
            velocity: Vector2::new(axis(0.3, 20.0), axis(0.3, 20.0)),
            drift: Vector2::new(axis(0.1, 3.0), axis(0.1, 3.0)),
            position,
            depth: self.number((0.0, 30.0), (-10.0, 12_000.0)),
            turn_rate: self.number((-0.02, 0.02), (-1.0, 1.0)),
            report_age: self.number((0.0, 30.0), (0.0, 3600.0)),
            model: [
                ForecastModel::ConstantVelocity,
                ForecastModel::ConstantTurn,
                ForecastModel::Path,
                ForecastModel::Hold,
            ][self.rng.random_range(0..4)],
        }
    }
}
