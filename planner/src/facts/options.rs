//! What a client chooses: how to forecast, and what to do without a solved program.

/// How an AUV's future is guessed from its state.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ForecastModel {
    /// It stays where it is.
    Hold,
    /// It keeps its ground velocity, and its drift.
    ConstantVelocity,
    /// It keeps its speed and its rate of turn, and its drift.
    ConstantTurn,
    /// It follows its path, at its speed through the water, with the offset that it has, which its drift changes for
    /// half a minute.
    Path,
}

impl ForecastModel {
    /// Its name wherever it leaves the program.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Hold => "hold",
            Self::ConstantVelocity => "constant_velocity",
            Self::ConstantTurn => "constant_turn",
            Self::Path => "path",
        }
    }
}

/// Which forecast the client asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ForecastChoice {
    /// The planner chooses for each AUV: [`ForecastModel::Hold`] for one at rest; else along its path, where that
    /// is known and no more than 15 m away; else as its rate of turn says.
    Auto,
    /// The same model for every AUV; [`ForecastModel::Path`] for those whose path is known, while the planner
    /// chooses for the others.
    Model(ForecastModel),
}

/// What to do when no program was solved, and for a goal that rests on a report too old to be forecast. Where one was
/// solved, the fallback level of least predicted cost answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fallback {
    /// The better of the previous plan followed further and line of sight answers; hold, where the report is too old.
    Los,
    /// Nothing but a solved program will do.
    None,
}

/// What the last fallback level does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HoldStyle {
    /// Circle slowly to starboard at the least speed that steers.
    SlowTurn,
    /// Stop the thrusters: speed reference 0 on the present heading.
    Stop,
}
