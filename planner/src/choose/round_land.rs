//! The goal's way round no-go areas, for law and program alike.

use nalgebra::Vector2;

use crate::coast::way::Search;
use crate::predict::goal::{GoalForecast, Way};
use crate::problem::limits::sag_in_turn;
use crate::problem::parameters::Parameters;
use crate::snapshot::build::Snapshot;
use crate::solve::stop::Stop;

/// Distance between the goal's way and where the program's limits begin, m: a law errs by about it.
const BESIDE_LIMITS: f64 = 0.3;

/// Searches for a way to where the goal will be on arrival: each knows the arrival better.
const MEETINGS: usize = 3;

/// Least share of the craft's speed that it makes good against a current.
const MADE_GOOD: f64 = 0.1;

/// `goal` outside no-go areas, and on the shortest way to there if land is in between.
///
/// On the way it moves at the craft's planned speed from where the craft is, slower where that must
/// turn, and meets the moving goal. Without a way it goes as far as the straight line is open.
pub(super) fn led_round(
    goal: GoalForecast,
    snapshot: &Snapshot,
    parameters: &Parameters,
    stop: &Stop,
) -> GoalForecast {
    let land = snapshot.land();
    if land.is_empty() {
        return goal;
    }
    let limits = parameters.planned(snapshot.craft_model()).limits;
    let clearance = clearance(snapshot, parameters);
    let search = Search { land, clearance, due: &|| stop.is_due() };
    let permitted = |time: f64| land.permitted(&goal.wanted(time).position, clearance);
    let (craft, mut times) = (snapshot.asc.position(), parameters.times());
    // A way includes its begin, not its end.
    times.push(times[times.len() - 1] + parameters.steps.iter().copied().fold(0.0, f64::max));
    let start = land.permitted(&craft, clearance);
    let (mut arrival, mut is_open, mut arrives) = (0.0, true, true);
    let mut places = vec![(0.0, craft)];
    let mut to = permitted(0.0);
    if start == craft && search.is_clear(&craft, &to) {
        let is_outside = |time: &f64| permitted(*time) == goal.wanted(*time).position;
        if times.iter().all(is_outside) {
            return goal;
        }
        places.clear();
    } else {
        for _ in 0..MEETINGS {
            let found = search.way(&start, &to);
            // A search that was cut short says nothing of ways.
            is_open = found.is_some() || stop.is_due();
            arrives = found.as_ref().is_some_and(|way| way.last() == Some(&to));
            let way = found.unwrap_or_else(|| vec![start, search.as_far_as_open(&start, &to)]);
            places.truncate(1);
            let mut course = snapshot.asc.heading().unit();
            for place in way {
                let (time, last) = places[places.len() - 1];
                let leg = place - last;
                if let Some(along) = leg.try_normalize(f64::EPSILON) {
                    let speed = made_good(&along, limits.speed_max, &snapshot.current());
                    let turn = course.perp(&along).atan2(course.dot(&along)).abs();
                    places.push((time + (leg.norm() / speed).max(turn / limits.turn_rate_max), place));
                    course = along;
                }
            }
            arrival = places[places.len() - 1].0;
            let then = permitted(arrival);
            if (then - to).norm() < clearance || !arrives {
                break;
            }
            to = then;
        }
    }
    let end = places.last().map(|(_, place)| *place);
    let later = times.iter().filter(|time| places.is_empty() || arrival < **time);
    let at_goal = later.map(|time| (*time, end.filter(|_| !arrives).unwrap_or_else(|| permitted(*time))));
    places.extend(at_goal.collect::<Vec<_>>());
    goal.by_way_of(Way { places, is_open })
}

/// Distance of ways from no-go areas, m.
pub(super) fn clearance(snapshot: &Snapshot, parameters: &Parameters) -> f64 {
    let limits = parameters.planned(snapshot.craft_model()).limits;
    let longest = parameters.steps.iter().copied().fold(0.0, f64::max);
    parameters.keep_out_margin + sag_in_turn(longest, &limits) + BESIDE_LIMITS
}

/// Speed over ground in the direction `along` at `speed` through water with this `current`, m/s.
fn made_good(along: &Vector2<f64>, speed: f64, current: &Vector2<f64>) -> f64 {
    let across = along.perp(current);
    let ahead = (speed * speed - across * across).max(0.0).sqrt() + along.dot(current);
    ahead.max(MADE_GOOD * speed)
}
