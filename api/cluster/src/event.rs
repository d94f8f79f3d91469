//! Events that a worker reports.

/// An event of a worker.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum WorkerEvent {
    /// A piece of work is done: its campaign and name.
    Done(String, String),
    /// A piece of work was given up: its campaign, its name and the reason.
    Parked(String, String, String),
    /// Work for another version, which this worker may not do.
    Refused(String),
    /// The broker does not answer, or refuses; the worker keeps trying.
    Trouble(String),
}
