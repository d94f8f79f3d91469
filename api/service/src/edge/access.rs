//! Access control: bearer tokens, each with a name and a role.
//!
//! A service without tokens serves every client. With tokens, every request needs one, except for
//! the page's files, the documentation and the probes.

use std::{net::IpAddr, sync::Arc};

use axum::Json;
use axum::extract::FromRequestParts;
use axum::http::request::Parts;
use axum::http::{HeaderMap, Method, header};
use clock::Clock;
use serde::Serialize;
use utoipa::ToSchema;

use store::AuditEntry;

use crate::edge::page;
use crate::edge::problem::{Problem, Refusals};
use crate::edge::request_id::RequestId;

mod tokens;

pub use crate::edge::role::{Role, TokenLimit};
pub use tokens::{NewToken, PREFIX as TOKEN_PREFIX, TokenError, TokenFile, Tokens};

/// The caller's role and limits.
#[derive(Clone, Debug, Serialize, ToSchema)]
pub(crate) struct Access {
    /// `read-only`, `operator` or `admin`.
    role: &'static str,
    /// Name of the caller's token, if the service requires tokens.
    caller: Option<String>,
    /// Missions and craft to which the caller's token is limited, if it is.
    #[serde(skip_serializing_if = "Option::is_none")]
    limit: Option<TokenLimit>,
    /// `true` if the service requires tokens.
    protected: bool,
}

/// Returns the caller's role and limits, by which a page shows only what is allowed.
#[utoipa::path(get, path = "/v1/access", tag = "service",
    responses((status = 200, description = "The caller's role.", body = Access), Refusals))]
pub(crate) async fn get_access(By { caller, .. }: By) -> Json<Access> {
    Json(Access {
        role: caller.role.name(),
        caller: caller.has_token.then(|| caller.name.to_string()),
        protected: caller.has_token,
        limit: caller.limit,
    })
}

pub(crate) const AUDIT: &str = "/v1/audit";

/// Address of the client of a connection. The server adds it to every request as an extension.
#[derive(Clone, Copy, Debug)]
pub struct Peer(pub IpAddr);

#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Caller {
    /// Name of the token, or the client's address if the service requires no tokens.
    pub(crate) name: Arc<str>,
    pub(crate) role: Role,
    pub(crate) limit: Option<TokenLimit>,
    pub(crate) has_token: bool,
}

impl Caller {
    /// The sender of a request. Fails if a token is required and `headers` have no valid one.
    pub(crate) fn of(
        tokens: Option<&Tokens>,
        peer: Option<Peer>,
        headers: &HeaderMap,
    ) -> Result<Self, Problem> {
        let Some((known, now)) = tokens.and_then(|tokens| Some((tokens.known()?, tokens.now()))) else {
            let name = peer.map_or("this program".to_owned(), |Peer(address)| address.to_string());
            return Ok(Self { name: name.into(), role: Role::Admin, limit: None, has_token: false });
        };
        let token = known.find(bearer(headers)?, now).ok_or(Problem::Unauthenticated)?;
        Ok(Self {
            name: token.name.as_str().into(),
            role: token.role,
            limit: token.limit.clone(),
            has_token: true,
        })
    }

    /// Fails if the caller's role or limit forbids the call for every mission.
    pub(crate) fn may(&self, method: &Method, path: &str) -> Result<(), Problem> {
        if let (AUDIT, Some(limit)) = (path, &self.limit) {
            return Err(Problem::Limited(limit.clone()));
        }
        let (needed, role) = (needed_role(method, path), self.role);
        if needed <= role {
            return Ok(());
        }
        Err(Problem::Forbidden { needed, role })
    }
}

/// The sender of an order, and its request.
pub(crate) struct By {
    clock: Clock,
    caller: Caller,
    request: String,
}

impl By {
    pub(crate) fn name(&self) -> Arc<str> {
        Arc::clone(&self.caller.name)
    }

    pub(crate) fn limit(&self) -> Option<&TokenLimit> {
        self.caller.limit.as_ref()
    }

    pub(crate) fn order(&self, action: &str) -> AuditEntry {
        AuditEntry {
            at_s: self.clock.unix_s(),
            caller: self.caller.name.to_string(),
            request: self.request.clone(),
            action: action.to_owned(),
        }
    }

    /// The caller's own `key`: equal keys of different callers are different.
    pub(crate) fn own(&self, key: &str) -> String {
        if self.caller.has_token { format!("{}\0{key}", self.caller.name) } else { key.to_owned() }
    }
}

impl<S: Send + Sync> FromRequestParts<S> for By {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<Self, Problem> {
        let known = &parts.extensions;
        let request = known.get().map(|RequestId(id)| id.clone());
        Ok(Self {
            clock: known.get().cloned().ok_or(Problem::Unauthenticated)?,
            caller: known.get().cloned().ok_or(Problem::Unauthenticated)?,
            request: request.unwrap_or_default(),
        })
    }
}

/// `true` for public paths, which tell nothing about missions.
pub(crate) fn is_public(path: &str) -> bool {
    page::has(path) || ["/livez", "/readyz", "/openapi.json"].contains(&path)
}

/// `true` for calls that change nothing, which every role may make.
pub(crate) fn changes_nothing(method: &Method, path: &str) -> bool {
    needed_role(method, path) == Role::ReadOnly
}

fn needed_role(method: &Method, path: &str) -> Role {
    let reads = method == Method::GET || method == Method::HEAD || method == Method::OPTIONS;
    if method == Method::DELETE || path == AUDIT {
        Role::Admin
    } else if reads || path == "/v1/routes" || path == "/v1/plan" || path.starts_with("/v1/plan/") {
        Role::ReadOnly
    } else {
        Role::Operator
    }
}

fn bearer(headers: &HeaderMap) -> Result<&str, Problem> {
    let mut given = headers.get_all(header::AUTHORIZATION).iter();
    let (Some(value), None) = (given.next(), given.next()) else {
        return Err(Problem::Unauthenticated);
    };
    let parts = value.to_str().ok().and_then(|value| value.split_once(' '));
    let parts = parts.filter(|(scheme, _)| scheme.eq_ignore_ascii_case("bearer"));
    let (_, token) = parts.ok_or(Problem::Unauthenticated)?;
    Ok(token.trim())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_call_needs_the_lowest_role_that_its_effect_allows() {
        for (method, path, needed) in [
            (Method::GET, "/v1/missions", Role::ReadOnly),
            (Method::GET, "/metrics", Role::ReadOnly),
            (Method::POST, "/v1/plan", Role::ReadOnly),
            (Method::POST, "/v1/plan/batch", Role::ReadOnly),
            (Method::POST, "/v1/routes", Role::ReadOnly),
            (Method::POST, "/v1/planned", Role::Operator),
            (Method::POST, "/v1/missions", Role::Operator),
            (Method::PATCH, "/v1/missions/m-1", Role::Operator),
            (Method::POST, "/v1/missions/m-1/reports", Role::Operator),
            (Method::DELETE, "/v1/missions/m-1", Role::Admin),
            (Method::GET, "/v1/audit", Role::Admin),
        ] {
            assert_eq!(needed_role(&method, path), needed, "{method} {path}");
        }
    }

    #[test]
    fn only_paths_without_facts_about_missions_are_public() {
        assert!(["/", "/livez", "/docs", "/docs.js", "/openapi.json"].into_iter().all(is_public));
        assert!(
            !["/v1/missions", "/metrics", "/v1/plan", "/docsx", "/docs/x", "//"].into_iter().any(is_public)
        );
    }
}
