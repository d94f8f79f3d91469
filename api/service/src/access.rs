//! Who may do what: bearer tokens, each with a name and a role.
//!
//! A service for which no token was made serves every client. One with tokens asks every request for one, but for
//! the page's own files, the documentation, and whether the service lives.

use std::{fmt, net::IpAddr, sync::Arc};

use axum::{
    Extension, Json,
    extract::FromRequestParts,
    http::{HeaderMap, Method, header, request::Parts},
};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::{
    edge::RequestId,
    missions::unix_now,
    page,
    problem::{Problem, Refusals},
    store::Order,
};

mod tokens;

pub use tokens::{NewToken, PREFIX as TOKEN_PREFIX, TokenError, TokenFile, Tokens};

/// What a client may do. Each may do what those before it may.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Role {
    /// Ask for plans and see missions and campaigns; change nothing.
    ReadOnly,
    /// Make missions, run them and report to them; post and cancel campaigns.
    Operator,
    /// Delete missions and campaigns, and see who changed what.
    Admin,
}

impl Role {
    /// Every role, the least one first.
    pub const ALL: [Self; 3] = [Self::ReadOnly, Self::Operator, Self::Admin];

    /// Its name in files, on the command line and in answers.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::ReadOnly => "read-only",
            Self::Operator => "operator",
            Self::Admin => "admin",
        }
    }

    /// The role that a call needs.
    fn needed(method: &Method, path: &str) -> Self {
        let reads = method == Method::GET || method == Method::HEAD || method == Method::OPTIONS;
        if method == Method::DELETE || path == AUDIT {
            Self::Admin
        } else if reads || path == "/v1/plan" || path.starts_with("/v1/plan/") {
            Self::ReadOnly
        } else {
            Self::Operator
        }
    }
}

impl fmt::Display for Role {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// What the client that asks may do.
#[derive(Clone, Debug, Serialize, ToSchema)]
pub(crate) struct Access {
    /// `read-only`, `operator` or `admin`.
    role: &'static str,
    /// Name of the client's token; none where the service asks for none.
    caller: Option<String>,
    /// Whether the service asks for tokens.
    protected: bool,
}

/// What the client that asks may do: a page shows what can be ordered, before it is.
#[utoipa::path(get, path = "/v1/access", tag = "service",
    responses((status = 200, description = "Its role.", body = Access), Refusals))]
pub(crate) async fn get_access(By { caller, .. }: By) -> Json<Access> {
    Json(Access {
        role: caller.role.name(),
        caller: caller.has_token.then(|| caller.name.to_string()),
        protected: caller.has_token,
    })
}

/// Path of the list of who changed what.
pub(crate) const AUDIT: &str = "/v1/audit";

/// Address of the client that a connection comes from. The socket's owner gives it to every request as an extension.
#[derive(Clone, Copy, Debug)]
pub struct Peer(pub IpAddr);

/// Who sends a request.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Caller {
    /// Name of the token, or the address where none is asked for.
    pub(crate) name: Arc<str>,
    pub(crate) role: Role,
    /// Whether it is known by a token.
    pub(crate) has_token: bool,
}

impl Caller {
    /// Who sends a request with these `headers`. Fails if no valid token is in them and one is needed.
    pub(crate) fn of(
        tokens: Option<&Tokens>,
        peer: Option<Peer>,
        headers: &HeaderMap,
    ) -> Result<Self, Problem> {
        match tokens.and_then(Tokens::known) {
            Some(tokens) => tokens.caller(bearer(headers)?),
            None => Ok(Self {
                name: peer.map_or_else(
                    || "this program".into(),
                    |Peer(address)| address.to_string().into(),
                ),
                role: Role::Admin,
                has_token: false,
            }),
        }
    }

    /// Fails if the caller may not make that call.
    pub(crate) fn may(&self, method: &Method, path: &str) -> Result<(), Problem> {
        let needed = Role::needed(method, path);
        if needed <= self.role {
            return Ok(());
        }
        Err(Problem::Forbidden {
            needed,
            role: self.role,
        })
    }
}

/// Who gives an order, and in which request.
pub(crate) struct By {
    caller: Caller,
    request: String,
}

impl By {
    /// Name of the client's token, or its address.
    pub(crate) fn name(&self) -> Arc<str> {
        Arc::clone(&self.caller.name)
    }

    /// The order to do that, given now.
    pub(crate) fn order(&self, action: &str) -> Order {
        Order {
            at_s: unix_now(),
            caller: self.caller.name.to_string(),
            request: self.request.clone(),
            action: action.to_owned(),
        }
    }

    /// The client's name for a request, which is another client's name for another request.
    pub(crate) fn own(&self, key: &str) -> String {
        if self.caller.has_token {
            format!("{}\0{key}", self.caller.name)
        } else {
            key.to_owned()
        }
    }
}

impl<S: Send + Sync> FromRequestParts<S> for By {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<Self, Problem> {
        let Extension(caller) = Extension::from_request_parts(parts, &())
            .await
            .map_err(|_| Problem::Unauthenticated)?;
        let request = parts.extensions.get().map(|RequestId(id)| id.clone());
        Ok(Self {
            caller,
            request: request.unwrap_or_default(),
        })
    }
}

/// Whether everyone may read what is there: nothing of any mission.
pub(crate) fn is_public(path: &str) -> bool {
    const PUBLIC: [&str; 4] = ["/livez", "/readyz", "/openapi.json", "/docs"];
    page::has(path) || PUBLIC.contains(&path) || path.starts_with("/docs/")
}

/// The token of a request.
fn bearer(headers: &HeaderMap) -> Result<&str, Problem> {
    let mut given = headers.get_all(header::AUTHORIZATION).iter();
    let (Some(value), None) = (given.next(), given.next()) else {
        return Err(Problem::Unauthenticated);
    };
    value
        .to_str()
        .ok()
        .and_then(|value| value.split_once(' '))
        .filter(|(scheme, _)| scheme.eq_ignore_ascii_case("bearer"))
        .map(|(_, token)| token.trim())
        .ok_or(Problem::Unauthenticated)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_call_needs_the_least_role_that_its_effect_allows() {
        for (method, path, needed) in [
            (Method::GET, "/v1/missions", Role::ReadOnly),
            (Method::GET, "/metrics", Role::ReadOnly),
            (Method::POST, "/v1/plan", Role::ReadOnly),
            (Method::POST, "/v1/plan/batch", Role::ReadOnly),
            (Method::POST, "/v1/planned", Role::Operator),
            (Method::POST, "/v1/missions", Role::Operator),
            (Method::POST, "/v1/campaigns", Role::Operator),
            (Method::POST, "/v1/campaigns/c-1/cancel", Role::Operator),
            (Method::GET, "/v1/campaigns/c-1/report", Role::ReadOnly),
            (Method::DELETE, "/v1/campaigns/c-1", Role::Admin),
            (Method::PATCH, "/v1/missions/m-1", Role::Operator),
            (Method::POST, "/v1/missions/m-1/reports", Role::Operator),
            (Method::DELETE, "/v1/missions/m-1", Role::Admin),
            (Method::GET, "/v1/audit", Role::Admin),
        ] {
            assert_eq!(Role::needed(&method, path), needed, "{method} {path}");
        }
    }

    #[test]
    fn only_what_says_nothing_of_missions_is_public() {
        assert!(
            ["/", "/livez", "/docs", "/docs/ui.js", "/openapi.json"]
                .into_iter()
                .all(is_public)
        );
        assert!(
            !["/v1/missions", "/metrics", "/v1/plan", "/docsx", "//"]
                .into_iter()
                .any(is_public)
        );
    }
}
