//! AIS aboard the surface craft: what other vessels say of themselves, late, lost and inexact.

use std::collections::VecDeque;

use nalgebra::Vector2;
use planner::angle::wrap;
use planner::snapshot::Vessel;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::noise::normal_pair;
use crate::world::vessel::SimulatedVessel;

/// Errors of AIS. Each σ is a standard deviation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AisSetup {
    /// Time between two reports of a vessel, s: really 2 to 10 s under way, 180 s at anchor.
    pub interval: f64,
    /// Time from a position to its reception, s, which nobody notices.
    pub latency: f64,
    /// Share of lost reports.
    pub lost_share: f64,
    /// σ of a position along either axis, m.
    pub position_sigma: f64,
    /// σ of a course, rad.
    pub course_sigma: f64,
}

/// A report of a vessel, received at a time, s.
#[derive(Clone, Copy, Debug)]
struct Heard {
    vessel: usize,
    time: f64,
    position: Vector2<f64>,
    course: f64,
    speed: f64,
}

/// The receiver, with the reports on their way and the newest of each vessel.
#[derive(Clone, Debug)]
pub struct Ais {
    setup: AisSetup,
    noise: ChaCha8Rng,
    /// Time of the next report of each vessel, s.
    next: Vec<f64>,
    late: VecDeque<Heard>,
    known: Vec<Option<Heard>>,
}

impl Ais {
    /// The receiver of that many vessels, whose first reports are spread over an interval.
    pub fn new(setup: AisSetup, n_vessels: usize, mut noise: ChaCha8Rng) -> Self {
        let next = (0..n_vessels).map(|_| setup.interval * noise.random::<f64>()).collect();
        // Listening allocates nothing: one a second for half a minute.
        let late = VecDeque::with_capacity(32 * n_vessels);
        Self { setup, noise, next, late, known: vec![None; n_vessels] }
    }

    /// Listens at `time`, s.
    pub(super) fn listen(&mut self, time: f64, vessels: &[SimulatedVessel]) {
        for (i, vessel) in vessels.iter().enumerate() {
            if time < self.next[i] {
                continue;
            }
            self.next[i] += self.setup.interval;
            let (error, course) = (normal_pair(&mut self.noise), normal_pair(&mut self.noise).x);
            if self.noise.random::<f64>() < self.setup.lost_share {
                continue;
            }
            self.late.push_back(Heard {
                vessel: i,
                time: time + self.setup.latency,
                position: vessel.position + error * self.setup.position_sigma,
                course: wrap(vessel.course + course * self.setup.course_sigma),
                speed: vessel.speed,
            });
        }
        while let Some(heard) = self.late.front().copied().filter(|heard| heard.time <= time) {
            self.late.pop_front();
            self.known[heard.vessel] = Some(heard);
        }
    }

    /// The newest report of each of `vessels` that was heard.
    pub(super) fn known(&self, vessels: &[SimulatedVessel]) -> Vec<Vessel> {
        let report = |heard: &Heard| {
            let vessel = &vessels[heard.vessel];
            Vessel {
                id: vessel.id.as_str().into(),
                name: None,
                t_s: Some(heard.time),
                north_m: heard.position.x,
                east_m: heard.position.y,
                lat_deg: None,
                lon_deg: None,
                course_rad: (0.3 < heard.speed).then_some(heard.course),
                speed_mps: Some(heard.speed),
                heading_rad: None,
                length_m: Some(vessel.length),
                sigma_m: Some(self.setup.position_sigma.max(1.0)),
                plan: Vec::new(),
                status: vessel.status,
            }
        };
        self.known.iter().flatten().map(report).collect()
    }
}
