//! Long-term cost of a craft that follows its schedules, against the best periodic tour.

use super::*;

/// AUVs at rest within a square kilometre.
fn places(seed: u64, n: usize) -> Vec<Vector2<f64>> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut place = || Vector2::new(rng.random_range(0.0..1000.0), rng.random_range(0.0..1000.0));
    (0..n).map(|_| place()).collect()
}

/// Distance within which an AUV is served, m.
const WITHIN: f64 = 20.0;

/// Mean age of all AUVs in the third lap of `tour`, with turns on the spot and 20 m to serve.
fn mean_age(places: &[Vector2<f64>], tour: &[usize]) -> f64 {
    let (mut here, mut heading, mut time) = (places[tour[tour.len() - 1]], 0.0_f64, 0.0);
    let mut served: Vec<Vec<f64>> = vec![Vec::new(); places.len()];
    let mut laps = vec![0.0];
    for _ in 0..3 {
        for to in tour {
            let way = places[*to] - here;
            let goes = (way.norm() - WITHIN).max(0.0);
            let (ahead, course) = (way.normalize(), way.y.atan2(way.x));
            let off = course - heading;
            time += off.sin().atan2(off.cos()).abs() / TURN_RATE;
            heading = course;
            for (place, times) in places.iter().zip(&mut served) {
                let to_place = place - here;
                let along = to_place.dot(&ahead).clamp(0.0, goes);
                if (to_place - ahead * along).norm() <= WITHIN + 1e-9 {
                    times.push(time + along / SPEED);
                }
            }
            here += ahead * goes;
            time += goes / SPEED;
        }
        laps.push(time);
    }
    let integral = |times: &Vec<f64>| -> f64 {
        let aged =
            |from: f64, until: f64, since: f64| 0.5 * ((until - since).powi(2) - (from - since).powi(2));
        let within = times.iter().filter(|time| laps[2] < **time);
        let before = times.iter().filter(|time| **time <= laps[2]);
        let (mut from, mut since, mut sum) = (laps[2], before.fold(0.0, |_, time| *time), 0.0);
        for time in within.copied().chain([laps[3]]) {
            sum += aged(from, time, since);
            (from, since) = (time, time);
        }
        sum
    };
    served.iter().map(integral).sum::<f64>() / (laps[3] - laps[2]) / places.len() as f64
}

/// The least mean age of all tours of up to eight visits.
fn best_tour(places: &[Vector2<f64>]) -> f64 {
    let n = places.len();
    let power = |exponent: usize| n.pow(u32::try_from(exponent).expect("small"));
    let mut best = f64::INFINITY;
    for length in n..=8 {
        for code in 0..power(length - 1) {
            let visit = |at: usize| code / power(at) % n;
            let tour: Vec<_> = [0].into_iter().chain((0..length - 1).map(visit)).collect();
            let again = (0..length).any(|at| tour[at] == tour[(at + 1) % length]);
            if !again && (0..n).all(|place| tour.contains(&place)) {
                best = best.min(mean_age(places, &tour));
            }
        }
    }
    best
}

#[test]
fn a_craft_on_its_schedules_serves_as_often_as_the_best_tour() {
    for (seed, n) in [(1, 3), (2, 3), (3, 4)] {
        let places = places(seed, n);
        let at = |(i, place): (usize, &Vector2<f64>)| {
            Auv::new(format!("auv-{i}").as_str(), moving(place.x, place.y, 10.0, 0.0, 0.0))
        };
        let auvs: Vec<_> = places.iter().enumerate().map(at).collect();
        let goal = Visits::new(auvs.iter().map(|auv| auv.id.clone()).collect());
        let craft = Asc::new(Vector2::new(500.0, 500.0), Heading::new(0.0), 0.0);
        let mut request = PlanRequest::new(0.0, craft, auvs, Goal::Visit(goal));
        let (mut sum, mut plans) = (0.0, 0.0);
        for _ in 0..1300 {
            let schedule = scheduled(&request);
            // After the first hour.
            if 3600.0 <= request.t_s {
                sum += schedule.costs.iter().map(|known| known.cost).sum::<f64>() / n as f64;
                plans += 1.0;
            }
            request = after_leg(&request, &schedule, 6.0);
        }
        let (mean, best) = (sum / plans, best_tour(&places));
        // On average half a step late at each visit.
        assert!(mean < 1.03 * best, "{seed}: {mean} s, the best tour {best} s");
    }
}
