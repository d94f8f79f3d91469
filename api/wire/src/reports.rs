//! Reads reports one by one: a rejected report does not affect the others.

use planner::snapshot::{AUVS_MAX, Origin, REPORTS_MAX, Report, Vessel};
use serde::Deserialize;

use crate::FieldError;
use crate::directions::WereInDegrees;
use crate::json::{Body, BodyError, Json, Node, ShapeError, token};
use crate::mission::{AscReport, Note, Reports, Steering};
use crate::positions::Positions;

/// The accepted reports of a body, and the faults of each rejected one.
type Sorted = (Reports, Vec<Vec<FieldError>>);

/// Reads reports, with positions in metres from `origin`. Without an origin, the first accepted
/// position in latitude and longitude becomes the origin. `faults` checks a single report.
pub fn read_reports(
    Body(mut json): Body<'_>,
    origin: Option<Origin>,
    faults: impl Fn(&Reports) -> Vec<FieldError>,
) -> Result<Sorted, BodyError> {
    let items = take_items(&mut json);
    let begun = json.each_name_once().and_then(|()| {
        let rest = Reports::deserialize(Node::whole(&json))?;
        check_lengths(&rest, &items)?;
        Ok((rest, Positions::from(origin, true)?))
    });
    let (mut reports, mut positions) = begun.map_err(|ShapeError(error)| BodyError::Shape(error))?;
    let mut rejected: Vec<Vec<FieldError>> = vec![];
    let mut is_in_metres = false;
    for item in items {
        let from_metres = matches!(item.json.member("from"), Some(Json::List(_)));
        // A rejected report sets no origin.
        let before = positions.clone();
        let faults = |one: &Reports| [plan_of_another_datum(one, origin), faults(one)].concat();
        match item.read(&mut positions, faults) {
            Ok(one) => {
                is_in_metres |= from_metres || !one.is_on_earth();
                reports.extend(one);
            }
            Err(faults) => {
                positions = before;
                // An unknown AUV is named once.
                if rejected.last() != Some(&faults) {
                    rejected.push(faults);
                }
            }
        }
    }
    reports.auvs.retain(|_, fixes| !fixes.is_empty());
    reports.origin = positions.origin.filter(|_| origin.is_none());
    if reports.origin.is_some() && is_in_metres {
        let detail = "the first position in latitude and longitude becomes the mission's origin: give every position \
                      of this request in latitude and longitude";
        return Err(BodyError::Shape(FieldError::new("", "mixed", detail).into()));
    }
    Ok((reports, rejected))
}

/// The fault of a vessel whose place sets the origin, and whose plan is in metres from another one.
fn plan_of_another_datum(one: &Reports, origin: Option<Origin>) -> Vec<FieldError> {
    let is_mixed = |vessel: &&Vessel| origin.is_none() && vessel.lat_deg.is_some() && !vessel.plan.is_empty();
    let detail = "in metres from an `origin` that the mission does not have yet: give `origin` in the mission, or \
                  leave the plan out until a report has set it";
    let fault = |_| FieldError::new("/traffic/0/plan".to_owned(), "no_origin", detail);
    one.traffic.iter().filter(is_mixed).map(fault).collect()
}

/// A report in a body.
struct Item<'a> {
    of: Of,
    /// Pointer of its list.
    list: String,
    index: usize,
    json: Json<'a>,
}

#[derive(Clone)]
enum Of {
    Auv(String),
    Asc,
    Vessel,
    Note,
    Steering,
}

/// Takes the items of all lists out of a body, in their order.
fn take_items<'a>(body: &mut Json<'a>) -> Vec<Item<'a>> {
    let mut items = vec![];
    let mut take = |of: Of, list: String, from: &mut Json<'a>| {
        if let Json::List(given) = from {
            items.extend(given.drain(..).enumerate().map(|(index, json)| Item {
                of: of.clone(),
                list: list.clone(),
                index,
                json,
            }));
        }
    };
    let Json::Object(members) = body else {
        return items;
    };
    for (name, value) in members {
        match (&**name, value) {
            ("auvs", Json::Object(auvs)) => {
                for (id, fixes) in auvs {
                    take(Of::Auv(id.to_string()), format!("/auvs{}", token(id)), fixes);
                }
            }
            ("asc", states) => take(Of::Asc, "/asc".to_owned(), states),
            ("traffic", vessels) => take(Of::Vessel, "/traffic".to_owned(), vessels),
            ("notes", notes) => take(Of::Note, "/notes".to_owned(), notes),
            ("steering", said) => take(Of::Steering, "/steering".to_owned(), said),
            _ => {}
        }
    }
    items
}

/// Fails for bodies that are empty, too long or with the service's members. `rest` has no items.
fn check_lengths(rest: &Reports, items: &[Item<'_>]) -> Result<(), ShapeError> {
    if rest.origin.is_some() || !rest.rejected.is_empty() {
        let member = if rest.origin.is_some() { "/origin" } else { "/rejected" };
        let detail = "set by the service: leave it out";
        return Err(ShapeError::new(member.to_owned(), "unexpected", detail));
    }
    if items.is_empty() && rest.auvs.is_empty() {
        let detail = "give auvs, asc, traffic, notes or steering";
        return Err(ShapeError::new(String::new(), "missing", detail));
    }
    let too_long =
        |pointer: &str, given, most| Err(ShapeError(Box::new(FieldError::too_long(pointer, given, most))));
    if AUVS_MAX < rest.auvs.len() {
        return too_long("/auvs", rest.auvs.len(), AUVS_MAX);
    }
    for list in items.chunk_by(|a, b| a.list == b.list) {
        if REPORTS_MAX < list.len() {
            return too_long(&list[0].list, list.len(), REPORTS_MAX);
        }
    }
    Ok(())
}

impl Item<'_> {
    fn read(
        mut self,
        positions: &mut Positions,
        faults: impl Fn(&Reports) -> Vec<FieldError>,
    ) -> Result<Reports, Vec<FieldError>> {
        let place = format!("{}/{}", self.list, self.index);
        let one = self.shaped(positions).map_err(|ShapeError(mut error)| {
            error.pointer.insert_str(0, &place);
            vec![*error]
        })?;
        let mut faults = faults(&one);
        if faults.is_empty() {
            return Ok(one);
        }
        let alone = format!("{}/0", self.list);
        for fault in &mut faults {
            if let Some(rest) = fault.pointer.strip_prefix(&alone) {
                fault.pointer = format!("{place}{rest}");
            }
        }
        Err(faults)
    }

    fn shaped(&mut self, positions: &mut Positions) -> Result<Reports, ShapeError> {
        self.json.each_name_once()?;
        let degrees = WereInDegrees::put_into_radians(&mut self.json)?;
        positions.put_into_metres(&mut self.json)?;
        let whole = Node::whole(&self.json);
        let mut one = Reports::default();
        let read = match &self.of {
            Of::Auv(id) => Report::deserialize(whole).map(|fix| {
                one.auvs.insert(id.clone(), vec![fix]);
            }),
            Of::Asc => AscReport::deserialize(whole).map(|state| one.asc.push(state)),
            Of::Vessel => Vessel::deserialize(whole).map(|vessel| one.traffic.push(vessel)),
            Of::Note => Note::deserialize(whole).map(|note| one.notes.push(note)),
            Of::Steering => Steering::deserialize(whole).map(|said| one.steering.push(said)),
        };
        read.map_err(|wrong| degrees.as_sent(wrong)).map(|()| one)
    }
}

#[cfg(test)]
mod tests {
    use serde_json::{Value, json};

    use super::*;

    fn fix(lat_deg: f64, t_s: f64) -> Value {
        json!({ "t_s": t_s, "lat_deg": lat_deg, "lon_deg": 180.0, "sigma_m": 1.0 })
    }

    fn origin(lat_deg: f64, lon_deg: f64) -> Origin {
        Origin { lat_deg, lon_deg }
    }

    /// Rejects fixes of the time 0.
    fn read(body: &str, origin: Option<Origin>) -> Result<Sorted, BodyError> {
        read_reports(Body::parse(body.as_bytes())?, origin, |one| {
            let fixes = one.auvs.iter().flat_map(|(id, fixes)| fixes.iter().map(move |fix| (id, fix)));
            let wrong = fixes.filter(|(_, fix)| fix.t_s == 0.0);
            wrong
                .map(|(id, _)| FieldError::new(format!("/auvs/{id}/0/t_s"), "out_of_range", "is 0"))
                .collect()
        })
    }

    #[test]
    fn the_first_fix_of_reports_may_become_the_origin() {
        let body = json!({ "auvs": { "a": [fix(-17.0, 1.0), fix(-17.001, 1.0)] } }).to_string();
        let (heard, rejected) = read(&body, None).expect("is read");
        assert_eq!((heard.origin, rejected), (Some(origin(-17.0, 180.0)), vec![]));
        assert_eq!(heard.auvs["a"][0].position().x, 0.0);
        assert!((heard.auvs["a"][1].position().x + 110.66).abs() < 0.02);
        let (heard, _) = read(&body, Some(origin(-17.001, -180.0))).expect("is read");
        assert_eq!(heard.origin, None);
        assert!((heard.auvs["a"][0].position().x - 110.66).abs() < 0.02);
        assert!(heard.auvs["a"][0].position().y.abs() < 1e-6);
    }

    #[test]
    fn a_range_is_from_a_place_in_metres_or_on_earth() {
        let range = |from: Value| json!({ "t_s": 1.0, "range_m": 30.0, "sigma_m": 1.0, "from": from });
        let ranges = [range(json!([3.0, 4.0])), range(json!({ "lat_deg": -16.999, "lon_deg": 180.0 }))];
        let body = json!({ "auvs": { "a": ranges } }).to_string();
        let (heard, rejected) = read(&body, Some(origin(-17.0, 180.0))).expect("is read");
        assert_eq!((rejected, heard.auvs["a"][0].from), (vec![], Some([3.0, 4.0])));
        assert!((heard.auvs["a"][1].position().x - 110.66).abs() < 0.02);
        // The first position may be that from which a range was measured.
        let body = |from: &Value| json!({ "auvs": { "a": [ranges[1], range(from.clone())] } }).to_string();
        let (heard, rejected) =
            read(&body(&json!({ "lat_deg": -17.0, "lon_deg": 180.0 })), None).expect("is read");
        assert_eq!((heard.origin, rejected), (Some(origin(-16.999, 180.0)), vec![]));
        let mixed = read(&body(&json!([3.0, 4.0])), None).expect_err("has metres from nowhere");
        assert!(matches!(mixed, BodyError::Shape(fault) if fault.code == "mixed"));
    }

    #[test]
    fn a_plan_in_metres_is_refused_beside_the_place_that_sets_the_origin() {
        let vessel = |plan: Value| json!({ "id": "a", "lat_deg": -17.0, "lon_deg": 180.0, "plan": plan });
        let one =
            |vessel: Value| json!({ "traffic": [vessel, { "id": "b", "lat_deg": -17.1, "lon_deg": 180.0 }] });
        let body = one(vessel(json!([[60.0, 10.0, 0.0]]))).to_string();
        let (heard, rejected) = read(&body, None).expect("is read");
        let wrong = &rejected[0][0];
        assert_eq!((&*wrong.pointer, &*wrong.code, rejected.len()), ("/traffic/0/plan", "no_origin", 1));
        // The other vessel sets the origin.
        assert_eq!((heard.traffic.len(), heard.origin), (1, Some(origin(-17.1, 180.0))));
        for (body, known) in [(body, Some(origin(-17.0, 180.0))), (one(vessel(json!([]))).to_string(), None)]
        {
            let (heard, rejected) = read(&body, known).expect("is read");
            assert_eq!((heard.traffic.len(), rejected), (2, vec![]));
        }
    }

    #[test]
    fn a_rejected_report_affects_no_other_and_sets_no_origin() {
        let twice = r#"{"t_s":1,"t_s":2,"lat_deg":1,"lon_deg":1,"sigma_m":1}"#;
        let body = json!({ "auvs": {
            "a": [fix(40.0, 0.0), "a fix", fix(-17.0, 1.0), fix(95.0, 1.0), null],
            "b": [fix(-17.1, 0.0)],
        }, "notes": [{ "t_s": 1.0, "text": "x" }, { "t_s": 1.0 }] });
        let body = body.to_string().replace("\"a fix\"", twice);
        let (heard, rejected) = read(&body, None).expect("is read");
        assert_eq!(heard.origin, Some(origin(-17.0, 180.0)));
        assert_eq!((heard.auvs.len(), heard.auvs["a"].len(), heard.notes.len()), (1, 1, 1));
        let pointers: Vec<_> = rejected.iter().map(|faults| &*faults[0].pointer).collect();
        let expected = [
            "/auvs/a/0/t_s",
            "/auvs/a/1/t_s",
            "/auvs/a/3/lat_deg",
            "/auvs/a/4",
            "/auvs/b/0/t_s",
            "/notes/1/text",
        ];
        assert_eq!(pointers, expected);
    }
}
