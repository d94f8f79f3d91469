//! Enums of which a member names the variant: `{"kind": "track", "auv": "a"}`.
//!
//! serde's own reader buffers the object and loses the place of a fault. [`tagged`] derives a
//! reader of the form `{"track": {"auv": "a"}}`, which scenario files have. A deserializer that
//! knows [`TAGGED`] shows its object in that form; of others, it is copied.

use std::{fmt, marker::PhantomData};

use serde::de::value::{MapAccessDeserializer, StrDeserializer};
use serde::de::{DeserializeSeed, Error, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};
use serde_json::{Map, Value};

/// Begins the name of the newtype as which a tagged enum is read. The tag follows, and perhaps a
/// member that belongs to the object, but not to the enum. A deserializer that knows this name
/// gives a list: the enum, with the name outside, and the second member.
pub const TAGGED: &str = "$tagged ";

/// Reader of an enum with the name of the variant outside.
pub(crate) trait NameOutside<'de> {
    type Enum;

    fn read<D: Deserializer<'de>>(from: D) -> Result<Self::Enum, D::Error>;
}

/// The enum that `R` reads, and the second member.
pub(crate) fn read<'de, R: NameOutside<'de>, M: Deserialize<'de>, D: Deserializer<'de>>(
    from: D,
    name: &'static str,
) -> Result<(R::Enum, Option<M>), D::Error> {
    let object = Object::<R, M> { members: name.trim_start_matches(TAGGED), read: PhantomData };
    from.deserialize_newtype_struct(name, object)
}

struct Object<R, M> {
    /// The tag and perhaps a second member.
    members: &'static str,
    read: PhantomData<(R, M)>,
}

impl<'de, R: NameOutside<'de>, M: Deserialize<'de>> Visitor<'de> for Object<R, M> {
    type Value = (R::Enum, Option<M>);

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "an object with {}", self.members)
    }

    fn visit_newtype_struct<D: Deserializer<'de>>(self, from: D) -> Result<Self::Value, D::Error> {
        from.deserialize_any(self)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut parts: A) -> Result<Self::Value, A::Error> {
        let read = parts.next_element_seed(Outside::<R>(PhantomData))?;
        let read = read.ok_or_else(|| A::Error::invalid_length(0, &self))?;
        Ok((read, parts.next_element()?.flatten()))
    }

    fn visit_str<E: Error>(self, name: &str) -> Result<Self::Value, E> {
        Ok((R::read(StrDeserializer::new(name))?, None))
    }

    fn visit_map<A: MapAccess<'de>>(self, members: A) -> Result<Self::Value, A::Error> {
        let mut object = Map::deserialize(MapAccessDeserializer::new(members))?;
        object.retain(|_, value| !value.is_null());
        let (tag, second) = self.members.split_once(' ').unwrap_or((self.members, ""));
        let second = object.remove(second).map(M::deserialize);
        let second = second.transpose().map_err(A::Error::custom)?;
        let read = match object.remove(tag) {
            Some(Value::String(name)) => {
                let named = |members| R::read(Value::Object(Map::from_iter([(name.clone(), members)])));
                // A variant without members is null.
                match (named(Value::Null), object.keys().next()) {
                    (Ok(_), Some(member)) => {
                        return Err(A::Error::custom(format_args!("unknown field `{member}`")));
                    }
                    (Ok(unit), None) => Ok(unit),
                    (Err(_), _) => named(Value::Object(object)),
                }
            }
            Some(_) => return Err(A::Error::custom(format_args!("`{tag}` is no text"))),
            None => R::read(Value::Object(object)),
        };
        Ok((read.map_err(A::Error::custom)?, second))
    }
}

struct Outside<R>(PhantomData<R>);

impl<'de, R: NameOutside<'de>> DeserializeSeed<'de> for Outside<R> {
    type Value = R::Enum;

    fn deserialize<D: Deserializer<'de>>(self, from: D) -> Result<R::Enum, D::Error> {
        R::read(from)
    }
}

/// Defines an enum whose member `$tag` names the variant, and `$outside`, which reads it with the
/// name outside. `N` is the type of its numbers, if they may be distributions.
macro_rules! tagged {
    ($(#[$about:meta])* pub enum $name:ident $(<$n:ident>)? = $text:tt, $outside:ident, $tag:tt {
        $($variants:tt)*
    }) => {
        $(#[$about])*
        #[derive(serde::Serialize, utoipa::ToSchema)]
        #[serde(tag = $tag, rename_all = "snake_case")]
        pub enum $name $(<$n = f64>)? { $($variants)* }

        #[derive(serde::Deserialize, schemars::JsonSchema, utoipa::ToSchema)]
        #[serde(remote = $text, rename_all = "snake_case", deny_unknown_fields)]
        $(
            #[serde(bound(deserialize = "N: serde::Deserialize<'de> + From<f64>"))]
            #[schemars(bound = "N: schemars::JsonSchema + From<f64>")]
            #[doc = stringify!($n)]
        )?
        #[schemars(rename = $text)]
        enum $outside $(<$n = f64>)? { $($variants)* }

        impl<'de $(, $n: serde::Deserialize<'de> + From<f64>)?> $crate::facts::tagged::NameOutside<'de>
            for $outside $(<$n>)?
        {
            type Enum = $name $(<$n>)?;

            fn read<D: serde::Deserializer<'de>>(from: D) -> Result<Self::Enum, D::Error> {
                Self::deserialize(from)
            }
        }

        impl$(<$n: schemars::JsonSchema + From<f64>>)? schemars::JsonSchema for $name $(<$n>)? {
            fn schema_name() -> std::borrow::Cow<'static, str> {
                $text.into()
            }

            fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
                <$outside $(<$n>)? as schemars::JsonSchema>::json_schema(generator)
            }
        }

        impl $(<$n>)? $name $(<$n>)? {
            /// Reads it with the name of the variant outside, as scenario files have it.
            ///
            /// # Errors
            /// If it has another shape.
            pub fn outside<'de, D>(from: D) -> Result<Self, D::Error>
            where
                D: serde::Deserializer<'de>,
                $($n: serde::Deserialize<'de> + From<f64>,)?
            {
                $outside::deserialize(from)
            }
        }
    };
}
pub(crate) use tagged;

/// Reads a tagged enum without a second member.
macro_rules! read_tagged {
    ($name:ident $(<$n:ident>)?, $outside:ident, $tag:literal) => {
        impl<'de $(, $n: serde::Deserialize<'de> + From<f64>)?> serde::Deserialize<'de> for $name $(<$n>)? {
            fn deserialize<D: serde::Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
                let read = $crate::facts::tagged::read::<$outside $(<$n>)?, serde::de::IgnoredAny, D>;
                Ok(read(from, concat!("$tagged ", $tag))?.0)
            }
        }
    };
}
pub(crate) use read_tagged;
