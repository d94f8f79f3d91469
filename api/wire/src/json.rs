//! A JSON body, parsed once into a tree from which any shape is read.
//!
//! ```text
//! bytes ── parse: JSON? ──► Json ── read: right shape? ──► T
//! ```
//! The tree keeps the order of members, and duplicates: faults are found where the client wrote
//! them. Every fault is a [`FieldError`] from the start; no other library's message is parsed.

use std::borrow::Cow;
use std::collections::{BTreeMap, HashSet};
use std::fmt;

use planner::snapshot::{DIRECTIONS, TAGGED, pointer_token};
use serde::{
    Deserialize, Deserializer, Serialize, Serializer,
    de::{
        self, DeserializeSeed, Expected, IntoDeserializer, MapAccess, SeqAccess, Unexpected, Visitor,
        value::{MapAccessDeserializer, StrDeserializer},
    },
    forward_to_deserialize_any,
};
use serde_json::{Number, json};

use crate::FieldError;

/// First bytes of some editors' UTF-8 text, which JSON forbids (RFC 8259, section 8.1).
const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

/// Most values in a body, about twice those of 16 AUVs with 256 segments and 64 reports each.
pub const VALUES_MAX: usize = 100_000;

const TOKEN_LENGTH_MAX: usize = 80;

/// The fault of a body.
#[derive(Clone, Debug, PartialEq)]
pub enum BodyError {
    /// The body is not JSON.
    Syntax(Box<FieldError>),
    /// The JSON has another shape.
    Shape(Box<FieldError>),
}

#[derive(Debug)]
pub(crate) enum Json<'a> {
    Null,
    Bool(bool),
    Number(Number),
    Text(Cow<'a, str>),
    List(Vec<Json<'a>>),
    /// Members, in the order of the text.
    Object(Vec<(Cow<'a, str>, Json<'a>)>),
}

impl Json<'_> {
    /// A member of an object, if it is present and not null.
    pub(crate) fn member(&self, name: &str) -> Option<&Self> {
        self.given(name).filter(|value| !matches!(value, Self::Null))
    }

    fn given(&self, name: &str) -> Option<&Self> {
        let Self::Object(members) = self else {
            return None;
        };
        members.iter().find(|(given, _)| given == name).map(|(_, value)| value)
    }

    pub(crate) fn number(&self) -> Option<f64> {
        match self {
            Self::Number(number) => number.as_f64(),
            _ => None,
        }
    }

    /// Its name for people.
    pub(crate) fn name(&self) -> &'static str {
        match self {
            Json::Null => "null",
            Json::Bool(_) => "true or false",
            Json::Number(_) => "a number",
            Json::Text(_) => "text",
            Json::List(_) => "a list",
            Json::Object(_) => "an object",
        }
    }

    /// Fails if a name occurs twice in an object: readers differ in theirs (RFC 8259, section 4).
    pub(crate) fn each_name_once(&self) -> Result<(), ShapeError> {
        match self {
            Json::List(items) => {
                for (i, item) in items.iter().enumerate() {
                    item.each_name_once().map_err(|twice| twice.within(&i.to_string()))?;
                }
            }
            Json::Object(members) => {
                let mut names = HashSet::with_capacity(members.len());
                for (name, value) in members {
                    if !names.insert(name) {
                        let (code, detail) = ("duplicate_field", "duplicate member");
                        return Err(ShapeError::new(token(name), code, detail));
                    }
                    value.each_name_once().map_err(|twice| twice.within(name))?;
                }
            }
            Json::Null | Json::Bool(_) | Json::Number(_) | Json::Text(_) => {}
        }
        Ok(())
    }
}

/// A body that is JSON. Bodies with equal values serialise to equal bytes.
#[derive(Debug)]
pub struct Body<'a>(pub(crate) Json<'a>);

impl<'a> Body<'a> {
    /// Fails for bodies that are not JSON or have too many values.
    pub fn parse(body: &'a [u8]) -> Result<Self, BodyError> {
        parse(body).map(Self)
    }
}

impl Serialize for Body<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.0.serialize(serializer)
    }
}

impl Serialize for Json<'_> {
    /// Members are in the order of their names. Of members with the same name, the last one counts.
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Json::Null => serializer.serialize_unit(),
            Json::Bool(value) => value.serialize(serializer),
            Json::Number(number) => number.serialize(serializer),
            Json::Text(text) => text.serialize(serializer),
            Json::List(items) => items.serialize(serializer),
            Json::Object(members) => {
                let members = members.iter().map(|(name, value)| (name, value));
                members.collect::<BTreeMap<_, _>>().serialize(serializer)
            }
        }
    }
}

pub(crate) fn parse(body: &[u8]) -> Result<Json<'_>, BodyError> {
    // One of these precedes every value except the first and members' values.
    let values = body.split(|byte| b",[{".contains(byte)).count();
    if VALUES_MAX < values {
        let detail = format!("holds {values} values or more, at most {VALUES_MAX} are accepted");
        let error = FieldError::new("", "too_many_values", detail);
        return Err(BodyError::Shape(Box::new(error.given(values).limit(VALUES_MAX))));
    }
    let mut deserializer = serde_json::Deserializer::from_slice(body);
    let parsed = serde_path_to_error::deserialize(&mut deserializer)
        .map_err(|error| (pointer(error.path()), error.into_inner()));
    let whole = parsed.and_then(|json| match deserializer.end() {
        Ok(()) => Ok(json),
        Err(error) => Err((String::new(), error)),
    });
    whole.map_err(|(pointer, error)| {
        let detail = if body.starts_with(BYTE_ORDER_MARK) {
            "starts with a byte order mark: send UTF-8 without one".to_owned()
        } else {
            plain_syntax(&error)
        };
        BodyError::Syntax(Box::new(FieldError::new(pointer, "syntax", detail)))
    })
}

/// serde_json's message, with plain words for its internal terms.
fn plain_syntax(error: &serde_json::Error) -> String {
    let (line, column) = (error.line(), error.column());
    let words = error.to_string();
    let words = words.strip_suffix(&format!(" at line {line} column {column}")).unwrap_or(&words);
    let plain = match words {
        _ if error.is_eof() => "the text ends before the value does",
        "expected ident" | "expected value" => "there is no JSON value",
        "number out of range" => "the number is too large",
        "recursion limit exceeded" => "nested too deeply",
        other => other,
    };
    format!("{plain} at line {line} column {column}")
}

fn pointer(path: &serde_path_to_error::Path) -> String {
    use serde_path_to_error::Segment;
    path.iter()
        .map(|segment| match segment {
            Segment::Seq { index } => token(&index.to_string()),
            Segment::Map { key } => token(key),
            Segment::Enum { .. } | Segment::Unknown => String::new(),
        })
        .collect()
}

/// A step of a pointer.
pub(crate) fn token(name: &str) -> String {
    let short: String = name.chars().take(TOKEN_LENGTH_MAX).collect();
    format!("/{}", pointer_token(&short))
}

impl<'de> Deserialize<'de> for Json<'de> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(Tree)
    }
}

/// Text, borrowed from the body if it has no escapes.
#[derive(Deserialize)]
#[serde(transparent)]
struct Name<'a>(#[serde(borrow)] Cow<'a, str>);

struct Tree;

impl<'de> Visitor<'de> for Tree {
    type Value = Json<'de>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("any JSON value")
    }

    fn visit_unit<E>(self) -> Result<Json<'de>, E> {
        Ok(Json::Null)
    }

    fn visit_bool<E>(self, value: bool) -> Result<Json<'de>, E> {
        Ok(Json::Bool(value))
    }

    fn visit_u64<E>(self, value: u64) -> Result<Json<'de>, E> {
        Ok(Json::Number(value.into()))
    }

    fn visit_i64<E>(self, value: i64) -> Result<Json<'de>, E> {
        Ok(Json::Number(value.into()))
    }

    fn visit_f64<E>(self, value: f64) -> Result<Json<'de>, E> {
        Ok(Number::from_f64(value).map_or(Json::Null, Json::Number))
    }

    fn visit_str<E>(self, value: &str) -> Result<Json<'de>, E> {
        Ok(Json::Text(Cow::Owned(value.to_owned())))
    }

    fn visit_borrowed_str<E>(self, value: &'de str) -> Result<Json<'de>, E> {
        Ok(Json::Text(Cow::Borrowed(value)))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut items: A) -> Result<Json<'de>, A::Error> {
        let mut list = Vec::new();
        while let Some(item) = items.next_element()? {
            list.push(item);
        }
        Ok(Json::List(list))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut members: A) -> Result<Json<'de>, A::Error> {
        let mut object = Vec::new();
        while let Some(Name(name)) = members.next_key()? {
            object.push((name, members.next_value()?));
        }
        Ok(Json::Object(object))
    }
}

/// The first fault of JSON against a shape; its pointer starts where the shape is read.
#[derive(Debug)]
pub(crate) struct ShapeError(pub(crate) Box<FieldError>);

impl ShapeError {
    pub(crate) fn new(pointer: String, code: &str, detail: impl Into<String>) -> Self {
        Self(Box::new(FieldError::new(pointer, code, detail)))
    }

    /// The same fault, seen from the object or list that contains `name`.
    pub(crate) fn within(mut self, name: &str) -> Self {
        self.0.pointer.insert_str(0, &token(name));
        self
    }
}

impl fmt::Display for ShapeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.0.pointer, self.0.detail)
    }
}

impl std::error::Error for ShapeError {}

impl de::Error for ShapeError {
    fn custom<T: fmt::Display>(detail: T) -> Self {
        Self::new(String::new(), "wrong_type", detail.to_string())
    }

    fn invalid_value(unexpected: Unexpected<'_>, expected: &dyn Expected) -> Self {
        Self::custom(format_args!("must be {expected}, not {unexpected}"))
    }

    fn missing_field(name: &'static str) -> Self {
        Self::new(token(name), "missing", "must be given")
    }

    fn unknown_field(name: &str, known: &'static [&'static str]) -> Self {
        let is_of_one_craft = ["asc", "goal"].iter().all(|member| known.contains(member));
        if is_of_one_craft && ["surface_craft", "hand_over_s"].contains(&name) {
            let detail = "only POST /v1/plan and /v1/plan/validate take a fleet: give one craft, as `asc`";
            return Self::new(token(name), "unknown_field", detail);
        }
        // Degrees become radians before members are read.
        let degrees =
            |name: &str| DIRECTIONS.iter().find(|[_, radians]| *radians == name).map(|[degrees, _]| *degrees);
        let known: Vec<_> = known.iter().flat_map(|&name| [Some(name), degrees(name)]).flatten().collect();
        let detail = format!("unknown member; known members are {}", listed(&known));
        Self::new(token(name), "unknown_field", detail)
    }

    fn unknown_variant(_: &str, known: &'static [&'static str]) -> Self {
        let one_of = if known.len() > 2 { "one of " } else { "" };
        let detail = format!("must be {one_of}{}", listed(known));
        Self::new(String::new(), "unknown_variant", detail)
    }
}

fn listed(names: &[&str]) -> String {
    let quoted: Vec<_> = names.iter().map(|name| format!("`{name}`")).collect();
    quoted.join(if names.len() == 2 { " or " } else { ", " })
}

/// A place in the tree at which a shape is read.
#[derive(Clone, Copy)]
pub(crate) struct Node<'a> {
    json: &'a Json<'a>,
    /// `true` for an item of a list of fixed length.
    in_fixed_list: bool,
    /// Tag of an object of several kinds and, after a space, a member that is read apart, if any;
    /// empty for other objects. Null members of such an object count as omitted.
    hidden: &'static str,
}

impl<'a> Node<'a> {
    pub(crate) fn whole(json: &'a Json<'a>) -> Self {
        Self { json, in_fixed_list: false, hidden: "" }
    }

    fn must_be<T>(self, expected: &str) -> Result<T, ShapeError> {
        let detail = format!("must be {expected}, not {}", self.json.name());
        Err(ShapeError::new(String::new(), "wrong_type", detail))
    }

    /// A whole number. One that the visitor refuses is too large, negative or a fraction.
    fn whole_number<'de, V: Visitor<'de>>(self, most: u64, visitor: V) -> Result<V::Value, ShapeError> {
        let expected = format!("a whole number from 0 to {most}");
        match self.json {
            Json::Number(number) => visit_number(number, visitor).map_err(|ShapeError(_)| {
                ShapeError::new(String::new(), "wrong_type", format!("must be {expected}"))
            }),
            _ => self.must_be(&expected),
        }
    }
}

fn visit_number<'de, V: Visitor<'de>>(number: &Number, visitor: V) -> Result<V::Value, ShapeError> {
    match (number.as_u64(), number.as_i64()) {
        (Some(whole), _) => visitor.visit_u64(whole),
        (None, Some(negative)) => visitor.visit_i64(negative),
        (None, None) => visitor.visit_f64(number.as_f64().expect("is neither whole nor arbitrarily precise")),
    }
}

impl<'de> IntoDeserializer<'de, ShapeError> for Node<'de> {
    type Deserializer = Self;

    fn into_deserializer(self) -> Self {
        self
    }
}

impl<'de> Deserializer<'de> for Node<'de> {
    type Error = ShapeError;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, ShapeError> {
        match self.json {
            Json::Null => visitor.visit_unit(),
            Json::Bool(value) => visitor.visit_bool(*value),
            Json::Number(number) => visit_number(number, visitor),
            Json::Text(text) => visitor.visit_str(text),
            Json::List(items) => visitor.visit_seq(Items::new(items, false)),
            Json::Object(members) => visitor.visit_map(Members::new(members, self.hidden)),
        }
    }

    fn deserialize_bool<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, ShapeError> {
        match self.json {
            Json::Bool(value) => visitor.visit_bool(*value),
            _ => self.must_be("true or false"),
        }
    }

    fn deserialize_f64<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, ShapeError> {
        match self.json {
            Json::Number(number) => visit_number(number, visitor),
            _ => self.must_be("a number"),
        }
    }

    fn deserialize_u32<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, ShapeError> {
        self.whole_number(u32::MAX.into(), visitor)
    }

    fn deserialize_u64<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, ShapeError> {
        self.whole_number(u64::MAX, visitor)
    }

    fn deserialize_str<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, ShapeError> {
        match self.json {
            Json::Text(text) => visitor.visit_str(text),
            _ => self.must_be("text"),
        }
    }

    fn deserialize_string<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, ShapeError> {
        self.deserialize_str(visitor)
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, ShapeError> {
        match self.json {
            Json::Null => visitor.visit_none(),
            _ => visitor.visit_some(self),
        }
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(
        self,
        name: &'static str,
        visitor: V,
    ) -> Result<V::Value, ShapeError> {
        let Some(hidden) = name.strip_prefix(TAGGED) else {
            return visitor.visit_newtype_struct(self);
        };
        if !matches!(self.json, Json::Object(_)) {
            return self.must_be("an object");
        }
        let apart = |name| Some((name, Self::whole(self.json.member(name)?)));
        let parts = [Some(("", Self { hidden, ..self })), hidden.split(' ').nth(1).and_then(apart)];
        visitor.visit_seq(Parts(parts.into_iter().flatten()))
    }

    fn deserialize_seq<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, ShapeError> {
        match self.json {
            Json::List(items) => visitor.visit_seq(Items::new(items, false)),
            _ => self.must_be("a list"),
        }
    }

    /// A list of fixed length: a point, a covariance, or a row of one.
    fn deserialize_tuple<V: Visitor<'de>>(self, n_items: usize, visitor: V) -> Result<V::Value, ShapeError> {
        let what = match (n_items, self.in_fixed_list) {
            (2, _) => "a point, a list of its north and east",
            (3, _) => "a corner of a track, a list of its time, north and east",
            (6, _) => "a past state, a list of its time, north, east, sigma, and velocity north and east",
            (23, _) => "a Gaussian of ranges, a list of its 23 numbers",
            (_, false) => "a symmetric positive semidefinite 4×4 matrix, a list of 4 rows",
            (_, true) => "a row of 4 numbers of a symmetric positive semidefinite 4×4 matrix",
        };
        let Json::List(items) = self.json else {
            return self.must_be(what);
        };
        let n_given = items.len();
        // A fault of an item comes first. Without a pointer, the fault is of the whole list.
        match visitor.visit_seq(Items::new(&items[..n_given.min(n_items)], true)) {
            Err(ShapeError(error)) if !error.pointer.is_empty() => Err(ShapeError(error)),
            Ok(list) if n_given == n_items => Ok(list),
            Ok(_) | Err(_) => {
                let detail = format!("must have {n_items} items, not {n_given}: {what}");
                let error = FieldError::new("", "length", detail).given(n_given);
                let limit = json!({ "least": n_items, "most": n_items });
                Err(ShapeError(Box::new(error.limit(limit))))
            }
        }
    }

    fn deserialize_map<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, ShapeError> {
        match self.json {
            Json::Object(members) => visitor.visit_map(Members::new(members, self.hidden)),
            _ => self.must_be("an object"),
        }
    }

    /// Lists are refused: order alone does not name members.
    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        _: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, ShapeError> {
        self.deserialize_map(visitor)
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _: &'static str,
        _: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, ShapeError> {
        match self.json {
            Json::Object(_) if !self.hidden.is_empty() => {
                visitor.visit_enum(MapAccessDeserializer::new(ByKind(self)))
            }
            Json::Text(text) => visitor.visit_enum(StrDeserializer::new(text)),
            _ => self.must_be("text"),
        }
    }

    /// A kind without members.
    fn deserialize_unit<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, ShapeError> {
        let Json::Object(members) = self.json else {
            return self.deserialize_any(visitor);
        };
        match Members::new(members, self.hidden).advance() {
            None => visitor.visit_unit(),
            Some((name, _)) => {
                let detail = "this kind has no such member";
                Err(ShapeError::new(token(name), "unknown_field", detail))
            }
        }
    }

    fn deserialize_ignored_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, ShapeError> {
        visitor.visit_unit()
    }

    forward_to_deserialize_any! {
        i8 i16 i32 i64 i128 u8 u16 u128 f32 char bytes byte_buf unit_struct tuple_struct identifier
    }
}

/// An object of one of several kinds, then the member that is read apart, with its name.
struct Parts<'a>(std::iter::Flatten<std::array::IntoIter<Option<(&'static str, Node<'a>)>, 2>>);

impl<'de> SeqAccess<'de> for Parts<'de> {
    type Error = ShapeError;

    fn next_element_seed<T: DeserializeSeed<'de>>(
        &mut self,
        seed: T,
    ) -> Result<Option<T::Value>, ShapeError> {
        let Some((name, node)) = self.0.next() else {
            return Ok(None);
        };
        let part = seed.deserialize(node).map(Some);
        part.map_err(|wrong| match name {
            "" => wrong,
            name => wrong.within(name),
        })
    }
}

/// An object of one of several kinds, as a map from its kind to the same object.
struct ByKind<'a>(Node<'a>);

impl<'de> MapAccess<'de> for ByKind<'de> {
    type Error = ShapeError;

    fn next_key_seed<K: DeserializeSeed<'de>>(&mut self, seed: K) -> Result<Option<K::Value>, ShapeError> {
        let tag = self.0.hidden.split(' ').next().unwrap_or_default();
        let kind = match self.0.json.given(tag) {
            None => return Err(de::Error::missing_field(tag)),
            Some(Json::Text(name)) => seed.deserialize(StrDeserializer::new(name)),
            Some(other) => Node::whole(other).must_be("text"),
        };
        kind.map(Some).map_err(|wrong| wrong.within(tag))
    }

    fn next_value_seed<V: DeserializeSeed<'de>>(&mut self, seed: V) -> Result<V::Value, ShapeError> {
        seed.deserialize(self.0)
    }
}

/// The items of a list, with their places.
struct Items<'a> {
    items: std::iter::Enumerate<std::slice::Iter<'a, Json<'a>>>,
    fixed: bool,
}

impl<'a> Items<'a> {
    fn new(items: &'a [Json<'a>], fixed: bool) -> Self {
        Self { items: items.iter().enumerate(), fixed }
    }
}

impl<'de> SeqAccess<'de> for Items<'de> {
    type Error = ShapeError;

    fn next_element_seed<T: DeserializeSeed<'de>>(
        &mut self,
        seed: T,
    ) -> Result<Option<T::Value>, ShapeError> {
        let Some((i, json)) = self.items.next() else {
            return Ok(None);
        };
        let node = Node { in_fixed_list: self.fixed, ..Node::whole(json) };
        seed.deserialize(node).map(Some).map_err(|wrong| wrong.within(&i.to_string()))
    }
}

/// The members of an object, with their names.
struct Members<'a> {
    rest: std::slice::Iter<'a, (Cow<'a, str>, Json<'a>)>,
    hidden: &'static str,
    /// The member whose name was read last.
    last: Option<&'a (Cow<'a, str>, Json<'a>)>,
}

impl<'a> Members<'a> {
    fn new(members: &'a [(Cow<'a, str>, Json<'a>)], hidden: &'static str) -> Self {
        Self { rest: members.iter(), hidden, last: None }
    }

    /// The next member that the shape may have.
    fn advance(&mut self) -> Option<&'a (Cow<'a, str>, Json<'a>)> {
        let hidden = self.hidden;
        let is_hidden = |name: &str| hidden.split(' ').any(|hidden| hidden == name);
        self.rest.find(|(name, json)| hidden.is_empty() || !(is_hidden(name) || matches!(json, Json::Null)))
    }
}

impl<'de> MapAccess<'de> for Members<'de> {
    type Error = ShapeError;

    fn next_key_seed<K: DeserializeSeed<'de>>(&mut self, seed: K) -> Result<Option<K::Value>, ShapeError> {
        self.last = self.advance();
        let name = self.last.map(|(name, _)| StrDeserializer::new(name));
        name.map(|name| seed.deserialize(name)).transpose()
    }

    fn next_value_seed<V: DeserializeSeed<'de>>(&mut self, seed: V) -> Result<V::Value, ShapeError> {
        let (name, json) = self.last.expect("a name is read before its value");
        seed.deserialize(Node::whole(json)).map_err(|wrong| wrong.within(name))
    }
}
