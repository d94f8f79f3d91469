//! Objects that are read as maps, and refused where a name stands twice: of two, a map would keep the last.

use std::{collections::BTreeMap, fmt, marker::PhantomData};

use serde::{
    Deserialize, Deserializer,
    de::{Error as _, MapAccess, Unexpected, Visitor},
};

/// Values by name.
pub(super) fn each_name_once<'de, D: Deserializer<'de>, T: Deserialize<'de>>(
    deserializer: D,
) -> Result<BTreeMap<String, T>, D::Error> {
    deserializer.deserialize_map(EachNameOnce(PhantomData))
}

/// Values by name, or `null`.
pub(super) fn if_any_each_name_once<'de, D: Deserializer<'de>, T: Deserialize<'de>>(
    deserializer: D,
) -> Result<Option<BTreeMap<String, T>>, D::Error> {
    struct Named<T>(BTreeMap<String, T>);

    impl<'de, T: Deserialize<'de>> Deserialize<'de> for Named<T> {
        fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
            each_name_once(deserializer).map(Self)
        }
    }

    Ok(Option::<Named<T>>::deserialize(deserializer)?.map(|Named(map)| map))
}

struct EachNameOnce<T>(PhantomData<T>);

impl<'de, T: Deserialize<'de>> Visitor<'de> for EachNameOnce<T> {
    type Value = BTreeMap<String, T>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a map")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut given: A) -> Result<Self::Value, A::Error> {
        let mut map = BTreeMap::new();
        while let Some(name) = given.next_key::<String>()? {
            if map.contains_key(&name) {
                // `duplicate_field` is for names that the program knows.
                return Err(A::Error::invalid_value(
                    Unexpected::Str(&name),
                    &"a name that stands once",
                ));
            }
            map.insert(name, given.next_value()?);
        }
        Ok(map)
    }
}
