//! A live mission kept beside the craft's loop: reports go out and plans come in on threads of their own, so that a slow service never
//! holds the craft's messages up.

use std::{
    collections::{BTreeMap, VecDeque},
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    thread,
    time::{Duration, Instant},
};

use serde_json::{Map, Value, json};

use crate::{
    AuvFix, StateNow,
    clock::Clock,
    mission::{Missions, NoAnswer, Reports},
    plan::PlanNow,
};

/// Fixes of one AUV that wait for the service at most: as many as it takes at once.
const FIXES_MAX: usize = 64;
/// Notes that wait at most.
const NOTES_MAX: usize = 64;
/// Between two attempts at what had no answer.
const REST: Duration = Duration::from_millis(300);

/// What is known of the mission at one moment.
#[derive(Clone, Debug, Default)]
pub struct LinkNow {
    /// The mission, once it is there.
    pub mission: Option<String>,
    /// The newest plan.
    pub plan: Option<PlanNow>,
    /// Why the service did not answer the last call; none if it did.
    pub trouble: Option<String>,
    /// Reports that the service refused, and why the last one was.
    pub refused: Option<(u64, String)>,
    /// Whether that will stay so: the mission cannot be kept.
    pub hopeless: bool,
    /// Whether the mission is held: it plans no more until it is run.
    pub is_held: bool,
    /// Whether the mission is over.
    pub is_over: bool,
}

/// What waits to be posted.
#[derive(Debug, Default)]
struct Outbox {
    asc: Option<Value>,
    auvs: BTreeMap<String, VecDeque<Value>>,
    notes: VecDeque<Value>,
    dropped: u64,
}

/// Which mission to keep.
#[derive(Clone, Debug)]
pub enum Which {
    /// This one, which is there.
    Joined(String),
    /// The one that goes on under a name, or a new one.
    Named {
        /// The name.
        name: String,
        /// Digest of what its operator asked for.
        wanted: String,
        /// Body of `POST /v1/missions`.
        body: Value,
    },
}

/// A mission, kept by two threads until the program ends.
#[derive(Clone, Debug)]
pub struct MissionLink {
    shared: Arc<Shared>,
}

#[derive(Debug)]
struct Shared {
    now: Mutex<LinkNow>,
    outbox: Mutex<Outbox>,
    clock: Clock,
    /// Of fixes that say nothing of their accuracy, m.
    sigma_m: f64,
}

/// How a mission is kept.
#[derive(Clone, Copy, Debug)]
pub struct Keeping {
    /// Between two posts of what has come until then.
    pub interval: Duration,
    /// Standard deviation of fixes that say nothing of their accuracy, m.
    pub sigma_m: f64,
    /// The bridge's clock.
    pub clock: Clock,
}

impl MissionLink {
    /// Keeps `which` mission of `missions`.
    #[must_use]
    pub fn keep(missions: Missions, which: Which, keeping: Keeping) -> Self {
        let Keeping {
            interval,
            sigma_m,
            clock,
        } = keeping;
        let shared = Arc::new(Shared {
            now: Mutex::default(),
            outbox: Mutex::default(),
            clock,
            sigma_m,
        });
        let missions = Arc::new(missions);
        let (poster, waiter) = (Arc::clone(&shared), Arc::clone(&shared));
        let calls = Arc::clone(&missions);
        thread::spawn(move || poster.post(&calls, &which, interval));
        thread::spawn(move || waiter.wait_for_plans(&missions));
        Self { shared }
    }

    /// What is known now.
    #[must_use]
    pub fn now(&self) -> LinkNow {
        lock(&self.shared.now).clone()
    }

    /// Posts the craft's state soon, times on the bridge's clock, and whether references steer it; a newer one replaces it.
    pub fn report_craft(&self, state: &StateNow, is_steered: bool) {
        let t_s = self.shared.clock.unix_s(state.t_s);
        lock(&self.shared.outbox).asc = Some(asc_report(t_s, state, is_steered));
    }

    /// Posts a fix soon; its time is Unix time.
    pub fn report_auv(&self, fix: &AuvFix) {
        let mut outbox = lock(&self.shared.outbox);
        let waiting = outbox.auvs.entry(fix.auv.clone()).or_default();
        waiting.push_back(auv_report(fix, self.shared.sigma_m));
        if waiting.len() > FIXES_MAX {
            waiting.pop_front();
            outbox.dropped += 1;
        }
    }

    /// Writes into the mission's log what the bridge did at `t_s` of its clock.
    pub fn note(&self, t_s: f64, text: &str) {
        let t_s = self.shared.clock.unix_s(t_s);
        let mut outbox = lock(&self.shared.outbox);
        outbox.notes.push_back(json!({ "t_s": t_s, "text": text }));
        if outbox.notes.len() > NOTES_MAX {
            outbox.notes.pop_front();
            outbox.dropped += 1;
        }
    }
}

impl Shared {
    fn post(&self, missions: &Missions, which: &Which, interval: Duration) {
        let mission = self.find(missions, which);
        lock(&self.now).mission = Some(mission.clone());
        // Keys of this run alone.
        let run = self.clock.unix_s(0.0).to_bits();
        for number in 0_u64.. {
            let started = Instant::now();
            let reports = lock(&self.outbox).take();
            if reports != Reports::default() {
                self.insist(missions, &mission, &reports, &format!("bridge-{run:x}-{number}"));
            }
            thread::sleep(interval.saturating_sub(started.elapsed()));
        }
    }

    /// Finds or makes the mission, for as long as it takes.
    fn find(&self, missions: &Missions, which: &Which) -> String {
        loop {
            let found = match which {
                Which::Joined(id) => missions.mission(id).and_then(|mission| missions.begun(mission)),
                Which::Named { name, wanted, body } => missions.find_or_make(name, wanted, body),
            };
            match found {
                Ok(mission) => {
                    let mut now = lock(&self.now);
                    now.trouble = None;
                    now.is_over = mission.is_over();
                    return mission.id;
                }
                Err(error) => {
                    let mut now = lock(&self.now);
                    now.hopeless = !matches!(error, NoAnswer::Later(_));
                    now.trouble = Some(error.to_string());
                }
            }
            thread::sleep(Duration::from_secs(1));
        }
    }

    /// Posts until there is an answer.
    fn insist(&self, missions: &Missions, mission: &str, reports: &Reports, key: &str) {
        loop {
            match missions.report(mission, reports, key) {
                Ok(()) => {
                    lock(&self.now).trouble = None;
                    return;
                }
                Err(error @ NoAnswer::Later(_)) => lock(&self.now).trouble = Some(error.to_string()),
                Err(error) => {
                    let count = {
                        let mut now = lock(&self.now);
                        let count = 1 + now.refused.as_ref().map_or(0, |(count, _)| *count);
                        now.refused = Some((count, error.to_string()));
                        count
                    };
                    // One AUV that the mission does not know must not cost the craft its plans.
                    let alone = Reports {
                        auvs: Map::new(),
                        ..reports.clone()
                    };
                    if alone != *reports && alone != Reports::default() {
                        self.insist(missions, mission, &alone, &format!("{key}-{count}"));
                    }
                    return;
                }
            }
            thread::sleep(REST);
        }
    }

    fn wait_for_plans(&self, missions: &Missions) {
        let mut after = 0;
        loop {
            let Some(mission) = lock(&self.now).mission.clone() else {
                thread::sleep(REST);
                continue;
            };
            match missions.reference(&mission, after) {
                Ok(Some(answer)) => {
                    let sequence = answer["sequence"].as_u64().unwrap_or(0);
                    let is_over = matches!(answer["status"].as_str(), Some("finished" | "failed"));
                    let is_running = answer["status"].as_str() == Some("running");
                    let plan = PlanNow::of(&answer, self.clock.now_s());
                    let mut now = lock(&self.now);
                    now.is_over = is_over;
                    // A mission that is held plans no more, and its last plan is not followed on.
                    now.is_held = !is_running && !is_over;
                    now.plan = plan.filter(|_| is_running);
                    drop(now);
                    if sequence <= after {
                        thread::sleep(REST);
                    }
                    after = after.max(sequence);
                }
                Ok(None) => {
                    // Without a plan, the mission itself tells whether one is to come.
                    if let Ok(found) = missions.mission(&mission) {
                        let mut now = lock(&self.now);
                        now.is_over = found.is_over();
                        now.is_held = found.status == "paused";
                    }
                    thread::sleep(REST);
                }
                Err(error) => {
                    lock(&self.now).trouble = Some(error.to_string());
                    thread::sleep(REST);
                }
            }
        }
    }
}

impl Outbox {
    fn take(&mut self) -> Reports {
        let auvs = std::mem::take(&mut self.auvs);
        Reports {
            auvs: auvs
                .into_iter()
                .map(|(auv, fixes)| (auv, fixes.into_iter().collect()))
                .collect(),
            asc: self.asc.take().into_iter().collect(),
            notes: std::mem::take(&mut self.notes).into_iter().collect(),
        }
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

fn asc_report(t_s: f64, state: &StateNow, is_steered: bool) -> Value {
    let mut now = json!({
        "lat_deg": state.position.lat_deg,
        "lon_deg": state.position.lon_deg,
        "heading_rad": state.heading,
        "speed_mps": state.water_velocity.x,
        "sway_mps": state.water_velocity.y,
        "yaw_rate_radps": state.yaw_rate,
    });
    if let Some(velocity) = state.ground_velocity {
        now["ground_north_mps"] = velocity.x.into();
        now["ground_east_mps"] = velocity.y.into();
    }
    let mut report = json!({ "t_s": t_s, "state": now, "steered": is_steered });
    if let Some(current) = state.current {
        report["current"] = json!({ "north_mps": current.x, "east_mps": current.y });
    }
    report
}

fn auv_report(fix: &AuvFix, sigma_m: f64) -> Value {
    let mut report = Map::new();
    report.insert("t_s".to_owned(), fix.t_s.into());
    report.insert("lat_deg".to_owned(), fix.position.lat_deg.into());
    report.insert("lon_deg".to_owned(), fix.position.lon_deg.into());
    report.insert("sigma_m".to_owned(), fix.sigma_m.unwrap_or(sigma_m).into());
    if let Some(depth) = fix.depth_m {
        report.insert("depth_m".to_owned(), depth.into());
    }
    if let Some(velocity) = fix.ground_velocity {
        report.insert("course_rad".to_owned(), velocity.y.atan2(velocity.x).into());
        report.insert("speed_mps".to_owned(), velocity.norm().into());
    }
    report.into()
}
