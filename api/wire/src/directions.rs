//! Converts directions in degrees to radians in the tree of a body, before a shape is read.

use std::ops::RangeInclusive;

use planner::snapshot::{ANGLE, DIRECTIONS};
use serde_json::Number;

use crate::FieldError;
use crate::json::{Json, ShapeError, token};

/// Range of directions in degrees: as many turns as in radians.
pub const DIRECTION_DEG: RangeInclusive<f64> = ANGLE.start().to_degrees()..=ANGLE.end().to_degrees();

/// Members with names of the client, or with an earlier answer, which has radians.
const LEFT_ALONE: [&str; 6] = ["metadata", "previous_plan", "weights", "costs_now", "serve_by_s", "paths"];

#[derive(Debug)]
pub(crate) struct WereInDegrees(Vec<String>);

impl WereInDegrees {
    /// Converts every direction of `body` in degrees to radians.
    pub(crate) fn put_into_radians(body: &mut Json<'_>) -> Result<Self, ShapeError> {
        put(body).map(Self)
    }

    /// The fault in the client's names; for a missing direction, with both of its names.
    pub(crate) fn as_sent(&self, ShapeError(mut error): ShapeError) -> ShapeError {
        let ends = |[_, radians]: &&[&str; 2]| error.pointer.ends_with(&token(radians));
        if let Some([degrees, radians]) = DIRECTIONS.iter().find(ends) {
            if self.0.contains(&error.pointer) {
                let parent = error.pointer.len() - radians.len();
                error.pointer.replace_range(parent.., degrees);
            } else if error.code == "missing" {
                error.detail = format!("must be given, or `{degrees}`");
            }
        }
        ShapeError(error)
    }
}

fn put(json: &mut Json<'_>) -> Result<Vec<String>, ShapeError> {
    let mut put_here = vec![];
    let mut within = |name: &str, value: &mut Json<'_>| -> Result<(), ShapeError> {
        let below = put(value).map_err(|wrong| wrong.within(name))?;
        put_here.extend(below.into_iter().map(|pointer| token(name) + &pointer));
        Ok(())
    };
    match json {
        Json::List(items) => {
            for (i, item) in items.iter_mut().enumerate() {
                within(&i.to_string(), item)?;
            }
        }
        Json::Object(members) => {
            for (name, value) in members.iter_mut() {
                if !LEFT_ALONE.contains(&name.as_ref()) {
                    within(name, value)?;
                }
            }
            for names in &DIRECTIONS {
                if put_direction(json, names)? {
                    put_here.push(token(names[1]));
                }
            }
        }
        Json::Null | Json::Bool(_) | Json::Number(_) | Json::Text(_) => {}
    }
    Ok(put_here)
}

/// Converts the member `degrees` of `object` to `radians`. `false` if it is missing or null.
fn put_direction(object: &mut Json<'_>, [degrees, radians]: &[&'static str; 2]) -> Result<bool, ShapeError> {
    let refused = |error: FieldError| Err(ShapeError(Box::new(error)));
    let wrong = |code, detail: String| refused(FieldError::new(token(degrees), code, detail));
    let direction = match object.member(degrees) {
        None => None,
        Some(_) if object.member(radians).is_some() => {
            return wrong("mixed", format!("give `{degrees}` or `{radians}`, not both"));
        }
        Some(given) => match given.number() {
            Some(number) => Some(number),
            None => return wrong("wrong_type", format!("must be a number, not {}", given.name())),
        },
    };
    let Json::Object(members) = object else {
        return Ok(false);
    };
    let Some(given) = direction else {
        members.retain(|(name, _)| name != degrees);
        return Ok(false);
    };
    if let Some(error) = FieldError::outside(token(degrees), given, &DIRECTION_DEG) {
        return refused(error);
    }
    members.retain(|(name, _)| name != degrees && name != radians);
    let number = Number::from_f64(given.to_radians()).map_or(Json::Null, Json::Number);
    members.push(((*radians).into(), number));
    Ok(true)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, TAU};

    use planner::snapshot::Offset;
    use serde_json::{Value, json};

    use super::*;
    use crate::{Body, BodyError, PlanRequest, mission::Setting, plan_id, read, read_reports, snapshot};

    fn body(asc: &Value, state: &Value, offset: &Value) -> Value {
        let mut body = json!({
            "schema_version": "1.0", "t_s": 0.0,
            "asc": { "north_m": 0.0, "east_m": 0.0, "speed_mps": 0.2 },
            "auvs": [{ "id": "a", "state": { "north_m": 1.0, "east_m": 2.0, "depth_m": 3.0, "speed_mps": 0.2 } }],
            "goal": { "kind": "track", "auv": "a", "offset": { "frame": "polar", "range_m": 5.0 } },
            "metadata": { "heading_deg": 1.0 },
        });
        for (place, more) in [("/asc", asc), ("/auvs/0/state", state), ("/goal/offset", offset)] {
            let object = body.pointer_mut(place).and_then(Value::as_object_mut);
            let more = more.as_object().cloned().expect("is an object");
            object.expect("is an object").extend(more);
        }
        body
    }

    fn read_value(body: &Value) -> Result<PlanRequest, Box<FieldError>> {
        read(body.to_string().as_bytes())
            .map_err(|(BodyError::Syntax(error) | BodyError::Shape(error))| error)
    }

    #[test]
    fn directions_in_degrees_and_radians_give_the_same_request() {
        // 45°, 360° and −90°.
        let degrees = body(
            &json!({ "heading_deg": 45 }),
            &json!({ "course_deg": 360, "course_rad": null }),
            &json!({ "bearing_deg": -90 }),
        );
        let radians = body(
            &json!({ "heading_rad": FRAC_PI_4, "heading_deg": null }),
            &json!({ "course_rad": TAU }),
            &json!({ "bearing_rad": -FRAC_PI_2 }),
        );
        let id = |body: &Value| {
            let request = read_value(body).expect("is read");
            assert_eq!(request.metadata, *body["metadata"].as_object().expect("is one"));
            plan_id(&snapshot(request).expect("can be planned for"))
        };
        assert_eq!(id(&degrees), id(&radians));
    }

    #[test]
    fn reports_and_patches_accept_degrees() {
        let fix =
            json!({ "t_s": 1, "north_m": 0, "east_m": 0, "sigma_m": 1, "course_deg": 90, "speed_mps": 0.2 });
        let state = json!({ "north_m": 0, "east_m": 0, "heading_deg": 90, "speed_mps": 0.2 });
        let body = json!({ "auvs": { "heading_deg": [fix] }, "asc": [{ "t_s": 1, "state": state }] });
        let body = body.to_string();
        let body = Body::parse(body.as_bytes()).expect("is JSON");
        let (heard, rejected) = read_reports(body, None, |_| vec![]).expect("is read");
        assert_eq!(rejected, Vec::<Vec<FieldError>>::new());
        assert_eq!(heard.auvs["heading_deg"][0].course_rad, Some(FRAC_PI_2));
        assert_eq!(heard.asc[0].state.heading_rad, FRAC_PI_2);
        let offset = json!({ "frame": "polar", "range_m": 5, "bearing_deg": 90 });
        let patch = json!({ "goal": { "kind": "track", "auv": "a", "offset": offset } });
        let setting: Setting = read(patch.to_string().as_bytes()).expect("is read");
        let bearing_rad = setting.goal.map(|task| task.offset);
        assert_eq!(bearing_rad, Some(Some(Offset::Polar { range_m: 5.0, bearing_rad: FRAC_PI_2 })));
    }

    #[test]
    fn names_of_the_client_are_no_directions() {
        let mut named = body(&json!({ "heading_deg": 0 }), &json!({ "course_deg": 0 }), &json!({}));
        named["auvs"][0]["id"] = json!("course_deg");
        named["goal"] = json!({ "kind": "weighted", "weights": { "course_deg": 1.0 } });
        assert!(snapshot(read_value(&named).expect("is read")).is_ok());
    }

    #[test]
    fn faults_have_the_names_that_the_client_sent() {
        let refused = |asc: &Value| {
            let body = body(asc, &json!({ "course_rad": 0 }), &json!({ "bearing_rad": 0 }));
            read_value(&body).expect_err("is refused")
        };
        let table = r#"
            {}                                     /asc/heading_rad  missing
            {"heading_deg":null}                   /asc/heading_rad  missing
            {"heading_deg":0,"heading_rad":0}      /asc/heading_deg  mixed
            {"heading_deg":360.1}                  /asc/heading_deg  out_of_range
            {"heading_deg":"N"}                    /asc/heading_deg  wrong_type
            {"heading_rad":0,"course_deg":0}       /asc/course_deg   unknown_field
        "#;
        for row in table.trim().lines() {
            let [asc, pointer, code] = row.split_whitespace().collect::<Vec<_>>()[..] else {
                panic!("{row}")
            };
            let asc: Value = serde_json::from_str(asc).expect("is JSON");
            let wrong = refused(&asc);
            assert_eq!((&*wrong.pointer, &*wrong.code), (pointer, code), "{asc}");
        }
        assert!(refused(&json!({})).detail.contains("`heading_deg`"));
    }
}
