//! How the question to a record, or to a rig, ended.

/// How the question to a unit, or to a file of it, ended. The table has it in column `exit_code`, as what the program would have ended
/// with on it alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Outcome {
    /// Answered.
    Answered = 0,
    /// The program failed: a panic, or an output that cannot be written.
    Failed = 1,
    /// What was asked does not apply to this file.
    NotApplicable = 2,
    /// The file cannot be used.
    Unusable = 3,
    /// The file was read, but at least one number that was asked for may not be used.
    Undetermined = 4,
}

impl Outcome {
    /// The exit code of a program that ended so.
    pub fn exit_code(self) -> u8 {
        self as u8
    }

    /// How a program ended that has this exit code; one that no other outcome has is of a failure.
    pub fn of_exit_code(exit_code: u8) -> Self {
        let others = [Self::Answered, Self::NotApplicable, Self::Unusable, Self::Undetermined];
        others.into_iter().find(|outcome| outcome.exit_code() == exit_code).unwrap_or(Self::Failed)
    }
}
