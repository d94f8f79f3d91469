//! The contents of a file so far, against their limits and the time.

use std::io::{self, Read};

use crate::route::{POINTS_MAX, Route, RoutePoint, Unread, refused};

/// Largest file, also unpacked, bytes: a day's track. Reading takes at most eight times this.
pub const BYTES_MAX: usize = 8 << 20;

const ROUTES_MAX: usize = 10_000;

const COLUMNS_MAX: usize = 256;

/// Calls of [`Progress::look`] for each look at the time.
const LOOKS: usize = 256;

/// The contents so far, and the time limit. Readers report everything that they keep.
pub(crate) struct Progress<'a> {
    due: &'a dyn Fn() -> bool,
    looks: usize,
    points: usize,
    routes: usize,
}

impl<'a> Progress<'a> {
    pub(crate) fn new(due: &'a dyn Fn() -> bool) -> Self {
        Self { due, looks: 0, points: 0, routes: 0 }
    }

    /// Fails once it is due.
    pub(crate) fn look(&mut self, place: &str) -> Result<(), Unread> {
        self.looks += 1;
        if self.looks.is_multiple_of(LOOKS) && (self.due)() {
            return refused(place, "there is no time to read on");
        }
        Ok(())
    }

    /// Adds a point to `route`.
    pub(crate) fn point(&mut self, route: &mut Route, place: &str, point: RoutePoint) -> Result<(), Unread> {
        self.look(place)?;
        self.points += 1;
        if POINTS_MAX < self.points {
            return refused(place, format!("has more than {POINTS_MAX} points until here; thin it out"));
        }
        route.points.push(point);
        Ok(())
    }

    /// Adds a route, if it has points.
    pub(crate) fn route(&mut self, routes: &mut Vec<Route>, place: &str, route: Route) -> Result<(), Unread> {
        if route.points.is_empty() {
            return Ok(());
        }
        self.routes += 1;
        if ROUTES_MAX < self.routes {
            return refused(place, format!("has more than {ROUTES_MAX} routes until here; join or split it"));
        }
        routes.push(route);
        Ok(())
    }

    /// Fails if a line of `text` has too many columns.
    pub(crate) fn columns(&mut self, text: &str, delimiter: u8) -> Result<(), Unread> {
        for (k, line) in text.lines().enumerate() {
            self.look("file")?;
            let columns = 1 + line.bytes().filter(|byte| *byte == delimiter).count();
            if COLUMNS_MAX < columns {
                let fault = format!("has {columns} columns, at most {COLUMNS_MAX} are read");
                return refused(format!("line {}", k + 1), fault);
            }
        }
        Ok(())
    }

    /// The same bytes, while there is time.
    pub(crate) fn watched<R: Read>(&self, bytes: R) -> impl Read {
        Watched { bytes, due: self.due }
    }
}

struct Watched<'a, R> {
    bytes: R,
    due: &'a dyn Fn() -> bool,
}

impl<R: Read> Read for Watched<'_, R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if (self.due)() {
            return Err(io::Error::other("there is no time to read on"));
        }
        self.bytes.read(buffer)
    }
}
