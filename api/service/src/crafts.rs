//! The craft that are known by name.

use axum::Json;
use planner::craft::{PRESETS, Preset};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use wire::Craft;

/// The craft there are.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct CraftList {
    /// One entry each, the first the one that stands for a craft without a description.
    pub crafts: Vec<CraftEntry>,
}

/// A craft by name.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct CraftEntry {
    /// Its name: `preset` of a request's `craft`.
    pub name: String,
    /// What it is.
    pub title: String,
    /// Where its numbers come from.
    pub source: String,
    /// How it answers, everything spelled out.
    pub craft: Craft,
}

/// Lists the craft that are known by name.
#[utoipa::path(get, path = "/v1/crafts", tag = "crafts",
    responses((status = 200, description = "Names, sources and numbers.", body = CraftList)))]
pub(crate) async fn list_crafts() -> Json<CraftList> {
    let entry = |preset: &Preset| CraftEntry {
        name: preset.name.to_owned(),
        title: preset.title.to_owned(),
        source: preset.source.to_owned(),
        craft: Craft::from(&preset.craft),
    };
    Json(CraftList {
        crafts: PRESETS.iter().map(entry).collect(),
    })
}
