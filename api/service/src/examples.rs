//! Example requests: the files of `examples/snapshots/`.

use axum::Json;
use axum::extract::Path;
use axum::extract::rejection::PathRejection;
use axum::http::header;
use axum::response::{IntoResponse, Response};
use serde::Serialize;
use utoipa::ToSchema;

use crate::edge::problem::{Problem, ProblemDocument};
use wire::PlanRequest;

/// An example.
#[derive(Clone, Copy, Debug, Serialize, ToSchema)]
#[schema(as = ExampleEntry)]
pub struct Example {
    /// Its name in `/v1/examples/{name}`.
    pub name: &'static str,
    /// Its subject, in one line.
    pub title: &'static str,
    /// The body.
    #[serde(skip)]
    pub body: &'static str,
}

macro_rules! examples {
    ($($name:literal: $title:literal;)*) => {
        [$(Example {
            name: $name,
            title: $title,
            body: include_str!(concat!("../../../examples/snapshots/", $name, ".json")),
        }),*]
    };
}

/// Every example. The first one is the simplest.
pub const EXAMPLES: [Example; 12] = examples! {
    "track": "Follow one AUV, from behind and pointing away";
    "intermittent": "Two AUVs in turn, 25 s before the hand-over";
    "midpoint": "The midpoint of two AUVs, one of them turning";
    "weighted": "A weighted mean of two AUVs";
    "range": "In range of three AUVs, as near as possible to the farthest";
    "visit": "Three AUVs one after the other, so that their navigation stays certain";
    "localise": "Round an AUV, so that the ranges that it measures of the craft fix it";
    "offset": "To starboard of an AUV that is about to turn to starboard";
    "cross-current": "Follow one AUV across a known current";
    "about-face": "Ahead of the AUV and facing it";
    "reports": "Follow one AUV that is known by raw fixes, one of them an outlier";
    "crowded": "A hand-over past keep-out discs, in an area and in acoustic range";
};

/// The examples.
#[derive(Clone, Debug, Serialize, ToSchema)]
pub struct ExampleList {
    /// One entry each.
    pub examples: Vec<Example>,
}

/// Lists the examples.
#[utoipa::path(get, path = "/v1/examples", tag = "examples",
    responses((status = 200, description = "Names and titles.", body = ExampleList)))]
pub(crate) async fn list_examples() -> Json<ExampleList> {
    Json(ExampleList { examples: EXAMPLES.to_vec() })
}

/// Returns an example, ready to post.
#[utoipa::path(get, path = "/v1/examples/{name}", tag = "examples",
    params(("name" = String, Path, description = "A name that `/v1/examples` lists.")),
    responses(
        (status = 200, description = "A body for `/v1/plan`.", body = PlanRequest),
        (status = 404, description = "There is no such example.", body = ProblemDocument,
            content_type = "application/problem+json")))]
pub(crate) async fn get_example(name: Result<Path<String>, PathRejection>) -> Result<Response, Problem> {
    let wanted = name.map(|Path(name)| name).unwrap_or_default();
    let example = EXAMPLES.iter().find(|example| example.name == wanted).ok_or(Problem::NoExample)?;
    Ok(([(header::CONTENT_TYPE, "application/json")], example.body).into_response())
}
