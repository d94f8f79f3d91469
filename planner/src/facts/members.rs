//! Members of a JSON object whose kind a tag selects.
//!
//! serde's own tagged enums buffer the object and lose the place of an error. An object with all
//! members, each optional, keeps the place; these functions take the members of one kind from it.

use serde::de;

/// Takes a member that this kind needs.
pub(crate) fn needed<T, E: de::Error>(member: &mut Option<T>, name: &'static str) -> Result<T, E> {
    member.take().ok_or_else(|| E::missing_field(name))
}

/// A member that may be omitted.
pub(crate) trait Present {
    fn is_present(&self) -> bool;
}

impl<T> Present for Option<T> {
    fn is_present(&self) -> bool {
        self.is_some()
    }
}

impl<T> Present for Vec<T> {
    fn is_present(&self) -> bool {
        !self.is_empty()
    }
}

/// Defines the members of all kinds of `$choice`, which is `$name` in the schema. All but the tag
/// are optional; `none_left` fails with the first member that no kind took.
macro_rules! members {
    (
        $(#[$about:meta])*
        $members:ident of $choice:ident as $name:literal,
        $(#[$tag_about:meta])* $tag:ident: $kind:ident,
        $($(#[$member_about:meta])* $member:ident: $of:ty,)*
    ) => {
        $(#[$about])*
        #[derive(serde::Deserialize, utoipa::ToSchema)]
        #[serde(deny_unknown_fields)]
        struct $members {
            $(#[$tag_about])*
            $tag: $kind,
            $($(#[$member_about])* #[serde(default)] $member: $of,)*
        }

        impl $members {
            fn none_left<E: serde::de::Error>(&self) -> Result<(), E> {
                use crate::facts::members::Present as _;
                // The list of known members is empty: another kind has this member.
                $(if self.$member.is_present() {
                    return Err(E::unknown_field(stringify!($member), &[]));
                })*
                Ok(())
            }
        }

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
pub(crate) use members;
