//! Faults and their times.

use std::{collections::BTreeMap, fmt};

use rand::{Rng, RngExt as _};

/// A kind of fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// Bytes between boat and bridge are lost, late, doubled, in another order, cut or changed.
    BadWire,
    /// Nothing comes from the boat, and nothing comes to it.
    WireCut,
    /// The autopilot sends no heartbeats.
    NoHeartbeat,
    /// The autopilot no longer knows its position.
    PositionUnknown,
    /// A person takes the craft out of its guided mode.
    TakenOver,
    /// A person disarms the craft.
    Disarmed,
    /// The position is that of another receiver each second time.
    TwoReceivers,
    /// The heading is that of another compass each second time.
    TwoCompasses,
    /// The position does not change.
    PositionFrozen,
    /// The position is elsewhere, and stays so.
    PositionJumped,
    /// Requests and answers are lost, late, doubled or cut.
    BadNetwork,
    /// No request arrives.
    NetworkCut,
    /// The service is killed, and started again at the end.
    ServiceKilled,
    /// The same, in the middle of a write.
    PowerLostAshore,
    /// Planner, store and everything else that blocks waits for threads.
    SlowThreads,
    /// The planner's references are far beyond every limit, and its plans valid for ever.
    LyingPlanner,
    /// The directory of the store is moved away.
    DirectoryAway,
    /// The disk is full.
    DiskFull,
    /// The bridge is killed, and started again at the end.
    BridgeKilled,
    /// The clock of the service's machine is set, and set back at the end.
    ClockSetAshore,
    /// The clock of the boat's computer is set, and set back at the end.
    ClockSetAboard,
    /// The AUV is not heard.
    AuvSilent,
    /// A service is asked to stop, and started again at the end.
    ServiceStopped,
    /// A service reaches the database no more.
    ServiceCutOff,
    /// A service cannot renew its lease, and can do everything else.
    LeaseNotRenewed,
    /// No service reaches the database.
    DatabaseDown,
    /// The database has no room.
    DatabaseFull,
    /// Connections to the database are gone before a statement.
    ConnectionsLost,
    /// Statements are carried out, and their answers lost, those of commits too.
    DatabaseAnswersLost,
    /// Services reach each other no more.
    ServicesApart,
    /// The rudder is stuck. It is not drawn: the craft's course shows the consequence.
    RudderStuck,
}

/// A kind, its shortest and longest duration, s, and its smallest and largest size.
type Drawn = (Kind, [f64; 2], [f64; 2]);

const KINDS: [Drawn; 22] = [
    (Kind::BadWire, [5.0, 40.0], [0.0; 2]),
    (Kind::WireCut, [1.0, 15.0], [0.0; 2]),
    (Kind::NoHeartbeat, [6.0, 15.0], [0.0; 2]),
    (Kind::PositionUnknown, [6.0, 15.0], [0.0; 2]),
    (Kind::TakenOver, [3.0, 20.0], [0.0; 2]),
    (Kind::Disarmed, [3.0, 20.0], [0.0; 2]),
    (Kind::TwoReceivers, [15.0, 30.0], [0.0; 2]),
    (Kind::TwoCompasses, [15.0, 30.0], [0.0; 2]),
    (Kind::PositionFrozen, [45.0, 60.0], [0.0; 2]),
    (Kind::PositionJumped, [20.0, 30.0], [0.0; 2]),
    (Kind::BadNetwork, [5.0, 40.0], [0.0; 2]),
    (Kind::NetworkCut, [10.0, 30.0], [0.0; 2]),
    (Kind::ServiceKilled, [0.5, 25.0], [0.0; 2]),
    (Kind::PowerLostAshore, [0.5, 25.0], [0.0; 2]),
    (Kind::SlowThreads, [5.0, 30.0], [0.01, 1.5]),
    (Kind::LyingPlanner, [5.0, 30.0], [0.0; 2]),
    (Kind::DirectoryAway, [2.0, 20.0], [0.0; 2]),
    (Kind::DiskFull, [5.0, 20.0], [0.0; 2]),
    (Kind::BridgeKilled, [0.5, 20.0], [0.0; 2]),
    (Kind::ClockSetAshore, [5.0, 30.0], [-7_200.0, 7_200.0]),
    (Kind::ClockSetAboard, [5.0, 30.0], [-7_200.0, 7_200.0]),
    (Kind::AuvSilent, [10.0, 60.0], [0.0; 2]),
];

/// Faults of services that share a database, instead of [`NOT_SHARED`].
const SHARED: [Drawn; 11] = [
    (Kind::ServiceKilled, [0.5, 25.0], [0.0; 2]),
    (Kind::ServiceKilled, [0.5, 25.0], [0.0; 2]),
    (Kind::ServiceStopped, [0.5, 25.0], [0.0; 2]),
    (Kind::ServiceCutOff, [0.5, 25.0], [0.0; 2]),
    (Kind::ServiceCutOff, [0.5, 25.0], [0.0; 2]),
    (Kind::LeaseNotRenewed, [0.5, 10.0], [0.0; 2]),
    (Kind::DatabaseDown, [0.5, 15.0], [0.0; 2]),
    (Kind::DatabaseFull, [5.0, 20.0], [0.0; 2]),
    (Kind::ConnectionsLost, [5.0, 20.0], [2.0, 40.0]),
    (Kind::DatabaseAnswersLost, [5.0, 20.0], [2.0, 40.0]),
    (Kind::ServicesApart, [5.0, 30.0], [0.0; 2]),
];
/// Faults of a service with a disk of its own.
const NOT_SHARED: [Kind; 4] =
    [Kind::ServiceKilled, Kind::PowerLostAshore, Kind::DirectoryAway, Kind::DiskFull];

/// Time before the first fault, s: everything is under way.
const FIRST_S: f64 = 40.0;
/// Time between two faults, s. The longest shows that everything works again.
const PAUSE_S: [f64; 2] = [8.0, 45.0];
/// Share of faults that begin before the previous one has ended.
const OVERLAPS: f64 = 0.2;

/// A fault of a voyage.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Fault {
    pub(super) kind: Kind,
    pub(super) begins_s: f64,
    pub(super) ends_s: f64,
    pub(super) size: f64,
    /// The service that it strikes.
    pub(super) service: usize,
    /// `true` if no other fault is active during it or shortly before.
    pub(super) is_alone: bool,
}

/// The faults of a voyage, by their begin.
pub(super) fn schedule(rng: &mut impl Rng, duration_s: f64, n_services: usize) -> Vec<Fault> {
    let mut faults: Vec<Fault> = vec![];
    let mut kinds = KINDS.to_vec();
    if 1 < n_services {
        kinds.retain(|(kind, ..)| !NOT_SHARED.contains(kind));
        // The others are drawn in every voyage.
        kinds.extend([SHARED; 3].concat());
    }
    let mut free_s = FIRST_S;
    loop {
        let (kind, span, size) = kinds[rng.random_range(0..kinds.len())];
        let overlaps = !faults.is_empty() && rng.random_bool(OVERLAPS);
        let begins_s = if overlaps {
            free_s - rng.random_range(0.0..PAUSE_S[0])
        } else {
            free_s + rng.random_range(PAUSE_S[0]..PAUSE_S[1])
        };
        let ends_s = begins_s + rng.random_range(span[0]..span[1]);
        let size = rng.random_range(size[0]..=size[1]);
        let service = if 1 < n_services { rng.random_range(0..n_services) } else { 0 };
        if duration_s <= ends_s {
            return faults;
        }
        let is_same = |fault: &Fault| {
            fault.kind.process(fault.service) == kind.process(service) && begins_s <= fault.ends_s
        };
        if faults.iter().any(is_same) {
            continue;
        }
        free_s = free_s.max(ends_s);
        faults.push(Fault { kind, begins_s, ends_s, size, service, is_alone: true });
        faults.sort_by(|a, b| a.begins_s.total_cmp(&b.begins_s));
        for k in 1..faults.len() {
            if faults[k].begins_s < faults[k - 1].ends_s + PAUSE_S[0] {
                faults[k].is_alone = false;
                faults[k - 1].is_alone &= faults[k - 1].ends_s <= faults[k].begins_s;
            }
        }
    }
}

impl Kind {
    /// Faults that every display must show, in the order of a table: craft taken over; autopilot,
    /// bridge and service dead; position frozen; rudder stuck; no AUV heard.
    pub const SHOWN: [Self; 7] = [
        Self::TakenOver,
        Self::WireCut,
        Self::BridgeKilled,
        Self::ServiceKilled,
        Self::PositionFrozen,
        Self::RudderStuck,
        Self::AuvSilent,
    ];

    /// Longest doubt of a bridge about position or heading after the fault, s: a position that did
    /// not move is trusted again after 60 s without further evidence.
    pub(super) fn doubted_s(self) -> f64 {
        match self {
            Self::TwoReceivers | Self::TwoCompasses | Self::PositionFrozen | Self::PositionJumped => 62.0,
            _ => 0.0,
        }
    }

    /// `true` if the other of two services can do everything.
    pub(super) fn leaves_another(self) -> bool {
        matches!(
            self,
            Self::ServiceKilled | Self::ServiceStopped | Self::ServiceCutOff | Self::LeaseNotRenewed
        )
    }

    /// A number that faults share which are not active at the same time.
    fn process(self, service: usize) -> usize {
        match self {
            Self::ServiceKilled
            | Self::ServiceStopped
            | Self::PowerLostAshore
            | Self::DirectoryAway
            | Self::DiskFull => service,
            Self::DatabaseFull
            | Self::ServiceCutOff
            | Self::LeaseNotRenewed
            | Self::DatabaseDown
            | Self::ConnectionsLost
            | Self::DatabaseAnswersLost => 2,
            Self::TakenOver | Self::Disarmed => 3,
            Self::TwoReceivers | Self::PositionFrozen | Self::PositionJumped => 4,
            other => 10 + other as usize,
        }
    }
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = format!("{self:?}");
        for (place, letter) in name.char_indices() {
            if letter.is_uppercase() && 0 < place {
                f.write_str(" ")?;
            }
            write!(f, "{}", letter.to_lowercase())?;
        }
        Ok(())
    }
}

/// The active faults with their begins, and the end of the last one.
#[derive(Debug, Default)]
pub(super) struct Now {
    active: BTreeMap<Kind, f64>,
    pub(super) quiet_since_s: f64,
    /// `true` while the operator pauses the mission.
    pub(super) is_paused: bool,
    /// Begin and end of the operator's pauses, s.
    pub(super) pauses: Vec<[f64; 2]>,
}

impl Now {
    pub(super) fn change(&mut self, kind: Kind, begins: bool, t_s: f64) {
        if begins {
            self.active.insert(kind, t_s);
        } else {
            self.active.remove(&kind);
        }
        let doubted_s = if begins { 0.0 } else { kind.doubted_s() };
        self.quiet_since_s = self.quiet_since_s.max(t_s + doubted_s);
    }

    pub(super) fn has(&self, kind: Kind) -> bool {
        self.active.contains_key(&kind)
    }

    /// Begin of the fault, s, if it is active.
    pub(super) fn since_s(&self, kind: Kind) -> Option<f64> {
        self.active.get(&kind).copied()
    }

    /// `true` without an active fault.
    pub(super) fn is_quiet(&self) -> bool {
        self.active.is_empty()
    }

    /// Time without an active fault, s.
    pub(super) fn quiet_s(&self, t_s: f64) -> f64 {
        let quiet_s = t_s - self.quiet_since_s;
        if self.is_quiet() { quiet_s } else { 0.0 }
    }
}
