//! From the AUVs' forecasts to the motion that the surface craft is to match.

use nalgebra::Vector2;

use crate::{
    forecast::{AuvForecast, Motion},
    snapshot::{Goal, Snapshot, VehicleId},
};

/// The goal's motion over time.
#[derive(Clone, Debug, PartialEq)]
pub struct GoalForecast {
    /// Forecasts of the AUVs that the goal names, in its order.
    members: Vec<AuvForecast>,
    rule: Rule,
}

#[derive(Clone, Debug, PartialEq)]
enum Rule {
    Mean,
    /// Time since the epoch at the snapshot, and the dwell time, s.
    InTurn {
        since_epoch: f64,
        dwell: f64,
    },
}

impl GoalForecast {
    /// The goal of `snapshot`, forecast as it asks.
    #[must_use]
    pub fn new(snapshot: &Snapshot) -> Self {
        let current = snapshot.current();
        let forecast = |id: &VehicleId| {
            let (auv, estimate) = snapshot
                .auv_and_estimate(id)
                .expect("a snapshot's goal names only vehicles that are in it");
            AuvForecast::new(&estimate.state, auv.into(), snapshot.forecast, &current)
        };
        match &snapshot.goal {
            Goal::Track { auv } => Self {
                members: vec![forecast(auv)],
                rule: Rule::Mean,
            },
            Goal::Midpoint { auvs } => Self {
                members: auvs.iter().map(forecast).collect(),
                rule: Rule::Mean,
            },
            Goal::Intermittent { auvs, dwell, epoch } => Self {
                members: auvs.iter().map(forecast).collect(),
                rule: Rule::InTurn {
                    since_epoch: snapshot.time - epoch,
                    dwell: *dwell,
                },
            },
        }
    }

    /// The goal's motion `ahead` seconds after the snapshot.
    ///
    /// A mean moves with the mean of the velocities; headings are never averaged. Intervals of an
    /// intermittent goal are half-open, [k T, (k+1) T), and go on backwards before the epoch.
    #[must_use]
    pub fn at(&self, ahead: f64) -> Motion {
        match self.rule {
            Rule::Mean => self.mean(ahead),
            Rule::InTurn { since_epoch, dwell } => {
                let turn = ((since_epoch + ahead) / dwell).floor();
                self.members[index_in_turn(turn, self.members.len())].at(ahead)
            }
        }
    }

    fn mean(&self, ahead: f64) -> Motion {
        #[expect(clippy::cast_precision_loss, reason = "a snapshot holds at most 16 AUVs")]
        let share = 1.0 / self.members.len() as f64;
        let still = Motion {
            position: Vector2::zeros(),
            velocity: Vector2::zeros(),
        };
        self.members
            .iter()
            .map(|member| member.at(ahead))
            .fold(still, |sum, motion| Motion {
                position: sum.position + motion.position * share,
                velocity: sum.velocity + motion.velocity * share,
            })
    }
}

/// The member whose turn it is: `turn` modulo `n`, also for negative turns.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::cast_precision_loss,
    reason = "rem_euclid by n <= 16 is an integer in 0..n"
)]
fn index_in_turn(turn: f64, n: usize) -> usize {
    (turn.rem_euclid(n as f64) as usize).min(n - 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_are_half_open_and_go_on_before_the_epoch() {
        assert_eq!(
            [-3.0, -2.0, -1.0, 0.0, 1.0, 2.0].map(|turn| index_in_turn(turn, 2)),
            [1, 0, 1, 0, 1, 0]
        );
        assert_eq!(
            [0.0, 1.0, 2.0, 3.0].map(|turn| index_in_turn(turn, 3)),
            [0, 1, 2, 0]
        );
    }
}
