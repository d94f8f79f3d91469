//! AUVs given as `state`, once a second, with the memory of each answer for the next.

use std::f64::consts::FRAC_PI_2;

use crate::{
    estimate::{Estimate, Route, past_states::PAST_STATES_MAX},
    facts::{
        auv::Auv,
        evidence::AuvState,
        known_path::KnownPath,
        path::{curve::Path, piece::starboard},
    },
    tests::prelude::*,
};

const SPEED: f64 = 0.9;

/// The estimate of a vehicle in `state` at each second of `times`.
fn after(
    times: std::ops::Range<u32>,
    path: Option<&KnownPath>,
    state: impl Fn(f64) -> AuvState,
) -> Vec<Estimate> {
    let mut found: Vec<Estimate> = Vec::new();
    for second in times {
        let now = f64::from(second);
        let before = found.last().map_or((&[][..], &[][..]), |before| (&before.track, &before.states));
        let estimate = Estimate::remembering(&Auv::new("a", state(now)), path, now, before);
        assert!(estimate.states.len() <= PAST_STATES_MAX);
        found.push(estimate);
    }
    found
}

fn lanes() -> KnownPath {
    KnownPath {
        path: Path::lawn_mower(Vector2::zeros(), 0.4, 150.0, 25.0, 12).into(),
        horizontal_speed: SPEED,
    }
}

/// The state of a vehicle on lanes.
fn on_lanes(now: f64) -> AuvState {
    let point = lanes().path.at(SPEED * now);
    moving(point.position.x, point.position.y, 8.0, point.tangent, SPEED)
}

#[test]
fn a_state_that_goes_back_and_forth_on_lanes_is_expected_to_turn() {
    let found = after(0..700, None, on_lanes).pop().expect("has seconds");
    let route = found.route.expect("lanes are found");
    let turn = route.next_turn.expect("is on its fourth lane");
    // Half turns join lanes of 150 m, 25 m apart; the fourth lane ends after 798 s.
    let until = (4.0 * 150.0 + 3.0 * 12.5 * std::f64::consts::PI) / SPEED;
    near(turn.in_s, until - 699.0, 3.0);
    assert!(route.is_followed() && found.repeats.is_some());
    // The posted state stays what is believed for now.
    assert_eq!(found.state, on_lanes(699.0));
    let path = found.path.as_ref().expect("has a route");
    near_to(route.fit.position(path), found.state.position(), 1e-6);
}

#[test]
fn a_state_that_contradicts_its_path_is_not_forecast_along_it_as_declared() {
    let path = lanes();
    let along = |turned: f64, speed: f64, beside: f64| {
        let course = path.path.at(0.0).tangent;
        after(0..40, Some(&path), move |now| {
            let place = direction(course + turned) * (speed * now + 20.0) + starboard(course) * beside;
            moving(place.x, place.y, 8.0, course + turned, speed)
        })
        .pop()
        .expect("has seconds")
        .route
    };
    assert_eq!(along(0.0, SPEED, 0.0), None);
    let followed = |route: Option<Route>| route.expect("contradicts").is_followed();
    assert!(!followed(along(FRAC_PI_2, SPEED, 0.0)) && !followed(along(0.0, SPEED, -100.0)));
    // Another speed and an offset by its navigation are learnt, as from reports.
    near(along(0.0, 3.0, 0.0).expect("is faster").fit.faster(), 3.0 - SPEED, 0.2);
    assert!(followed(along(0.0, SPEED, -20.0)));
}

#[test]
fn a_state_that_jumps_or_is_not_where_its_velocity_leads_is_noticed() {
    let line = |north: f64, speed: f64| moving(north, 0.0, 8.0, 0.0, speed);
    let found = after(0..200, None, |now| line(SPEED * now, SPEED));
    assert!(found.iter().all(|found| !found.jumped && !found.velocity_contradicted));
    let jumped = |second: f64| if second < 120.0 { 0.0 } else { 1460.0 };
    let found = after(0..200, None, |now| line(SPEED * now + jumped(now), SPEED));
    let seconds: Vec<_> = (0..200).filter(|second| found[*second].jumped).collect();
    assert_eq!(seconds[0], 120);
    assert!(seconds.len() <= 20, "{seconds:?}");
    let found = after(0..120, None, |now| line(SPEED * now, 0.0));
    assert!(found.last().is_some_and(|found| found.velocity_contradicted));
}
