//! Which underwater vehicles do not hold their paths: what is compared above them says little of controllers.

use sim::record::{AuvRow, Record};

/// A vehicle whose error is larger than this, and grows by as much, leaves its path, m: across a current that it can hold
/// the law stands off by as much, and no more.
const OFF_THE_PATH: f64 = 1.0;
/// The part of the mission, at its end, in which a vehicle has to come back.
const LAST: f64 = 1.0 / 3.0;

/// A sentence for each underwater vehicle that does not hold its path.
///
/// ```text
/// swept      0 < ‖v_c‖ and u cos θ ≤ ‖v_c‖ in more than half of the rows in which it is to move
/// off        |y₁| > 1 m throughout the last third, and at its end 1 m more than at its beginning
/// ```
pub(super) fn notes(record: &Record) -> Vec<String> {
    let note = |(i, id): (usize, &String)| {
        let rows: Vec<&AuvRow> = record.rows.iter().filter_map(|row| row.auvs.get(i)).collect();
        let why = swept(&rows).or_else(|| off(&rows))?;
        Some(format!("{id} does not hold its path: {why}."))
    };
    record.auv_ids.iter().enumerate().filter_map(note).collect()
}

fn swept(rows: &[&AuvRow]) -> Option<String> {
    let moving = || rows.iter().filter(|row| 0.0 < row.reference.surge);
    let speed = |row: &AuvRow| row.surge * row.pitch.cos();
    let slower = moving().filter(|row| 0.0 < row.current.norm() && speed(row) <= row.current.norm());
    let (count, slower) = (moving().count(), slower.count());
    if 2 * slower <= count {
        return None;
    }
    #[expect(clippy::cast_precision_loss, reason = "thousands of rows")]
    let mean = |of: fn(&AuvRow) -> f64| moving().map(|row| of(row)).sum::<f64>() / count as f64;
    Some(format!(
        "the current of {:.2} m/s is as fast as it is, {:.2} m/s through the water",
        mean(|row| row.current.norm()),
        mean(|row| row.surge * row.pitch.cos()),
    ))
}

fn off(rows: &[&AuvRow]) -> Option<String> {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        clippy::cast_precision_loss,
        reason = "a share of thousands of rows"
    )]
    let first = (rows.len() as f64 * (1.0 - LAST)) as usize;
    let errors: Vec<f64> = rows[first..].iter().map(|row| row.cross_track.abs()).collect();
    let (begin, end) = (errors.first()?, errors.last()?);
    let least = errors.iter().copied().fold(f64::INFINITY, f64::min);
    (OFF_THE_PATH < least && begin + OFF_THE_PATH <= *end).then(|| {
        format!("it ends {end:.1} m off, and in the last third of the mission never comes nearer than {least:.1} m")
    })
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector2;
    use planner::policy::Policy;
    use sim::{guide::LosGuide, mission, scenario::Scenario};

    use super::*;

    fn record() -> Record {
        let scenario = Scenario::named("cross-current").expect("exists").lasting(60.0);
        let mut guide = LosGuide::new(Policy::default().los);
        mission::run(&scenario, &mut guide, 1, &mut |_| {}).expect("runs")
    }

    fn changed(change: impl Fn(f64, &mut AuvRow)) -> Vec<String> {
        let mut record = record();
        for row in &mut record.rows {
            for auv in &mut row.auvs {
                change(row.time, auv);
            }
        }
        notes(&record)
    }

    #[test]
    fn a_vehicle_that_is_faster_than_the_current_and_on_its_path_gets_no_note() {
        assert_eq!(notes(&record()), Vec::<String>::new());
    }

    #[test]
    fn a_current_as_fast_as_the_vehicle_is_named_unless_it_is_to_rest() {
        let strong = |auv: &mut AuvRow| auv.current = Vector2::new(0.0, -0.5);
        let found = changed(|_, auv| strong(auv));
        assert_eq!(found.len(), 1);
        assert!(
            found[0].starts_with("auv-1 does not hold its path: the current of 0.50 m/s"),
            "{found:?}"
        );
        let resting = changed(|_, auv| {
            strong(auv);
            auv.reference.surge = 0.0;
        });
        assert!(resting.is_empty(), "{resting:?}");
    }

    #[test]
    fn an_error_that_grows_is_named_and_one_that_comes_back_is_not() {
        let lost = changed(|time, auv| auv.cross_track = -0.1 * time);
        assert!(lost[0].contains("m off"), "{lost:?}");
        let late = changed(|time, auv| auv.cross_track = 8.0 - 0.1 * time);
        let returned = changed(|time, auv| auv.cross_track = 5.0 * (0.2 * time).sin());
        assert!(late.is_empty() && returned.is_empty(), "{late:?} {returned:?}");
    }
}
