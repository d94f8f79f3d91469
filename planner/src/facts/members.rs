//! Members of a JSON object of which a tag says which belong there.
//!
//! serde's own tagged enums buffer the object and lose where in it an error is. An object with all members, each of which
//! may be left out, keeps that; these functions take the members of one kind out of it.

use serde::de;

/// A member that this kind needs.
pub(crate) fn needed<T, E: de::Error>(member: &mut Option<T>, name: &'static str) -> Result<T, E> {
    member.take().ok_or_else(|| E::missing_field(name))
}

/// Fails with the first of these members that is there: this kind has none of them. No known member is listed, which tells
/// readers that another kind has it.
pub(crate) fn none_left<E: de::Error>(members: &[(&str, bool)]) -> Result<(), E> {
    match members.iter().find(|(_, is_left)| *is_left) {
        Some((name, _)) => Err(E::unknown_field(name, &[])),
        None => Ok(()),
    }
}

/// The schema of `$members`, the object with the members of every kind, for the enum that is read from it.
macro_rules! schema_of {
    ($choice:ty: $members:ty, $name:literal) => {
        impl utoipa::PartialSchema for $choice {
            fn schema() -> utoipa::openapi::RefOr<utoipa::openapi::schema::Schema> {
                <$members as utoipa::PartialSchema>::schema()
            }
        }

        impl utoipa::ToSchema for $choice {
            fn name() -> std::borrow::Cow<'static, str> {
                $name.into()
            }

            fn schemas(
                schemas: &mut Vec<(
                    String,
                    utoipa::openapi::RefOr<utoipa::openapi::schema::Schema>,
                )>,
            ) {
                <$members as utoipa::ToSchema>::schemas(schemas);
            }
        }
    };
}
pub(crate) use schema_of;
