//! Fixed things as lines: paths, keep-out discs, area.

use nalgebra::Vector2;
use serde_json::{Value, json};

use super::messages::{Time, WORLD, point};
use crate::Scene;

/// Kinds of line.
const LINE_STRIP: u8 = 0;
const LINE_LOOP: u8 = 1;

/// Thickness of a line on the screen, pixels.
const THICKNESS_PIXELS: f64 = 2.0;

/// Red, green, blue and opacity, from 0 to 1.
const PATH: [f64; 4] = [0.2, 0.6, 1.0, 0.8];
const KEEP_OUT: [f64; 4] = [0.9, 0.2, 0.2, 1.0];
const AREA: [f64; 4] = [0.3, 0.8, 0.3, 1.0];

pub(super) fn update(scene: &Scene<'_>, time: Time) -> Value {
    let mut entities = vec![];
    for (id, path) in &scene.paths {
        entities.push(entity(&format!("{id}/path"), &line(LINE_STRIP, path, PATH), time));
    }
    for (i, disc) in scene.keep_outs.iter().enumerate() {
        let outline = line(LINE_LOOP, &disc.outline(), KEEP_OUT);
        entities.push(entity(&format!("keep-out-{}", i + 1), &outline, time));
    }
    if !scene.area.is_empty() {
        entities.push(entity("area", &line(LINE_LOOP, scene.area, AREA), time));
    }
    json!({"deletions": [], "entities": entities})
}

fn entity(id: &str, line: &Value, time: Time) -> Value {
    json!({
        "timestamp": time.json(),
        "frame_id": WORLD,
        "id": id,
        "lifetime": {"sec": 0, "nsec": 0},
        "frame_locked": false,
        "metadata": [],
        "arrows": [],
        "cubes": [],
        "spheres": [],
        "cylinders": [],
        "lines": [line],
        "triangles": [],
        "texts": [],
        "models": [],
    })
}

fn line(kind: u8, points: &[Vector2<f64>], [r, g, b, a]: [f64; 4]) -> Value {
    let points: Vec<Value> = points.iter().map(|position| point(position, 0.0)).collect();
    json!({
        "type": kind,
        "pose": {
            "position": {"x": 0.0, "y": 0.0, "z": 0.0},
            "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0},
        },
        "thickness": THICKNESS_PIXELS,
        "scale_invariant": true,
        "points": points,
        "color": {"r": r, "g": g, "b": b, "a": a},
        "colors": [],
        "indices": [],
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Source as _, sample_for_tests};

    #[test]
    fn the_scene_has_a_line_for_each_path_disc_and_area() {
        let update = update(&sample_for_tests::record().scene(), Time::of_seconds(0.0));
        let entities = update["entities"].as_array().expect("is a list");
        let ids: Vec<_> = entities.iter().map(|entity| &entity["id"]).collect();
        assert_eq!(ids, ["auv-1/path", "keep-out-1", "area"]);
        let path = &entities[0]["lines"][0];
        assert_eq!(path["points"].as_array().map(Vec::len), Some(21));
        assert_eq!(path["points"][20], json!({"x": 3.0, "y": 20.0, "z": 0.0}));
        assert_eq!(path["type"], LINE_STRIP);
        for corner in entities[1]["lines"][0]["points"].as_array().expect("is a list") {
            let (x, y) = (corner["x"].as_f64(), corner["y"].as_f64());
            let (x, y) = (x.expect("is a number"), y.expect("is a number"));
            assert!(((x - 30.0).hypot(y - 40.0) - 12.0).abs() < 1e-12);
        }
        assert_eq!(entities[2]["lines"][0]["type"], LINE_LOOP);
    }
}
