//! Reads JSON bodies as request types, with positions in metres and directions in radians.

use planner::snapshot::Origin;
use serde::de::DeserializeOwned;

use crate::FieldError;
use crate::directions::WereInDegrees;
use crate::json::{BodyError, Json, Node, ShapeError, parse, token};
use crate::positions::Positions;

/// Reads `body` as a `T`, with positions in metres from its `origin`.
pub fn read<T: DeserializeOwned>(body: &[u8]) -> Result<T, BodyError> {
    read_from(body, None)
}

/// As [`read`]; bodies without an `origin` use this one.
pub fn read_from<T: DeserializeOwned>(body: &[u8], origin: Option<Origin>) -> Result<T, BodyError> {
    read_whole(parse(body)?, origin)
}

fn read_whole<T: DeserializeOwned>(json: Json<'_>, origin: Option<Origin>) -> Result<T, BodyError> {
    in_metres(json, origin, |json| T::deserialize(Node::whole(json)))
}

/// What `read` makes of `json` with positions in metres and directions in radians.
pub(crate) fn in_metres<'a, T>(
    mut json: Json<'a>,
    origin: Option<Origin>,
    read: impl FnOnce(&mut Json<'a>) -> Result<T, ShapeError>,
) -> Result<T, BodyError> {
    let read = json.each_name_once().and_then(|()| {
        let degrees = WereInDegrees::put_into_radians(&mut json)?;
        Positions::of(&json, origin)?.put_into_metres(&mut json)?;
        read(&mut json).map_err(|wrong| degrees.as_sent(wrong))
    });
    read.map_err(|ShapeError(error)| BodyError::Shape(error))
}

/// Reads the list `name`, the only member of `body`: 1 to `most` items, each a `T` or its error,
/// whose pointer starts at the item.
pub fn read_each<T: DeserializeOwned>(
    body: &[u8],
    name: &str,
    most: usize,
) -> Result<Vec<Result<T, BodyError>>, BodyError> {
    let json = parse(body)?;
    let refused = |code: &str, detail: String| {
        let error = FieldError::new(token(name), code, detail);
        BodyError::Shape(Box::new(error.limit(most)))
    };
    let Json::Object(mut members) = json else {
        let detail = format!("the body must be an object with `{name}`");
        return Err(refused("wrong_type", detail));
    };
    let [(given, Json::List(items))] = members.as_mut_slice() else {
        let detail = format!("the body must contain only the list `{name}`");
        return Err(refused("wrong_type", detail));
    };
    if given != name || !(1..=most).contains(&items.len()) {
        let detail = format!("the body must have the list `{name}` of 1 to {most} items");
        return Err(refused("length", detail));
    }
    Ok(items.drain(..).map(|item| read_whole(item, None)).collect())
}
