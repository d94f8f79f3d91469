//! DUNE's mode and manoeuvre, by its `VehicleState`.

/// DUNE's mode of operation and manoeuvre.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct DuneMode {
    pub(crate) operation: u8,
    pub(crate) maneuver: u16,
    /// `true` if it follows this bridge's references.
    pub(crate) is_ours: bool,
}

/// Modes of operation. Source: IMC, `VehicleState.op_mode`.
pub(super) const SERVICE: u8 = 0;
pub(super) const MANEUVER: u8 = 3;
const EXTERNAL: u8 = 4;
const NAMES: [&str; 6] = ["SERVICE", "CALIBRATION", "ERROR", "MANEUVER", "EXTERNAL", "BOOT"];
/// Number of the manoeuvre FollowReference.
pub(super) const FOLLOW_REFERENCE: u16 = 478;
const OURS: u32 = 1 << 24;

impl DuneMode {
    /// The mode in which this bridge steers by places.
    pub(crate) const FOLLOWING: Self =
        Self { operation: MANEUVER, maneuver: FOLLOW_REFERENCE, is_ours: true };

    pub(crate) fn is_service(self) -> bool {
        self.operation == SERVICE
    }

    pub(crate) fn is_external(self) -> bool {
        self.operation == EXTERNAL
    }

    pub(crate) fn follows_references(self) -> bool {
        self.operation == MANEUVER && self.maneuver == FOLLOW_REFERENCE
    }

    pub(crate) fn name(self) -> String {
        let operation = NAMES.get(usize::from(self.operation)).copied();
        match (self.follows_references(), self.is_ours) {
            (true, true) => "FollowReference".to_owned(),
            (true, false) => "FollowReference of another system".to_owned(),
            _ if self.operation == MANEUVER => format!("manoeuvre {}", self.maneuver),
            _ => operation.map_or_else(|| format!("mode {}", self.operation), str::to_owned),
        }
    }
}

impl From<DuneMode> for u32 {
    fn from(mode: DuneMode) -> Self {
        let ours = if mode.is_ours { OURS } else { 0 };
        ours | Self::from(mode.maneuver) << 8 | Self::from(mode.operation)
    }
}

impl From<u32> for DuneMode {
    fn from(mode: u32) -> Self {
        let [ours, maneuver @ .., operation] = mode.to_be_bytes();
        Self { operation, maneuver: u16::from_be_bytes(maneuver), is_ours: ours != 0 }
    }
}
