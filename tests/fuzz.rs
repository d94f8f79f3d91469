//! Numbered cases: valid and broken requests, whose answers become previous plans.

use std::{collections::BTreeMap, f64::consts::TAU};

use planner::parameters::Parameters;
use planner::plan::{Workspace, plan_until};
use planner::snapshot::{Goal, Snapshot, Visits};
use planner::stop::Stop;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};
use service::{BODY_BYTES_MAX, examples::EXAMPLES};
use wire::{BodyError, FieldError, PlanRequest};

use crate::broken::{BREAKERS, pick, places_of};
use crate::{answer, random};

/// Number of consecutive answers that become previous plans.
const CHAIN_MAX: usize = 3;

/// Ends of accepted ranges and of arithmetic.
const EDGES: [f64; 40] = [
    0.0, 5e-324, 1e-308, 1e-12, 1e-9, 1e-6, 0.001, 0.01, 0.05, 0.1, 0.5, 1.0, 1.4, 1.5, 2.0, 2.5, 3.0, 3.6,
    5.0, TAU, 10.0, 20.0, 25.0, 40.0, 60.0, 64.0, 100.0, 120.0, 600.0, 900.0, 1e3, 3600.0, 1e4, 1.2e4, 2e4,
    1e6, 2e6, 1e10, 1e11, 2e11,
];

/// Plans for consecutive cases, as a thread of the service does.
#[derive(Debug, Default)]
pub struct Fuzzer {
    workspace: Workspace,
    /// Number of answered bodies, and of refused ones by reason.
    pub tally: BTreeMap<String, u64>,
}

impl Fuzzer {
    /// Answers the body of a case, then the same facts a little later with the answer handed back,
    /// and so on. `until` runs the planning that it gets with a stop signal.
    pub fn try_case(&mut self, number: u64, mut until: impl FnMut(&mut ChaCha8Rng, &mut dyn FnMut(&Stop))) {
        let case = Case(number);
        let (mut body, mut rng) = (case.body(), case.rng());
        for _ in 0..CHAIN_MAX {
            if BODY_BYTES_MAX < body.len() {
                return;
            }
            let mut answered = Err(String::new());
            until(&mut rng, &mut |stop| answered = self.answered(&body, stop));
            let how = answered.as_ref().map_or_else(String::clone, |_| "planned".to_owned());
            *self.tally.entry(how).or_default() += 1;
            let Ok((request, answer)) = answered else { return };
            let answer: Value = serde_json::from_slice(&answer).expect("answers are JSON");
            assert_finite(&answer);
            body = later(&request, &answer, &mut rng).to_string().into_bytes();
            if let Err(faults) = read(&body) {
                let about = |fault: &FieldError| fault.pointer.starts_with("/previous_plan");
                assert!(!faults.iter().any(about), "not taken back: {faults:?}");
            }
        }
    }

    /// The request and the answer to it, or why there is none.
    fn answered(&mut self, body: &[u8], stop: &Stop) -> Result<(PlanRequest, Vec<u8>), String> {
        let (request, snapshot) = read(body).map_err(|faults| faults[0].code.clone())?;
        let plan = plan_until(&snapshot, &Parameters::default(), &mut self.workspace, stop);
        let answer = answer(&snapshot, &plan);
        let answer = serde_json::to_vec(&answer).expect("strings, numbers and lists only");
        Ok((request, answer))
    }
}

/// A case by its number; one that is dropped in a panic says which.
struct Case(u64);

impl Drop for Case {
    fn drop(&mut self) {
        if std::thread::panicking() {
            let Self(seed) = self;
            eprintln!("again with PILOTFISH_FUZZ_FIRST={seed}");
        }
    }
}

impl Case {
    fn rng(&self) -> ChaCha8Rng {
        ChaCha8Rng::seed_from_u64(self.0)
    }

    /// A body that is broken, has numbers at edges and parts of others, or is valid.
    fn body(&self) -> Vec<u8> {
        let mut rng = self.rng();
        match rng.random_range(0..10) {
            0 => {
                let mut bytes = vec![0; rng.random_range(0..512)];
                rng.fill(&mut bytes[..]);
                bytes
            }
            1 => {
                let break_it = pick(&mut rng, &BREAKERS);
                let request = request(&mut rng).to_string();
                break_it(&request, &mut rng)
            }
            2..7 => {
                let mut request = request(&mut rng);
                for _ in 0..rng.random_range(1..6) {
                    mutate(&mut request, &mut rng);
                }
                request.to_string().into_bytes()
            }
            _ => request(&mut rng).to_string().into_bytes(),
        }
    }
}

/// An example or any valid request.
fn request(rng: &mut ChaCha8Rng) -> Value {
    let mut any = random::observation(rng.random());
    if rng.random_range(0..6) == 0 {
        let auvs = any.auvs.iter().map(|auv| auv.id.clone()).collect();
        any.goal = Goal::Visit(Visits::new(auvs)).into();
    }
    if rng.random_range(0..3) > 0 && any.check().is_ok() {
        return json!(any);
    }
    serde_json::from_str(pick(rng, &EXAMPLES).body).expect("examples are JSON")
}

/// Changes one place of a request; most changes of a valid one leave it valid.
fn mutate(request: &mut Value, rng: &mut ChaCha8Rng) {
    match rng.random_range(0..10) {
        0..6 => at_edge(request, rng),
        6 => {
            let donor = self::request(rng);
            let shared = places_of(&donor, |_| true);
            let place = pick(rng, &shared);
            if let (Some(here), Some(there)) = (request.pointer_mut(place), donor.pointer(place)) {
                *here = there.clone();
            }
        }
        7 => splice(request, rng),
        _ => {
            let objects = places_of(request, Value::is_object);
            let members = request.pointer_mut(pick::<String>(rng, &objects));
            let members = members.and_then(Value::as_object_mut).expect("was just found");
            let names: Vec<String> = members.keys().cloned().collect();
            if !names.is_empty() {
                members.remove(pick(rng, &names));
            }
        }
    }
}

/// Puts a number at the end of a range, beside it, or a bit or a lot away from where it was.
fn at_edge(request: &mut Value, rng: &mut ChaCha8Rng) {
    let numbers = places_of(request, Value::is_number);
    if numbers.is_empty() {
        return;
    }
    let number = request.pointer_mut(pick::<String>(rng, &numbers));
    let number = number.expect("was just found");
    let was = number.as_f64().expect("is a number");
    let edge = *pick(rng, &EDGES) * if rng.random() { 1.0 } else { -1.0 };
    *number = json!(match rng.random_range(0..8) {
        0 => edge.next_up(),
        1 => edge.next_down(),
        2 => was * rng.random_range(-2.0..2.0),
        3 => was + rng.random_range(-1.0..1.0),
        _ => edge,
    });
}

/// Makes a list longer, shorter, or turns it round.
fn splice(request: &mut Value, rng: &mut ChaCha8Rng) {
    let is_long = |value: &Value| value.as_array().is_some_and(|list| !list.is_empty());
    let lists = places_of(request, is_long);
    if lists.is_empty() {
        return;
    }
    let list = request.pointer_mut(pick::<String>(rng, &lists));
    let list = list.and_then(Value::as_array_mut).expect("was just found");
    match rng.random_range(0..4) {
        0 => list.truncate(rng.random_range(0..list.len())),
        1 => list.reverse(),
        2 => list.extend_from_within(rng.random_range(0..list.len())..),
        _ => list.resize(rng.random_range(1..=64), list[0].clone()),
    }
}

/// The request in a body, or its faults.
pub fn read(body: &[u8]) -> Result<(PlanRequest, Snapshot), Vec<FieldError>> {
    let read = wire::read(body).map_err(|unread| {
        let (is_json, fault) = match unread {
            BodyError::Syntax(fault) => (false, fault),
            BodyError::Shape(fault) => (true, fault),
        };
        let found = serde_json::from_slice::<Value>(body).is_ok();
        assert_eq!(found, is_json, "{fault:?}");
        vec![*fault]
    });
    let read = read.and_then(|request: PlanRequest| Ok((request.clone(), wire::snapshot(request)?)));
    let has_place = |fault: &FieldError| fault.pointer.is_empty() || fault.pointer.starts_with('/');
    if let Err(faults) = &read {
        assert!(!faults.is_empty() && faults.iter().all(has_place), "{faults:?}");
    }
    read
}

/// A number that is not finite is written as null.
fn assert_finite(answer: &Value) {
    let nulls = places_of(answer, Value::is_null);
    assert!(nulls.is_empty(), "no numbers: {nulls:?} of {answer}");
}

/// The request with the answer as previous plan, mostly later, after the craft followed it.
fn later(request: &PlanRequest, answer: &Value, rng: &mut ChaCha8Rng) -> Value {
    let mut later = json!(request);
    later["previous_plan"] = answer.clone();
    let point = &answer["trajectory"][rng.random_range(0..3)];
    let (Some(t_s), Some(speed)) = (point["t_s"].as_f64(), point["speed_mps"].as_f64()) else {
        return later;
    };
    let inside = |member: &str| json!(point[member].as_f64().map(|metres| metres.clamp(-1e6, 1e6)));
    later["t_s"] = json!(t_s.clamp(-1e11, 1e11));
    let asc = &mut later["asc"];
    asc["north_m"] = inside("north_m");
    asc["east_m"] = inside("east_m");
    asc["heading_rad"] = point["heading_rad"].clone();
    asc["speed_mps"] = json!(speed.min(20.0));
    later
}
