//! The surface craft of a scenario file: one table, or a list of several.

use std::{borrow::Cow, fmt, marker::PhantomData};

use planner::fleet::CRAFT_MAX;
use schemars::JsonSchema;
use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{Deserialize, Deserializer, MapAccess, SeqAccess, Visitor};
use serde_json::{Value, json};

/// Members that all craft of a list share: those of the first.
const SHARED: [&str; 5] = ["goal", "goal_offset", "contact_range_m", "tuning", "parameters"];
/// Members that no craft has from the first.
const OWN: [&str; 2] = ["id", "serves"];

/// The schema of a table, or of a list.
#[derive(JsonSchema)]
#[schemars(untagged, rename = "OneOrSeveral")]
#[expect(dead_code, reason = "the schema alone is used")]
pub(super) enum OneOrSeveral<T> {
    One(Box<T>),
    Several(#[schemars(length(max = CRAFT_MAX))] Vec<T>),
}

pub(super) fn one_or_several<'de, D, T>(from: D) -> Result<Vec<T>, D::Error>
where
    D: Deserializer<'de>,
    T: Deserialize<'de>,
{
    struct Reader<T>(PhantomData<T>);

    impl<'de, T: Deserialize<'de>> Visitor<'de> for Reader<T> {
        type Value = Vec<T>;

        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            f.write_str("a table, or a list of tables")
        }

        fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Self::Value, A::Error> {
            Ok(vec![T::deserialize(MapAccessDeserializer::new(map))?])
        }

        fn visit_seq<A: SeqAccess<'de>>(self, list: A) -> Result<Self::Value, A::Error> {
            Vec::deserialize(SeqAccessDeserializer::new(list))
        }
    }

    from.deserialize_any(Reader(PhantomData))
}

/// The values of a file in which every craft of a list has what it leaves out from the first. The
/// error is a member that all craft share, by index of the craft and name.
pub(super) fn completed(tree: &Value) -> Result<Cow<'_, Value>, (usize, &'static str)> {
    let Some([Value::Object(first), others @ ..]) = tree["surface_craft"].as_array().map(Vec::as_slice)
    else {
        return Ok(Cow::Borrowed(tree));
    };
    for (i, other) in others.iter().enumerate() {
        if let Some(shared) = SHARED.into_iter().find(|name| other.get(name).is_some()) {
            return Err((i + 1, shared));
        }
    }
    let mut whole = tree.clone();
    let craft = whole["surface_craft"].as_array_mut().into_iter().flatten();
    for other in craft.filter_map(Value::as_object_mut) {
        for (name, value) in first.iter().filter(|(name, _)| !OWN.contains(&name.as_str())) {
            other.entry(name).or_insert_with(|| value.clone());
        }
    }
    Ok(Cow::Owned(whole))
}

/// Lets the craft of a list leave out in `schema` what they have from the first.
pub(super) fn relaxed(schema: &mut Value) {
    let mut craft = schema["$defs"]["SurfaceCraftFile"].clone();
    craft["required"] = json!(["id"]);
    schema["$defs"]["OneOrSeveral"]["anyOf"][1]["items"] = craft;
}
