//! Telemetry: what the wires say, and what of it is doubted.

use std::collections::{BTreeMap, BTreeSet};

use planner::snapshot::Vessel;

use crate::acoustics::{CraftPose, KnownDepth, Modem, PoseHistory};
use crate::arrivals::Arrivals;
use crate::autopilot_link::{AutopilotLink, read_nmea};
use crate::follow::mission_log::{MissionLog, TARGET};
use crate::mavlink::{AutopilotEvent, Parameters};
use crate::mission_setup::Settling;
use crate::nmea::NmeaReader;
use crate::recent_positions::displaced;
use crate::vessels::Vessels;
use crate::wire::Received;
use crate::{Alarm, AuvFix, CraftState, MeasuredState, Measurement, Origin, Rejects, Source};

pub(super) const AUTOPILOT_WIRE: usize = 0;
/// Age of the battery's charge up to which it counts, s: autopilots tell it each second or two.
const BATTERY_AGE_MAX_S: f64 = 60.0;
/// Most AUVs that are followed, four times those of a mission: more names are noise.
const AUVS_KNOWN_MAX: usize = 64;
/// Standard deviation of a reported depth, m: the gauge is better, but the message is seconds old.
const DEPTH_SIGMA_M: f64 = 0.5;
/// Clocks farther apart than this shift fixes by a craft's length, s.
pub(crate) const CLOCK_ERROR_MAX_S: f64 = 0.5;
/// Greatest age of a reported position, s.
pub(super) const REPORT_AGE_MAX_S: f64 = 2.0;

#[derive(Debug, Default)]
pub(crate) struct Telemetry {
    pub(crate) parameters: Parameters,
    pub(crate) craft: CraftState,
    /// `true` if the autopilot knows its position; `None` if it does not report that.
    pub(crate) position_known: Option<bool>,
    /// Lead of the autopilot's clock over this machine's, s.
    pub(crate) clock_ahead_s: Option<f64>,
    /// All alarms of the craft's navigation so far, and those that were logged last.
    pub(crate) alarms_seen: BTreeSet<Alarm>,
    alarms: BTreeSet<Alarm>,
    /// Number of pieces from each wire: the autopilot's, those of `nmea`, then those of the modems.
    pub(crate) pieces: Vec<u64>,
    pub(crate) fixes: BTreeMap<String, Fixes>,
    pub(crate) vessels: Vessels,
    nmea: Vec<NmeaReader>,
    modems: Vec<Modem>,
    poses: PoseHistory,
    /// Roll and pitch, rad.
    tilt: [f64; 2],
    /// Time, s, and share of the craft's energy that was left then.
    battery: Option<(f64, f64)>,
    settling: Settling,
}

#[derive(Clone, Debug)]
pub(crate) struct Fixes {
    pub(crate) newest: AuvFix,
    pub(crate) arrivals: Arrivals,
    pub(crate) count: u64,
}

impl Fixes {
    fn first(newest: AuvFix, at_s: f64) -> Self {
        Self { newest, arrivals: Arrivals::first(at_s), count: 1 }
    }

    fn take(&mut self, fix: AuvFix, t_s: f64) {
        self.arrivals.push(t_s);
        (self.newest, self.count) = (fix, self.count + 1);
    }
}

impl Telemetry {
    /// Nothing yet from the autopilot's wire, `n_nmea` wires of sensors, and those of `modems`, of
    /// a craft whose transponder has the MMSI `own`.
    pub(super) fn new(n_nmea: usize, modems: Vec<Modem>, own: Option<u32>) -> Self {
        Self {
            pieces: vec![0; 1 + n_nmea + modems.len()],
            nmea: std::iter::repeat_with(NmeaReader::default).take(n_nmea).collect(),
            vessels: Vessels::new(own),
            modems,
            ..Self::default()
        }
    }

    /// The craft's state, if its autopilot knows the position.
    pub(super) fn state(&self) -> Option<MeasuredState> {
        self.craft.newest().filter(|_| self.position_known != Some(false))
    }

    /// Share of the craft's energy that is left at `now`, s, if it is known.
    pub(super) fn battery(&self, now: f64) -> Option<f64> {
        self.battery.filter(|(then, _)| now - then <= BATTERY_AGE_MAX_S).map(|(_, left)| left)
    }

    /// The other vessels near the craft at `now`, s, with their distances, m, nearest first.
    pub(crate) fn vessels_near(&self, now: f64) -> Vec<(f64, Vessel)> {
        self.state().map_or_else(Vec::new, |state| self.vessels.near(now, &state.position))
    }

    /// The craft's position at `now`, s, once positions have agreed for long enough.
    pub(super) fn settled_position(&mut self, now: f64) -> Option<Origin> {
        let state = self.craft.newest();
        let newest = state.filter(|state| now - state.t_s <= REPORT_AGE_MAX_S);
        self.settling.settled(now, newest.map(|state| state.position))
    }

    /// Rejected input of the sensors' wires, and measurements that were not used.
    pub(super) fn rejects(&self) -> impl Iterator<Item = &Rejects> {
        let sensors = self.nmea.iter().map(NmeaReader::rejects);
        let modems = self.modems.iter().map(|modem| &modem.rejects);
        std::iter::once(&self.craft.integrity.rejects).chain(sensors).chain(modems)
    }

    /// Takes `piece` of a wire; `autopilot` reads its own.
    pub(super) fn take(&mut self, piece: &Received, autopilot: &mut AutopilotLink, log: &MissionLog) {
        let t_s = log.clock.at_s(piece.at);
        let unix_s = log.clock.unix_s(t_s);
        self.pieces[piece.wire] += u64::from(!piece.bytes.is_empty());
        let n_nmea = self.nmea.len();
        match piece.wire.checked_sub(1) {
            None => {
                for event in autopilot.push(piece, t_s, unix_s) {
                    self.take_event(event, t_s, unix_s, log);
                }
            }
            Some(index) if index < n_nmea => {
                for measurement in read_nmea(&mut self.nmea[index], piece, unix_s) {
                    self.measure(piece.wire, t_s, unix_s, measurement, log);
                }
            }
            Some(index) => {
                for fix in self.modems[index - n_nmea].push(&piece.bytes, unix_s, &self.poses) {
                    self.take_fix(fix, t_s, log);
                }
            }
        }
    }

    fn take_event(&mut self, event: AutopilotEvent, t_s: f64, unix_s: f64, log: &MissionLog) {
        match event {
            AutopilotEvent::Measured(measurement) => {
                if let Measurement::Auv(fix) = &measurement {
                    self.note_depth(fix);
                }
                self.measure(AUTOPILOT_WIRE, t_s, unix_s, measurement, log);
            }
            AutopilotEvent::Parameter { name, value } => self.parameters.note(&name, value),
            AutopilotEvent::Text(text) => tracing::info!(target: TARGET, "autopilot: {text}"),
            AutopilotEvent::NoCraft { system, kind } => {
                log.info(&format!("system {system} is no surface craft but {kind}: it is left alone"));
            }
            AutopilotEvent::Acknowledged { command, is_accepted } => {
                if !is_accepted {
                    tracing::warn!(target: TARGET, command, "the autopilot rejected a command");
                }
            }
            // The link keeps heartbeats.
            AutopilotEvent::Heartbeat(_) => {}
            AutopilotEvent::PositionKnown(known) => self.position_known = Some(known),
            AutopilotEvent::Time(autopilot_s) => self.note_clock(autopilot_s - unix_s, log),
            AutopilotEvent::Attitude { roll, pitch } => self.tilt = [roll, pitch],
            AutopilotEvent::Battery(left) => self.battery = Some((t_s, left)),
        }
    }

    /// Gives an AUV's reported depth to modems that measure angles only.
    fn note_depth(&mut self, fix: &AuvFix) {
        let Some(depth_m) = fix.depth_m else { return };
        let known = KnownDepth { t_s: fix.t_s, depth_m, sigma_m: DEPTH_SIGMA_M };
        for modem in &mut self.modems {
            modem.note_depth(&fix.auv, known);
        }
    }

    /// Keeps the lead of the autopilot's clock, s; warns once of a wrong one.
    fn note_clock(&mut self, ahead_s: f64, log: &MissionLog) {
        let is_wrong = |ahead_s: f64| ahead_s.abs() > CLOCK_ERROR_MAX_S;
        if is_wrong(ahead_s) && !self.clock_ahead_s.is_some_and(is_wrong) {
            log.warn(&format!("warning: the autopilot's clock is {ahead_s:+.1} s ahead of this machine's"));
        }
        self.clock_ahead_s = Some(ahead_s);
    }

    fn measure(&mut self, wire: usize, t_s: f64, unix_s: f64, measurement: Measurement, log: &MissionLog) {
        let (measured_s, talker, measured) = match measurement {
            Measurement::Auv(fix) => return self.take_fix(fix, t_s, log),
            Measurement::Vessel(message) => return self.vessels.take(t_s, message),
            Measurement::Craft { t_s, talker, measured } => (t_s, talker, measured),
        };
        // On the bridge's clock, which is never set.
        let at_s = t_s - (unix_s - measured_s);
        self.craft.take(at_s, Source { wire, talker }, &measured);
        self.log_alarms(log);
        if let Some(state) = self.craft.newest() {
            let [roll, pitch] = self.tilt;
            // Headings come more often than positions: the pose is of the time of its heading.
            let pose_s = at_s.max(state.t_s);
            let way = state.ground_velocity.unwrap_or_default() * (pose_s - state.t_s);
            let position = displaced(&state.position, &way);
            let pose = CraftPose { position, heading: state.heading, roll, pitch };
            self.poses.push(log.clock.unix_s(pose_s), pose);
        }
    }

    fn take_fix(&mut self, fix: AuvFix, t_s: f64, log: &MissionLog) {
        if AUVS_KNOWN_MAX <= self.fixes.len() && !self.fixes.contains_key(&fix.auv) {
            return;
        }
        if let Some(mission) = &log.mission {
            mission.report_auv(&fix);
        }
        match self.fixes.get_mut(&fix.auv) {
            Some(fixes) => fixes.take(fix, t_s),
            None => drop(self.fixes.insert(fix.auv.clone(), Fixes::first(fix, t_s))),
        }
    }

    /// Logs contradictions in the craft's navigation, and their end.
    fn log_alarms(&mut self, log: &MissionLog) {
        let alarms: BTreeSet<Alarm> = self.craft.integrity.alarms().collect();
        for raised in alarms.difference(&self.alarms) {
            log.warn(&format!("warning: {raised}"));
        }
        for ended in self.alarms.difference(&alarms) {
            log.info(&format!("over: {ended}"));
        }
        self.alarms_seen.extend(&alarms);
        self.alarms = alarms;
    }
}
