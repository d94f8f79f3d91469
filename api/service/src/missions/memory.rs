//! The memory of an active live mission, beside the solver's workspaces.

use wire::{Segment, mission::Live};

pub(super) const MEMORY: &str = "bytes of live missions in memory";

/// Memory of a mission with metadata of 4 KiB and 64 vessels with plans, and of each AUV with 64
/// reports and its part of two plans, bytes; without paths, whose length only the body of a request
/// bounds.
const MISSION_BYTES: usize = 208 << 10;
const AUV_BYTES: usize = 32 << 10;

/// Memory of each craft of a fleet with its plan and its positions, bytes.
const CRAFT_BYTES: usize = 64 << 10;

/// Most bytes that a mission holds: its configuration as `created`, and as it is `now`.
pub(super) fn bytes_of(created: &Live, now: &Live) -> usize {
    let craft = now.surface_craft.len() * CRAFT_BYTES;
    MISSION_BYTES + craft + now.auvs.len() * AUV_BYTES + path_bytes(created) + path_bytes(now)
}

fn path_bytes(config: &Live) -> usize {
    let paths = config.auvs.iter().filter_map(|auv| auv.path.as_ref());
    let bytes = paths.map(|path| {
        let points = path.segments.iter().map(|segment| match segment {
            Segment::Waypoints { points, legs, .. } => bytes_in(points) + bytes_in(legs),
            Segment::Line { .. } | Segment::Arc { .. } => 0,
        });
        bytes_in(&path.segments) + points.sum::<usize>()
    });
    bytes.sum()
}

fn bytes_in<T>(list: &Vec<T>) -> usize {
    list.capacity() * size_of::<T>()
}

#[cfg(test)]
mod tests {
    use clock::Clock;
    use serde_json::{Value, json};
    use store::{AuditEntry, EventStore};
    use wire::mission::{NewMission, Setting};

    use super::*;
    use crate::{
        Settings,
        edge::{problem::Problem, quota::Quota},
        missions::{Missions, actor::Command, if_match::IfMatch},
        planning::planners::Planners,
    };

    fn new() -> NewMission {
        let live = json!({ "auvs": [{ "id": "auv-1" }], "goal": { "kind": "track", "auv": "auv-1" } });
        serde_json::from_value(json!({ "schema_version": "1.0", "live": live })).expect("is a mission")
    }

    impl Missions {
        async fn created_by(&self, caller: &str) -> String {
            let order = AuditEntry {
                caller: caller.to_owned(),
                action: "create".to_owned(),
                ..AuditEntry::default()
            };
            let created = self.create(new(), None, order).await;
            created.expect("is created").id
        }

        async fn ordered(&self, id: &str, command: Command) -> Result<(), Problem> {
            self.send(id, command, None, IfMatch::default(), None).await.map(drop)
        }
    }

    /// The change of the AUV's path to one of so many points.
    fn with_points(n: u32) -> Command {
        let points: Vec<[f64; 2]> = (0..n).map(|k| [f64::from(k), 0.0]).collect();
        let path = json!({ "segments": [{ "kind": "waypoints", "points": points }], "closed": false, "speed_mps": 0.2 });
        let setting: Value = json!({ "paths": { "auv-1": path } });
        let setting: Setting = serde_json::from_value(setting).expect("is a setting");
        Command::Change(Box::new(setting), None)
    }

    #[tokio::test(start_paused = true)]
    async fn the_missions_of_a_client_have_its_share_of_the_memory_until_they_are_over() {
        let directory = tempfile::tempdir().expect("is made");
        let clock = Clock::simulated(1.8e9);
        let store = EventStore::open(directory.path(), &clock).expect("opens");
        let settings = Settings { clock: clock.clone(), ..Settings::default() };
        let planners = Planners::new(&settings, store.metrics());
        let mut missions = Missions::resume(store, planners, None).await.expect("reads the store");
        let live = new().live.expect("is live");
        let limit = 5 * bytes_of(&live, &live) / 2;
        missions.memory = Quota::new(2 * limit);

        let mut ids = vec![];
        for caller in ["one", "one", "one", "two"] {
            ids.push(missions.created_by(caller).await);
        }
        let share = Err(Problem::Share { what: MEMORY, limit });
        for (id, expected) in ids.iter().zip([Ok(()), Ok(()), share.clone(), Ok(())]) {
            assert_eq!(missions.ordered(id, Command::Run(None)).await, expected, "{id}");
        }
        assert_eq!(missions.ordered(&ids[0], with_points(100)).await, Ok(()));
        assert_eq!(missions.ordered(&ids[0], with_points(9_000)).await, share);
        assert_eq!(missions.ordered(&ids[1], with_points(100)).await, Ok(()));

        missions.ordered(&ids[0], Command::Finish).await.expect("runs");
        clock.sleep(std::time::Duration::from_secs(10)).await;
        assert_eq!(missions.ordered(&ids[2], Command::Run(None)).await, Ok(()));
    }
}
