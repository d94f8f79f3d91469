//! What kept the craft from its goal when it was farthest off, in a sentence.

use sim::record::{Record, Row, SurfaceCraftRow};

use crate::campaign::report::number;

/// How long after a jump of the goal a distance is still put down to it, s: the widest gap between two lanes,
/// 140 m, takes 93 s at full speed.
const JUMP_MEMORY: f64 = 120.0;
/// A goal that moves further in a second has changed hands or stopped, m: no vehicle goes so fast.
const JUMP: f64 = 5.0;
/// How long after a silence a distance is still put down to it, s: as far as it led, 43 m, in a minute.
const SILENCE_MEMORY: f64 = 60.0;
/// An underwater vehicle that was heard longer ago than this is silent, s: two slots of ten seconds and a late one.
const SILENT: f64 = 25.0;
/// A distance that an error of this size explains, m, as a share of it.
const EXPLAINED: f64 = 0.5;
/// A speed reference this near the largest is full speed.
const FULL: f64 = 0.98;

/// When the craft was farthest from its goal, on the whole and once it had arrived, and what the record has to explain
/// that with.
pub(super) fn explanation(record: &Record) -> String {
    let farthest = |from: f64| {
        let rows = record.rows.iter().filter(|row| from <= row.time);
        let crafts = rows.filter_map(|row| Some((row, row.surface_craft.as_ref()?)));
        crafts.max_by(|a, b| a.1.distance().total_cmp(&b.1.distance()))
    };
    let words = |(row, craft): (&Row, &SurfaceCraftRow)| {
        let (distance, cause) = (number(craft.distance()), cause(record, row, craft));
        format!("{distance} m, at {:.0} s, {cause}", row.time)
    };
    let Some(whole) = farthest(0.0) else {
        return "nothing was recorded".to_owned();
    };
    let text = format!("farthest off, {}", words(whole));
    match farthest(record.settled_after) {
        Some(later) if whole.0.time < record.settled_after => {
            format!("{text}; later at most {}", words(later))
        }
        _ => text,
    }
}

/// The first of the known causes that holds at `row`.
fn cause(record: &Record, row: &Row, craft: &SurfaceCraftRow) -> String {
    let distance = craft.distance();
    if row.time == 0.0 {
        return "where it started".to_owned();
    }
    if let Some((time, jump)) = last_jump(record, row.time) {
        let since = row.time - time;
        return format!("{since:.0} s after its goal jumped by {} m", number(jump));
    }
    let recent = record
        .rows
        .iter()
        .rev()
        .filter(|before| before.time <= row.time && row.time - before.time <= SILENCE_MEMORY);
    let silent = recent.into_iter().find_map(|before| {
        let mut auvs = before.auvs.iter().zip(&record.auv_ids);
        auvs.find_map(|(auv, id)| {
            let age = auv.known?.age;
            let words = match row.time - before.time {
                0.0 => String::new(),
                since => format!(" until {since:.0} s before"),
            };
            (SILENT < age).then(|| format!("{id} not heard for {age:.0} s{words}"))
        })
    });
    if let Some(silent) = silent {
        return silent;
    }
    let own_error = (craft.known.position - craft.position).norm();
    if EXPLAINED * distance < own_error {
        return format!(
            "its own position estimated {} m from where it was",
            number(own_error)
        );
    }
    if row.time < record.settled_after {
        return "on its way from the start".to_owned();
    }
    let full = record
        .limits
        .as_ref()
        .is_some_and(|limits| FULL * limits.speed_max <= craft.reference.speed);
    if full {
        return "behind at full speed".to_owned();
    }
    "with nothing in the record that explains it alone".to_owned()
}

/// When and how far the goal jumped last, at most so long before `now`.
fn last_jump(record: &Record, now: f64) -> Option<(f64, f64)> {
    let pairs = record.rows.windows(2).filter_map(|pair| {
        let [before, after] =
            [&pair[0], &pair[1]].map(|row| row.surface_craft.as_ref().map(|craft| craft.goal));
        Some((pair[1].time, (after? - before?).norm()))
    });
    let mut recent = pairs.filter(|(time, jump)| JUMP < *jump && *time <= now && now - time <= JUMP_MEMORY);
    recent.next_back()
}

#[cfg(test)]
mod tests {
    use planner::policy::Policy;
    use sim::{guide::MpcGuide, mission::run, scenario::Scenario};

    use super::*;

    fn record(name: &str, duration: f64) -> Record {
        let scenario = Scenario::named(name).expect("exists").lasting(duration);
        run(&scenario, &mut MpcGuide::new(Policy::default()), 1, &mut |_| {}).expect("runs")
    }

    #[test]
    fn what_explains_a_distance_is_named() {
        let mut record = record("switching", 30.0);
        assert!(
            explanation(&record).ends_with("at 0 s, where it started"),
            "{}",
            explanation(&record)
        );
        for row in &mut record.rows[20..] {
            row.surface_craft.as_mut().expect("has one").goal.x += 500.0;
        }
        let jumped = explanation(&record);
        assert!(jumped.contains("s after its goal jumped by "), "{jumped}");
        for row in &mut record.rows {
            let craft = row.surface_craft.as_mut().expect("has one");
            craft.goal = craft.position;
            craft.goal.x += row.time;
            for auv in &mut row.auvs {
                auv.known.as_mut().expect("is known").age = 40.0;
            }
        }
        assert!(
            explanation(&record).ends_with("auv-1 not heard for 40 s"),
            "{}",
            explanation(&record)
        );
        let last = record.rows.last_mut().expect("has rows");
        for auv in &mut last.auvs {
            auv.known.as_mut().expect("is known").age = 0.0;
        }
        let heard_again = explanation(&record);
        assert!(
            heard_again.ends_with("auv-1 not heard for 40 s until 1 s before"),
            "{heard_again}"
        );
    }

    #[test]
    fn a_start_far_off_does_not_hide_what_came_later() {
        let mut record = record("paper-tracking", 60.0);
        record.settled_after = 40.0;
        let text = explanation(&record);
        let (start, later) = text.split_once("; later at most ").expect("tells both");
        assert!(start.ends_with("where it started"), "{text}");
        // The craft has all but arrived.
        let distance: f64 = later
            .split(' ')
            .next()
            .expect("a number")
            .parse()
            .expect("a number");
        assert!(distance < 3.0, "{text}");
    }
}
