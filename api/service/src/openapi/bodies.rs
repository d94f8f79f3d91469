//! An example of each body in the `OpenAPI` document. A time 0 stands for now.

use serde_json::{Map, Value, json};

use crate::examples::EXAMPLES;

/// Writes the examples into `document`.
pub(super) fn write(document: &mut Value) {
    let snapshot: Value = serde_json::from_str(EXAMPLES[0].body).expect("is a snapshot");
    let track = json!({ "kind": "track", "auv": "auv-1", "offset": { "frame": "polar", "range_m": 10, "bearing_deg": 90 } });
    let fix = json!({ "t_s": 0, "north_m": 10, "east_m": 5, "depth_m": 12, "sigma_m": 1.5 });
    let craft =
        json!({ "t_s": 0, "state": { "north_m": 0, "east_m": 0, "heading_deg": 30, "speed_mps": 0.4 } });
    for (path, method, example) in [
        ("/v1/plan", "post", snapshot.clone()),
        ("/v1/plan/compare", "post", snapshot.clone()),
        ("/v1/plan/validate", "post", snapshot.clone()),
        ("/v1/plan/batch", "post", json!({ "requests": [snapshot] })),
        (
            "/v1/missions",
            "post",
            json!({ "schema_version": "1.0", "simulated": { "scenario": "calm", "seed": 1 } }),
        ),
        ("/v1/missions/{id}", "patch", json!({ "goal": track })),
        ("/v1/missions/{id}/run", "post", json!({ "speed_factor": 10 })),
        ("/v1/missions/{id}/step", "post", json!({ "ticks": 1 })),
        (
            "/v1/missions/{id}/reports",
            "post",
            json!({ "auvs": { "auv-1": [fix] }, "asc": [craft] }),
        ),
    ] {
        let content = document["paths"][path][method]["requestBody"]["content"].as_object_mut();
        for body in content.into_iter().flat_map(Map::values_mut) {
            body["example"] = example.clone();
        }
    }
}
