//! DUNE's mode and manoeuvre.

use super::codec::VehicleState;
use crate::mavlink::Mode;

/// Modes of operation. Source: IMC, `VehicleState.op_mode`.
pub(super) const SERVICE: u8 = 0;
pub(super) const MANEUVER: u8 = 3;
pub(super) const EXTERNAL: u8 = 4;
const NAMES: [&str; 6] = ["SERVICE", "CALIBRATION", "ERROR", "MANEUVER", "EXTERNAL", "BOOT"];
/// Number of the manoeuvre FollowReference.
pub(super) const FOLLOW_REFERENCE: u16 = 478;

pub(super) fn follows_references(state: &VehicleState) -> bool {
    state.op_mode == MANEUVER && state.maneuver_type == FOLLOW_REFERENCE
}

/// The mode of `state`, in which DUNE may follow this bridge's references (`is_guided`).
pub(super) fn mode(state: &VehicleState, is_guided: bool) -> Mode {
    let (name, number) = match (follows_references(state), NAMES.get(usize::from(state.op_mode))) {
        (true, _) if is_guided => ("FollowReference", None),
        (true, _) => ("FollowReference of another system", None),
        (false, _) if state.op_mode == MANEUVER => ("manoeuvre", Some(state.maneuver_type.into())),
        (false, Some(name)) => (*name, None),
        (false, None) => ("mode", Some(state.op_mode.into())),
    };
    Mode { name, number, is_guided }
}
