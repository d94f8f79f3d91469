//! Acoustic modems: the position of an AUV, from what a modem on the craft prints.
//!
//! ```text
//! bytes → Lines → a format → Observation → Georeference → AuvFix
//! ```
//!
//! A format reads one line as an observation: AUV, time, and a vector from the transducer or a
//! position on Earth. The georeference knows the mounting of the transducer. It applies the craft's
//! pose when the signal arrived (`PoseHistory`): a USBL measures from there.
//!
//! `received_s` is the arrival of the bytes, s of Unix time. A fix has the time of the signal:
//!
//! ```text
//! arrival  = received − age          age: from arrival to line, as the modem states
//! t        = arrival − travel        travel: one way, measured, or distance / sound speed
//! ```
//!
//! The latency of the wire between modem and bridge is not included: no message states it.
//!
//! Frames: transducer and craft are forward, starboard, down (FRD); Earth is north, east, down
//! (NED). If a modem prints other axes, its module states their rotation.

use std::collections::BTreeMap;

mod depth_intersection;
mod evologics;
mod georeference;
mod lines;
mod mounting;
mod observation;
mod pattern;
mod pose;
mod seatrac;
mod sentences;
mod settings;
#[cfg(test)]
mod tests;

use self::settings::{Frame, ModemKind};
pub use self::settings::{Settings, UnusableSettings};
use self::{georeference::Georeference, lines::Lines, observation::Observation, pattern::Pattern};
pub(crate) use self::{
    georeference::KnownDepth,
    pose::{CraftPose, PoseHistory},
};
use crate::{AuvFix, Parsed, Rejects};

/// Most AUVs whose newest fixes are kept, so that names on a wire do not fill the memory.
const AUVS_MAX: usize = 64;

/// One modem's wire.
#[derive(Debug)]
pub struct Modem {
    lines: Lines,
    format: Format,
    georeference: Georeference,
    newest: BTreeMap<String, AuvFix>,
    pub(crate) rejects: Rejects,
}

#[derive(Debug)]
enum Format {
    Evologics(Frame),
    Seatrac(Frame),
    Sentences,
    Pattern(Box<Pattern>),
}

impl Modem {
    /// The adapter for a modem with these settings.
    pub fn new(settings: &Settings) -> Result<Self, UnusableSettings> {
        let georeference = Georeference::new(settings)?;
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
            let says = "mounting is missing: this modem measures from its transducer";
            return Err(UnusableSettings(says.to_owned()));
        }
        Ok(Self {
            lines: Lines::default(),
            format,
            georeference,
            newest: BTreeMap::new(),
            rejects: Rejects::default(),
        })
    }

    /// The fixes that `bytes` complete, in the order of their lines. `received_s` is their arrival,
    /// s of Unix time. Calls may split lines; a line arrives with its last byte. A fix that equals
    /// the AUV's previous one, with its time, is rejected.
    pub(crate) fn push(&mut self, bytes: &[u8], received_s: f64, poses: &PoseHistory) -> Vec<AuvFix> {
        let mut fixes = Vec::new();
        for &byte in bytes {
            let Some(line) = self.lines.push(byte) else {
                continue;
            };
            let fix = line.and_then(|line| {
                let observation = self.format.read(&line, received_s)?;
                self.georeference.fix(&observation, received_s, poses)
            });
            match fix {
                Ok(fix) if self.newest.get(&fix.auv) == Some(&fix) => self.rejects.count("repeated fix"),
                Ok(fix) => {
                    if self.newest.len() < AUVS_MAX || self.newest.contains_key(&fix.auv) {
                        self.newest.insert(fix.auv.clone(), fix.clone());
                    }
                    fixes.push(fix);
                }
                Err(reason) => self.rejects.count(reason),
            }
        }
        fixes
    }

    /// Stores a depth of `auv` (its name, or `usbl-<address>`) from another source: while it is
    /// fresh, a bearing and an elevation make a fix.
    pub(crate) fn note_depth(&mut self, auv: &str, depth: KnownDepth) {
        self.georeference.note_depth(auv, depth);
    }
}

impl Format {
    fn read(&self, line: &str, received_s: f64) -> Parsed<Observation> {
        match self {
            Self::Evologics(frame) => evologics::read(line, *frame, received_s),
            Self::Seatrac(frame) => seatrac::read(line, *frame, received_s),
            Self::Sentences => sentences::read(line, received_s),
            Self::Pattern(pattern) => pattern.read(line, received_s),
        }
    }
}
