//! Acoustic modems: where an AUV was, from what a modem on the craft prints.
//!
//! ```text
//! bytes → Lines → one format → Sighting → Site → AuvFix
//! ```
//!
//! A format turns one line into a `Sighting`: who, when, and a vector from the transducer or a place on Earth.
//! A `Site` knows how the transducer is mounted and places the sighting on Earth with the craft's pose at the
//! time when the signal arrived ([`PoseHistory`]), for a USBL measures from where the craft was then.
//!
//! Time. `received_s` is when the bytes arrived, s of Unix time. A fix carries the time at which the AUV sent
//! its signal:
//!
//! ```text
//! arrival  = received − age          age: what the modem says passed between arrival and its line
//! t        = arrival − travel        travel: one way, as the modem measured it, else distance / sound speed
//! ```
//!
//! The latency of the wire between modem and bridge is not in these terms; nothing on the wire tells it.
//!
//! Frames: transducer and craft are forward, starboard, down (FRD); Earth is north, east, down (NED). Where a
//! modem prints other axes, its module says how they are turned.

mod cut;
mod evologics;
mod lines;
mod mounting;
mod pattern;
mod pose;
#[cfg(test)]
mod promises;
mod seatrac;
mod sentences;
mod settings;
mod sighting;
mod site;
#[cfg(test)]
mod world;

use self::{lines::Lines, pattern::Pattern, site::Site};
pub use self::{
    mounting::Mounting,
    pose::{CraftPose, PoseHistory},
    settings::{Frame, ModemKind, Settings, UnusableSettings},
    site::KnownDepth,
};
use crate::{AuvFix, Refused};

/// One modem's wire.
#[derive(Debug)]
pub struct Modem {
    lines: Lines,
    format: Format,
    site: Site,
    refused: Refused,
}

/// What the lines of a modem look like.
#[derive(Debug)]
enum Format {
    Evologics(Frame),
    Seatrac(Frame),
    Sentences,
    Pattern(Box<Pattern>),
}

impl Modem {
    /// The adapter for a modem that is set up as `settings` say. Fails where they cannot be meant.
    pub fn new(settings: &Settings) -> Result<Self, UnusableSettings> {
        let site = Site::new(settings)?;
        let format = match &settings.modem {
            ModemKind::Evologics { frame } => Format::Evologics(*frame),
            ModemKind::Seatrac { frame } => Format::Seatrac(*frame),
            ModemKind::Sentences => Format::Sentences,
            ModemKind::Pattern { pattern } => {
                Format::Pattern(Box::new(Pattern::new(pattern, &settings.names)?))
            }
        };
        let relative = match &format {
            Format::Evologics(_) | Format::Seatrac(_) => true,
            Format::Sentences => false,
            Format::Pattern(pattern) => pattern.is_relative(),
        };
        if relative && settings.mounting.is_none() {
            return Err(UnusableSettings::NoMounting);
        }
        Ok(Self {
            lines: Lines::default(),
            format,
            site,
            refused: Refused::default(),
        })
    }

    /// The fixes that `bytes` complete, in the order of their lines. `received_s` is when the bytes arrived, s of
    /// Unix time. Lines may be split over any number of calls; a line counts as received with its last byte.
    pub fn push(&mut self, bytes: &[u8], received_s: f64, poses: &PoseHistory) -> Vec<AuvFix> {
        let mut fixes = Vec::new();
        for &byte in bytes {
            let Some(line) = self.lines.push(byte) else {
                continue;
            };
            let fix = line.and_then(|line| {
                let sighting = self.format.read(&line, received_s)?;
                self.site.fix(&sighting, received_s, poses)
            });
            match fix {
                Ok(fix) => fixes.push(fix),
                Err(reason) => self.refused.count(reason),
            }
        }
        fixes
    }

    /// Takes note of the depth of `auv` (its name, or `usbl-<address>`), from wherever it is known: a bearing and
    /// an elevation alone make a fix while such a depth is fresh.
    pub fn note_depth(&mut self, auv: &str, depth: KnownDepth) {
        self.site.note_depth(auv, depth);
    }

    /// What was not understood or not usable, by reason.
    #[must_use]
    pub fn refused(&self) -> &Refused {
        &self.refused
    }
}

impl Format {
    fn read(&self, line: &str, received_s: f64) -> Result<sighting::Sighting, &'static str> {
        match self {
            Self::Evologics(frame) => evologics::read(line, *frame, received_s),
            Self::Seatrac(frame) => seatrac::read(line, *frame, received_s),
            Self::Sentences => sentences::read(line, received_s),
            Self::Pattern(pattern) => pattern.read(line, received_s),
        }
    }
}
