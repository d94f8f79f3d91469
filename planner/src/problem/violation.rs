//! A soft limit that a plan does not keep.

/// A soft limit that a plan does not keep.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Violation {
    /// Which.
    pub limit: SoftLimit,
    /// What breaks it worst; `None` for the limits of motion and for the area, of which there is one.
    pub about: Option<Subject>,
    /// Time of the worst, s on the snapshot's clock.
    pub time: f64,
    /// By how much at worst, in the limit's own unit (m; m/s; m/s² for the turn rate's row).
    pub amount: f64,
}

/// What in a snapshot a limit is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Subject {
    /// A disc to keep out of, by its place in [`keep_outs`](crate::snapshot::PlanRequest::keep_outs).
    KeepOut(usize),
    /// An AUV, by its place in [`auvs`](crate::snapshot::PlanRequest::auvs).
    Auv(usize),
}

/// Limits that may be broken at a price.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SoftLimit {
    /// Least forward speed, m/s.
    ForwardSpeed,
    /// Turn rate, as lateral acceleration beyond speed × rate, m/s².
    TurnRate,
    /// Acoustic range, less depth and back-off, m.
    AcousticRange,
    /// Area to stay in, m.
    Area,
    /// Disc to keep out of, m.
    KeepOut,
    /// Distance to keep from an AUV at the surface, m; its price is a disc's.
    SurfacingSeparation,
}
