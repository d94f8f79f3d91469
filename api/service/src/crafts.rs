//! Built-in craft.

use axum::Json;
use planner::craft::{CraftDescription, PRESETS, Preset};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// The built-in craft.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct CraftList {
    /// One entry each. The first one is used for a request without `craft`.
    pub crafts: Vec<CraftEntry>,
}

/// A built-in craft.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct CraftEntry {
    /// Its name: `preset` of a request's `craft`.
    pub name: String,
    /// A short description of the craft.
    pub title: String,
    /// The source of its numbers.
    pub source: String,
    /// Its model, with every default filled in.
    pub craft: CraftDescription,
}

/// Lists the built-in craft.
#[utoipa::path(get, path = "/v1/crafts", tag = "crafts",
    responses((status = 200, description = "Names, sources and numbers.", body = CraftList)))]
pub(crate) async fn list_crafts() -> Json<CraftList> {
    let entry = |preset: &Preset| CraftEntry {
        name: preset.name.to_owned(),
        title: preset.title.to_owned(),
        source: preset.source.to_owned(),
        craft: CraftDescription::from(&preset.craft),
    };
    Json(CraftList { crafts: PRESETS.iter().map(entry).collect() })
}
