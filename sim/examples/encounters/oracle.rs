//! A search with the true future: whether there is a way clear of all vessels, on given sides.

use std::collections::BTreeMap;

use nalgebra::Vector2;
use planner::angle::direction;

use crate::drawn::{Drawn, Ship};
use crate::{DURATION, SEPARATION};

/// Width of a cell, m, and number of cells to each side of the start.
const CELL: f64 = 5.0;
const HALF: i32 = 120;
/// Longest move between two looks, m: a diagonal one.
const JUMP: f64 = 7.1;
/// Five of twelve steps may be diagonal ones: what is reached is then an octagon.
const DIAGONAL: usize = 5;
const OF: usize = 12;

/// Where a way may not lead past a vessel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Side {
    /// Abeam of it, to starboard (1) or to port (−1) of its course.
    Abeam(f64),
    /// Ahead of it, within a minute.
    Ahead,
}

/// A point that knows the future: its place and time, s, and its speed, m/s.
#[derive(Clone, Copy)]
pub(crate) struct Point {
    pub(crate) start: Vector2<f64>,
    pub(crate) from: f64,
    pub(crate) speed: f64,
}

impl Point {
    /// `true` if it has a way clear of all vessels that leads past none where `forbidden` says so.
    pub(crate) fn has_a_way(self, drawn: &Drawn, forbidden: &BTreeMap<usize, Side>) -> bool {
        let step = CELL / self.speed;
        let is_clear = |place: Vector2<f64>, at: f64| {
            drawn.ships.iter().enumerate().all(|(i, ship)| {
                let there = place - ship.at(at).0;
                let is_barred = forbidden.get(&i).is_some_and(|side| barred(*side, ship, at, there, step));
                SEPARATION + 0.5 * ship.length < there.norm() && !is_barred
            })
        };
        let width = usize::try_from(2 * HALF + 1).unwrap_or(0);
        let cells = || (0..width * width).map(|i| (i / width, i % width));
        let offset = |i: usize| (i as f64 - f64::from(HALF)) * CELL;
        let mut reached: Vec<bool> = cells().map(|cell| cell == (width / 2, width / 2)).collect();
        let (mut time, mut steps) = (self.from, 0);
        while time < DURATION as f64 && !is_past(drawn, self.start, time) {
            (time, steps) = (time + step, steps + 1);
            let is_octagonal = steps * DIAGONAL % OF < DIAGONAL;
            let next = cells().map(|(north, east)| {
                let mut near = (-1..2_isize).flat_map(|a| (-1..2_isize).map(move |b| (a, b)));
                let is_reached = near.any(|(a, b)| {
                    let from = (north.wrapping_add_signed(a), east.wrapping_add_signed(b));
                    let moves = is_octagonal || a == 0 || b == 0;
                    moves && from.0 < width && from.1 < width && reached[from.0 * width + from.1]
                });
                let place = self.start + Vector2::new(offset(north), offset(east));
                is_reached && is_clear(place, time) && is_clear(place, time - 0.5 * step)
            });
            reached = next.collect();
            if !reached.contains(&true) {
                return false;
            }
        }
        true
    }
}

/// `true` if no vessel comes to `start` any more.
fn is_past(drawn: &Drawn, start: Vector2<f64>, time: f64) -> bool {
    let past = |ship: &Ship| (ship.at(time).0 - start).dot(&direction(ship.course)) / ship.speed.max(0.1);
    drawn.ships.iter().map(past).fold(f64::INFINITY, f64::min) > 200.0
}

/// `true` if the place `there` from the vessel is where it may not be passed.
fn barred(side: Side, ship: &Ship, at: f64, there: Vector2<f64>, step: f64) -> bool {
    let along = direction(ship.at(at).1);
    let (ahead, starboard) = (there.dot(&along), along.perp(&there));
    match side {
        Side::Abeam(sign) => 0.0 < sign * starboard && ahead.abs() < 0.5 * (0.5 * ship.speed * step + JUMP),
        Side::Ahead => starboard.abs() < 0.5 * JUMP && 0.0 < ahead && ahead < 60.0 * ship.speed,
    }
}
