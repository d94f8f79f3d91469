//! The members of a live mission that can be changed.

use std::{collections::BTreeMap, mem};

use planner::craft::CraftDescription;
use planner::snapshot::{DeclaredLimits, DeclaredPath, KeepOut, NoGo, Origin, Task, Tuning};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use serde_with::skip_serializing_none;
use utoipa::ToSchema;

use super::new::{Live, LiveCraft};

/// The members of a live mission that can be changed while it runs.
///
/// In a patch, a given member replaces the previous one as a whole, without merging. `null` removes
/// it. Members that are left out stay. At least one is given.
#[skip_serializing_none]
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Setting {
    /// The goal. `null` is refused: every mission has one.
    #[serde(default, deserialize_with = "required")]
    #[schema(value_type = Task, required = false)]
    pub goal: Option<Task>,
    /// The operator's limits of the surface craft. Without `craft`, they also describe the craft.
    #[serde(default, deserialize_with = "removable")]
    #[schema(value_type = Option<DeclaredLimits>)]
    pub limits: Option<Option<DeclaredLimits>>,
    /// Closed-loop response of the surface craft. After a change, learning starts anew.
    #[serde(default, deserialize_with = "removable")]
    #[schema(value_type = Option<CraftDescription>)]
    pub craft: Option<Option<CraftDescription>>,
    /// The surface craft of a fleet, all of them: those that are left out are no longer in it.
    /// `null` is refused, and missions of one craft stay so.
    #[serde(default, deserialize_with = "required")]
    #[schema(value_type = Vec<LiveCraft>, required = false)]
    pub surface_craft: Option<Vec<LiveCraft>>,
    /// The planner's levers.
    #[serde(default, deserialize_with = "removable")]
    #[schema(value_type = Option<Tuning>)]
    pub tuning: Option<Option<Tuning>>,
    /// Discs to keep out of.
    #[serde(default, deserialize_with = "removable")]
    #[serde(serialize_with = "null_if_empty")]
    #[schema(value_type = Option<Vec<KeepOut>>)]
    pub keep_outs: Option<Vec<KeepOut>>,
    /// Polygons to keep out of.
    #[serde(default, deserialize_with = "removable")]
    #[serde(serialize_with = "null_if_empty")]
    #[schema(value_type = Option<Vec<NoGo>>)]
    pub no_go: Option<Vec<NoGo>>,
    /// Corners of the area to stay in.
    #[serde(default, deserialize_with = "removable")]
    #[serde(serialize_with = "null_if_empty")]
    #[schema(value_type = Option<Vec<[f64; 2]>>)]
    pub area: Option<Vec<[f64; 2]>>,
    /// Distance to keep from other vessels' sides, m.
    #[serde(default, deserialize_with = "removable")]
    #[schema(value_type = Option<f64>)]
    pub vessel_separation_m: Option<Option<f64>>,
    /// Place of the datum on Earth. Everything keeps its place on Earth. `null` is refused. A
    /// mission shows its `origin` beside its setting.
    #[serde(default, deserialize_with = "removable")]
    #[schema(value_type = Origin, required = false)]
    pub origin: Option<Option<Origin>>,
    /// Paths of AUVs by name. Each replaces the AUV's path as a whole; `null` removes it. Other
    /// AUVs keep theirs. A mission shows paths in its scene, not in its setting.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub paths: BTreeMap<String, ChangedPath>,
}

/// The new path of an AUV; `null` for none.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(transparent)]
pub struct ChangedPath(pub Option<DeclaredPath>);

/// Reads a member that must not be `null`.
fn required<'de, T: Deserialize<'de>, D: Deserializer<'de>>(given: D) -> Result<Option<T>, D::Error> {
    T::deserialize(given).map(Some)
}

/// Reads a member that `null` removes.
fn removable<'de, T, D>(given: D) -> Result<Option<T>, D::Error>
where
    T: Deserialize<'de> + Default,
    D: Deserializer<'de>,
{
    Option::deserialize(given).map(|given| Some(given.unwrap_or_default()))
}

#[expect(clippy::ref_option, reason = "this is how serde calls it")]
fn null_if_empty<T: Serialize, S: Serializer>(
    given: &Option<Vec<T>>,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    given.as_ref().filter(|items| !items.is_empty()).serialize(serializer)
}

impl Setting {
    /// Largest number of members.
    pub const MEMBERS: usize = 11;

    /// Exchanges the given members with those of `config`.
    pub fn exchange_with(&mut self, config: &mut Live) {
        fn exchange<T>(given: Option<&mut T>, place: &mut T) {
            if let Some(given) = given {
                mem::swap(given, place);
            }
        }
        exchange(self.goal.as_mut(), &mut config.goal);
        exchange(self.limits.as_mut(), &mut config.limits);
        exchange(self.craft.as_mut(), &mut config.craft);
        exchange(self.surface_craft.as_mut(), &mut config.surface_craft);
        exchange(self.tuning.as_mut(), &mut config.tuning);
        exchange(self.keep_outs.as_mut(), &mut config.keep_outs);
        exchange(self.no_go.as_mut(), &mut config.no_go);
        exchange(self.area.as_mut(), &mut config.area);
        exchange(self.vessel_separation_m.as_mut(), &mut config.vessel_separation_m);
        exchange(self.origin.as_mut(), &mut config.origin);
        for auv in &mut config.auvs {
            exchange(self.paths.get_mut(&auv.id).map(|path| &mut path.0), &mut auv.path);
        }
    }
}

impl From<&Live> for Setting {
    /// Every member of the mission's setting, without origin and paths.
    fn from(config: &Live) -> Self {
        Self {
            goal: Some(config.goal.clone()),
            limits: Some(config.limits),
            craft: Some(config.craft.clone()),
            surface_craft: Some(config.surface_craft.clone()).filter(|craft| !craft.is_empty()),
            tuning: Some(config.tuning.clone()),
            keep_outs: Some(config.keep_outs.clone()),
            no_go: Some(config.no_go.clone()),
            area: Some(config.area.clone()),
            vessel_separation_m: Some(config.vessel_separation_m),
            ..Self::default()
        }
    }
}
