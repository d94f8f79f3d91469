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
    /// Time between two reports of a vessel, s; the real ones are 2 to 10 s under way, 30 s of small
    /// vessels, 180 s at anchor.
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

/// The receiver, with what it knows.
#[derive(Clone, Debug)]
pub struct Ais {
    setup: AisSetup,
    noise: ChaCha8Rng,
    /// Time of the next report of each vessel, s.
    next: Vec<f64>,
    /// Reports on their way, with the time of reception, s.
    late: VecDeque<(f64, usize, Vessel)>,
    known: Vec<Option<Vessel>>,
}

impl Ais {
    /// The receiver of that many vessels, whose first reports are spread over an interval.
    pub fn new(setup: AisSetup, n_vessels: usize, mut noise: ChaCha8Rng) -> Self {
        let next = (0..n_vessels).map(|_| setup.interval * noise.random::<f64>()).collect();
        Self { setup, noise, next, late: VecDeque::new(), known: vec![None; n_vessels] }
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
            let place = vessel.position + error * self.setup.position_sigma;
            let course = wrap(vessel.course + course * self.setup.course_sigma);
            let received = time + self.setup.latency;
            self.late.push_back((received, i, said(vessel, place, course, received, &self.setup)));
        }
        while self.late.front().is_some_and(|(received, ..)| *received <= time) {
            if let Some((_, i, vessel)) = self.late.pop_front() {
                self.known[i] = Some(vessel);
            }
        }
    }

    /// The newest report of each vessel that was heard.
    pub(super) fn known(&self) -> impl Iterator<Item = &Vessel> {
        self.known.iter().flatten()
    }
}

fn said(vessel: &SimulatedVessel, place: Vector2<f64>, course: f64, time: f64, setup: &AisSetup) -> Vessel {
    Vessel {
        id: vessel.id.as_str().into(),
        name: None,
        t_s: Some(time),
        north_m: place.x,
        east_m: place.y,
        lat_deg: None,
        lon_deg: None,
        course_rad: (0.3 < vessel.speed).then_some(course),
        speed_mps: Some(vessel.speed),
        heading_rad: None,
        length_m: Some(vessel.length),
        sigma_m: Some(setup.position_sigma.max(1.0)),
        status: vessel.status,
    }
}
