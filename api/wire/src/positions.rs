//! Converts positions in latitude and longitude to metres in the tree of a body, before it is read.
//!
//! An object with `lat_deg` and `lon_deg` is a position on Earth. It gets `north_m` and `east_m`
//! from the datum at `origin`; a point of an area or a path becomes [north, east].

use geodesy::Datum;
use nalgebra::Vector2;
use planner::snapshot::{COORDINATE_MAX, Origin};
use serde::Deserialize;
use serde_json::Number;

use crate::FieldError;
use crate::json::{Json, Node, ShapeError};

/// Members without positions of the body's own: the origin itself, the client's data, and an
/// earlier answer, which has metres.
const LEFT_ALONE: [&str; 3] = ["origin", "metadata", "previous_plan"];

/// Members that are points, or lists of points.
const POINTS: [&str; 7] = ["area", "polygon", "holes", "from", "to", "centre", "points"];

/// Members of a position.
const METRES: [&str; 2] = ["north_m", "east_m"];
const DEGREES: [&str; 2] = ["lat_deg", "lon_deg"];

/// Largest distance between equal positions, m.
const SAME_M: f64 = 1e-3;

/// Latitude of a pole, degrees.
pub const LATITUDE_MAX_DEG: f64 = 90.0;

/// Largest longitude, degrees: 359.9 and −0.1 are the same meridian.
pub const LONGITUDE_MAX_DEG: f64 = 360.0;

/// Converts positions to metres from one datum.
#[derive(Clone, Debug)]
pub(crate) struct Positions {
    datum: Option<Datum>,
    pub(crate) origin: Option<Origin>,
    /// `true` if the first position may become a missing origin.
    may_begin: bool,
}

impl Positions {
    /// Uses the origin in `body`, or else `otherwise`.
    pub(crate) fn of(body: &Json<'_>, otherwise: Option<Origin>) -> Result<Self, ShapeError> {
        match (body.member("origin"), body.member("live")) {
            (Some(origin), _) => Origin::deserialize(Node::whole(origin))
                .and_then(|origin| Self::from(Some(origin), false))
                .map_err(|wrong| wrong.within("origin")),
            (None, Some(live)) => Self::of(live, otherwise).map_err(|wrong| wrong.within("live")),
            (None, None) => Self::from(otherwise, false),
        }
    }

    /// Uses `origin`; if there is none and it `may_begin`, the first position.
    pub(crate) fn from(origin: Option<Origin>, may_begin: bool) -> Result<Self, ShapeError> {
        let datum = origin.map(|origin| datum(&origin)).transpose()?;
        Ok(Self { datum, origin, may_begin })
    }

    pub(crate) fn put_into_metres(&mut self, body: &mut Json<'_>) -> Result<(), ShapeError> {
        self.put(body, false)
    }

    /// As [`Self::put_into_metres`]; `json` itself may be a point.
    fn put(&mut self, json: &mut Json<'_>, is_point: bool) -> Result<(), ShapeError> {
        match json {
            Json::List(items) => {
                for (i, item) in items.iter_mut().enumerate() {
                    self.put(item, is_point).map_err(|wrong| wrong.within(&i.to_string()))?;
                }
            }
            Json::Object(members) => {
                for (name, value) in members.iter_mut() {
                    if !LEFT_ALONE.contains(&name.as_ref()) {
                        self.put(value, POINTS.contains(&name.as_ref()))
                            .map_err(|wrong| wrong.within(name))?;
                    }
                }
                let Some(metres) = self.metres(json)? else {
                    return Ok(());
                };
                let [north, east] = metres.map(|m| Number::from_f64(m).map_or(Json::Null, Json::Number));
                match json {
                    Json::Object(members) if !is_point => {
                        members.retain(|(name, _)| !METRES.contains(&name.as_ref()));
                        members.extend([(METRES[0].into(), north), (METRES[1].into(), east)]);
                    }
                    point => *point = Json::List(vec![north, east]),
                }
            }
            Json::Null | Json::Bool(_) | Json::Number(_) | Json::Text(_) => {}
        }
        Ok(())
    }

    /// North and east of an object's position on Earth, m.
    fn metres(&mut self, object: &Json<'_>) -> Result<Option<[f64; 2]>, ShapeError> {
        let numbers = |names: [&str; 2]| names.map(|name| object.member(name).and_then(Json::number));
        let place = match numbers(DEGREES) {
            [None, None] => return Ok(None),
            [Some(lat_deg), Some(lon_deg)] => Origin { lat_deg, lon_deg },
            given => {
                let missing = DEGREES[usize::from(given[0].is_some())];
                if let Some(other) = object.member(missing) {
                    let detail = format!("must be a number, not {}", other.name());
                    return Err(ShapeError::new(format!("/{missing}"), "wrong_type", detail));
                }
                let detail = "give both latitude and longitude";
                return Err(ShapeError::new(format!("/{missing}"), "missing", detail));
            }
        };
        let refused = |code: &str, detail: &str| ShapeError::new("/lat_deg".to_owned(), code, detail);
        check(&place)?;
        if self.datum.is_none() && self.may_begin {
            (self.datum, self.origin) = (Some(datum(&place)?), Some(place));
        }
        let Some(datum) = &self.datum else {
            let detail = "positions in latitude and longitude need an `origin`";
            return Err(refused("no_origin", detail));
        };
        let local =
            datum.to_local(&place.into()).map_err(|error| refused("out_of_range", &error.to_string()))?;
        if COORDINATE_MAX < local.amax() {
            let detail = format!(
                "this position is {:.0} km from the origin, and at most {:.0} km north and east are accepted: are latitude \
                 and longitude exchanged here, or in the origin?",
                1e-3 * local.norm(),
                1e-3 * COORDINATE_MAX
            );
            let wrong = FieldError::new("/lat_deg", "out_of_range", detail).given(place.lat_deg);
            return Err(ShapeError(Box::new(wrong)));
        }
        // The service's own texts have both.
        let differs =
            |(given, metres): (Option<f64>, f64)| given.is_some_and(|m| SAME_M < (m - metres).abs());
        if numbers(METRES).into_iter().zip([local.x, local.y]).any(differs) {
            let detail = "lat_deg, lon_deg and north_m, east_m are different positions: send one pair only";
            return Err(refused("mixed", detail));
        }
        Ok(Some([local.x, local.y]))
    }
}

/// Converts positions in metres from one datum to another.
#[derive(Clone, Copy, Debug)]
pub struct DatumChange {
    from: Datum,
    to: Datum,
}

impl DatumChange {
    /// None if a datum is no place on Earth.
    pub fn new(from: Origin, to: Origin) -> Option<Self> {
        let from = Datum::new(&from.into()).ok()?;
        let to = Datum::new(&to.into()).ok()?;
        Some(Self { from, to })
    }

    /// A position (north, east), m, from the other datum.
    pub fn moved(&self, position: &Vector2<f64>) -> Vector2<f64> {
        let place = self.from.from_local(position);
        self.to.to_local(&place).unwrap_or(*position)
    }

    /// Converts a position, m, to the other datum.
    pub fn position(&self, north: &mut f64, east: &mut f64) {
        let moved = self.moved(&Vector2::new(*north, *east));
        (*north, *east) = (moved.x, moved.y);
    }

    /// Converts a point (north, east), m, to the other datum.
    pub fn point(&self, [north, east]: &mut [f64; 2]) {
        self.position(north, east);
    }
}

/// Fails if `place` is no place on Earth.
fn check(place: &Origin) -> Result<(), ShapeError> {
    let outside = |name: &str, given: f64, most: f64| FieldError::outside(name, given, &(-most..=most));
    let outside = outside("/lat_deg", place.lat_deg, LATITUDE_MAX_DEG)
        .or_else(|| outside("/lon_deg", place.lon_deg, LONGITUDE_MAX_DEG));
    outside.map_or(Ok(()), |wrong| Err(ShapeError(Box::new(wrong))))
}

pub(crate) fn wrong_place(place: &Origin, pointer: &str) -> Option<FieldError> {
    check(place).err().map(|ShapeError(mut wrong)| {
        wrong.pointer.insert_str(0, pointer);
        *wrong
    })
}

fn datum(origin: &Origin) -> Result<Datum, ShapeError> {
    check(origin)?;
    Datum::new(&(*origin).into())
        .map_err(|error| ShapeError::new("/lat_deg".to_owned(), "out_of_range", error.to_string()))
}

#[cfg(test)]
mod tests {
    use serde_json::{Value, json};

    use crate::{BodyError, FieldError, PlanRequest, read};

    fn snapshot(north: &Value) -> Value {
        let mut body = json!({
            "schema_version": "1.0", "t_s": 0.0,
            "origin": { "lat_deg": 38.41, "lon_deg": -9.12 },
            "asc": { "heading_rad": 0.0, "speed_mps": 0.2 },
            "auvs": [{ "id": "a", "state": { "north_m": 1.0, "east_m": 2.0, "depth_m": 3.0, "course_rad": 0.0,
                "speed_mps": 0.2 } }],
            "goal": { "kind": "track", "auv": "a", "offset": { "frame": "ned", "north_m": 1.0, "east_m": 0.0 } },
            "area": [{ "lat_deg": 38.41, "lon_deg": -9.12 }, [0.0, 90.0], [90.0, 0.0]],
            "metadata": { "lat_deg": 1.0 },
        });
        let asc = body["asc"].as_object_mut().expect("is an object");
        asc.append(&mut north.as_object().expect("is an object").clone());
        body
    }

    fn read_value(body: &Value) -> Result<PlanRequest, Box<FieldError>> {
        read(body.to_string().as_bytes())
            .map_err(|(BodyError::Syntax(error) | BodyError::Shape(error))| error)
    }

    #[test]
    fn a_position_on_earth_gets_metres_and_a_point_becomes_a_pair() {
        // A thousandth of a degree of the meridian at 38.41° is 111.005 m.
        let body = snapshot(&json!({ "lat_deg": 38.411, "lon_deg": -9.12 }));
        let request = read_value(&body).expect("is read");
        assert!((request.asc.north_m - 111.005).abs() < 0.01, "{}", request.asc.north_m);
        assert!(request.asc.east_m.abs() < 1e-6);
        assert_eq!(request.asc.lat_deg, Some(38.411));
        assert_eq!(request.area[0], [0.0, 0.0]);
        assert_eq!(request.metadata, *body["metadata"].as_object().expect("is one"));
    }

    #[test]
    fn an_error_asks_whether_latitude_and_longitude_are_exchanged() {
        // The spherical law of cosines, radius 6371 km; the ellipsoid differs by up to 0.6 %.
        const APART_KM: f64 = 7218.6;
        let exchanged = json!({ "lat_deg": -9.12, "lon_deg": 38.41 });
        let mut of_the_origin = snapshot(&json!({ "lat_deg": 38.41, "lon_deg": -9.12 }));
        of_the_origin["origin"] = exchanged.clone();
        for (body, pointer, given) in
            [(snapshot(&exchanged), "/asc/lat_deg", -9.12), (of_the_origin, "/area/0/lat_deg", 38.41)]
        {
            let wrong = read_value(&body).expect_err("is refused");
            assert_eq!((&*wrong.pointer, &*wrong.code), (pointer, "out_of_range"));
            assert_eq!(wrong.given, Some(json!(given)));
            let km: f64 =
                wrong.detail.split(' ').nth(3).and_then(|km| km.parse().ok()).expect("is a distance");
            assert!((km - APART_KM).abs() < 0.006 * APART_KM, "{}", wrong.detail);
            assert!(wrong.detail.contains("longitude exchanged"), "{}", wrong.detail);
        }
    }

    #[test]
    fn equal_and_missing_metres_are_accepted_beside_degrees() {
        for metres in [json!(null), json!(0.0)] {
            let both = json!({ "lat_deg": 38.41, "lon_deg": -9.12, "north_m": metres, "east_m": metres });
            let request = read_value(&snapshot(&both)).expect("is read");
            assert_eq!((request.asc.north_m, request.asc.east_m), (0.0, 0.0));
        }
    }

    #[test]
    fn errors_point_to_the_wrong_positions() {
        for (place, pointer, code) in [
            (json!({}), "/asc/north_m", "missing"),
            (json!({ "lat_deg": 38.0 }), "/asc/lon_deg", "missing"),
            (json!({ "lat_deg": 38.0, "lon_deg": 0.0, "north_m": 0.0 }), "/asc/lat_deg", "mixed"),
            (json!({ "lat_deg": 90.5, "lon_deg": 0.0 }), "/asc/lat_deg", "out_of_range"),
            (json!({ "lat_deg": 0.0, "lon_deg": 1e9 }), "/asc/lon_deg", "out_of_range"),
            (json!({ "lat_deg": "x", "lon_deg": 0.0 }), "/asc/lat_deg", "wrong_type"),
            (
                json!({ "lat_deg": 38.41, "lon_deg": -9.12, "north_m": 0.0, "east_m": 0.002 }),
                "/asc/lat_deg",
                "mixed",
            ),
        ] {
            let wrong = read_value(&snapshot(&place)).expect_err("is refused");
            assert_eq!((&*wrong.pointer, &*wrong.code), (pointer, code), "{place}");
        }
        let mut without = snapshot(&json!({ "lat_deg": 38.0, "lon_deg": 0.0 }));
        without["origin"] = Value::Null;
        let wrong = read_value(&without).expect_err("is refused");
        // Members are sorted here: the area comes first.
        assert_eq!((&*wrong.pointer, &*wrong.code), ("/area/0/lat_deg", "no_origin"));
        without["origin"] = json!({ "lat_deg": 91.0, "lon_deg": 0.0 });
        let wrong = read_value(&without).expect_err("is refused");
        assert_eq!((&*wrong.pointer, &*wrong.code), ("/origin/lat_deg", "out_of_range"));
    }
}
