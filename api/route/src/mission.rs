//! Items of MAVLink missions, from QGroundControl's plans and way-point lists.

use std::mem;

use crate::progress::Progress;
use crate::route::{Route, RoutePoint, Unread, refused};

/// Commands that go to a position: way-points, loiter, land, take-off. Source: MAVLink, MAV_CMD.
const GO_TO: [u64; 7] = [16, 17, 18, 19, 21, 22, 82];
/// Commands that no vehicle in the water carries out: land, take-off.
const FLIES: [u64; 2] = [21, 22];
const RETURN: u64 = 20;
const JUMP: u64 = 177;
const CHANGE_SPEED: u64 = 178;

/// Speeds along the route are of kinds below this: air or water, ground. Source: SPEED_TYPE.
const CLIMB_SPEED: f64 = 2.0;
/// The speed with which `CHANGE_SPEED` returns to the vehicle's own.
const OWN_SPEED: f64 = -2.0;

/// A mission, item by item.
#[derive(Default)]
pub(crate) struct Mission {
    pub(crate) route: Route,
    /// Speed from this item on, m/s.
    speed: Option<f64>,
    /// Items since the last jump.
    items: Vec<Item>,
}

struct Item {
    number: u64,
    /// Way-points before it.
    n_points: usize,
    changes_speed: bool,
}

impl Mission {
    /// Takes an item: its number, its command, and parameters 1, 2, 5, 6 and 7.
    pub(crate) fn take(
        &mut self,
        (place, progress): (&str, &mut Progress<'_>),
        (number, command): (u64, u64),
        [first, second, lat, lon, height]: [Option<f64>; 5],
    ) -> Result<(), Unread> {
        progress.look(place)?;
        // No vehicle reaches the items after a jump without end.
        if self.route.closed {
            return Ok(());
        }
        if command == JUMP {
            return self.jump((place, progress), first, second);
        }
        self.items.push(Item {
            number,
            n_points: self.route.points.len(),
            changes_speed: command == CHANGE_SPEED,
        });
        match (command, lat, lon) {
            (CHANGE_SPEED, ..) if first.is_none_or(|kind| kind < CLIMB_SPEED) => {
                self.speed = match second {
                    Some(OWN_SPEED) => None,
                    given => given.filter(|speed| 0.0 < *speed).or(self.speed),
                };
            }
            (RETURN, ..) => self.route.note("a return to where the vehicle was launched, which is left out"),
            // Zeros stand for the vehicle's own position.
            (_, Some(0.0), Some(0.0)) => {}
            (_, Some(lat), Some(lon)) if GO_TO.contains(&command) => {
                if FLIES.contains(&command) {
                    self.route.note(
                        "take-off or landing: the file is for an aircraft; their places are way-points here",
                    );
                }
                let mut point = RoutePoint::on_earth(place, lat, lon, height)?;
                point.speed_mps = self.speed;
                progress.point(&mut self.route, place, point)?;
            }
            _ if GO_TO.contains(&command) => return refused(place, "has no position"),
            _ => {}
        }
        Ok(())
    }

    /// Repeats the items from number `to` on `times` times; without end if that is negative.
    fn jump(
        &mut self,
        (place, progress): (&str, &mut Progress<'_>),
        to: Option<f64>,
        times: Option<f64>,
    ) -> Result<(), Unread> {
        let items = mem::take(&mut self.items);
        let at = items.iter().position(|item| Some(item.number as f64) == to);
        let (Some(at), Some(times)) = (at, times) else {
            return refused(place, "jumps to no item between the jump before and itself; write its legs out");
        };
        let (from, until) = (items[at].n_points, self.route.points.len());
        if times < 0.0 {
            if 0 < from {
                self.route.points.drain(..from);
                let note = format!(
                    "way-points before the part that repeats without end, which are left out: {from}"
                );
                self.route.notes.push(note);
            }
            self.route.closed = true;
            return Ok(());
        }
        // Until an item changes it, the speed of a repetition is that at the end.
        let change = items[at..].iter().find(|item| item.changes_speed);
        let changed_from = change.map_or(until, |item| item.n_points);
        let mut flown = 0.0;
        while flown < times.trunc() && from < until {
            for k in from..until {
                let mut point = self.route.points[k];
                if k < changed_from {
                    point.speed_mps = self.speed;
                }
                progress.point(&mut self.route, place, point)?;
            }
            flown += 1.0;
        }
        Ok(())
    }
}
