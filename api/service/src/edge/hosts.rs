//! Protection against other sites: refuses requests from their pages, and requests for host names
//! that are not the service's.
//!
//! Any page can make a browser send requests to this machine. The browser names the page's site in
//! `Sec-Fetch-Site` or `Origin`. After DNS rebinding the browser sees one origin, but `Host` has
//! the page's name. Addresses in `Host` are safe: DNS cannot redirect them.

use std::{net::IpAddr, sync::Arc};

use axum::http::header::{HOST, HeaderName, ORIGIN};
use axum::http::uri::Authority;
use axum::http::{HeaderMap, HeaderValue, Method, Version};

use crate::edge::problem::Problem;

const SEC_FETCH_SITE: HeaderName = HeaderName::from_static("sec-fetch-site");
const SEC_FETCH_MODE: HeaderName = HeaderName::from_static("sec-fetch-mode");

/// Names by which clients may call the service, beside `localhost` and all addresses.
#[derive(Clone, Debug, Default)]
pub struct Hosts(Arc<[String]>);

impl Hosts {
    /// Hosts with those names.
    pub fn new(names: impl IntoIterator<Item = String>) -> Self {
        let known = |name: String| {
            let authority = name.parse::<Authority>();
            let host = authority.map_or(name, |authority| authority.host().to_owned());
            host.to_ascii_lowercase()
        };
        Self(names.into_iter().map(known).collect())
    }

    /// Fails if the request is for another host, or a page of another site sends it.
    pub(crate) fn check(
        &self,
        method: &Method,
        version: Version,
        headers: &HeaderMap,
    ) -> Result<(), Problem> {
        let mut given = headers.get_all(HOST).iter();
        let host = match (given.next(), given.next()) {
            (Some(host), None) => Some(host),
            (None, None) if version < Version::HTTP_11 => None,
            _ => return Err(Problem::HostHeader),
        };
        let parsed = |host: &HeaderValue| host.to_str().ok()?.parse::<Authority>().ok();
        let host = host.map(|host| parsed(host).ok_or(Problem::HostHeader)).transpose()?;
        if let Some(host) = &host
            && !self.knows(host.host())
        {
            return Err(Problem::UnknownHost(host.host().to_owned()));
        }
        from_here(method, headers, host.as_ref())
    }

    fn knows(&self, host: &str) -> bool {
        let host = host.to_ascii_lowercase();
        let address = host.trim_start_matches('[').trim_end_matches(']');
        host == "localhost" || address.parse::<IpAddr>().is_ok() || self.0.contains(&host)
    }
}

/// Fails if the browser reports a page of another site. Following a link is allowed.
fn from_here(method: &Method, headers: &HeaderMap, host: Option<&Authority>) -> Result<(), Problem> {
    let follows_link =
        method == Method::GET && headers.get(SEC_FETCH_MODE).is_some_and(|mode| mode == "navigate");
    if let Some(site) = headers.get(SEC_FETCH_SITE) {
        // Pages cannot set this header. It holds behind proxies, which may change `Host`.
        return if site == "same-origin" || site == "none" || follows_link {
            Ok(())
        } else {
            Err(Problem::CrossSite)
        };
    }
    if let Some(origin) = headers.get(ORIGIN) {
        let origin = origin.to_str().ok().and_then(|origin| origin.split_once("://"));
        let is_host = |origin| host.is_some_and(|host| host.as_str().eq_ignore_ascii_case(origin));
        if !origin.is_some_and(|(_, origin)| is_host(origin)) {
            return Err(Problem::CrossSite);
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn verdict(method: &Method, lines: &[(&'static str, &str)]) -> Result<(), Problem> {
        let mut headers = HeaderMap::new();
        for (name, value) in lines {
            headers.append(*name, value.parse().expect("is a value"));
        }
        Hosts::new(["Pilot.example:8443".to_owned()]).check(method, Version::HTTP_11, &headers)
    }

    #[test]
    fn foreign_host_names_are_refused_and_every_address_is_accepted() {
        for known in ["localhost:8080", "127.0.0.1:8080", "[::1]:8080", "192.168.7.2", "pilot.EXAMPLE:1"] {
            assert_eq!(verdict(&Method::GET, &[("host", known)]), Ok(()), "{known}");
        }
        for unknown in ["evil.example", "127.0.0.1.evil.example", "localhost.evil.example:8080"] {
            let refused = verdict(&Method::GET, &[("host", unknown)]);
            assert!(matches!(refused, Err(Problem::UnknownHost(_))), "{unknown}");
        }
    }

    #[test]
    fn requests_name_exactly_one_host_except_in_http_1_0() {
        assert_eq!(verdict(&Method::GET, &[]), Err(Problem::HostHeader));
        let twice = [("host", "localhost"), ("host", "localhost")];
        assert_eq!(verdict(&Method::GET, &twice), Err(Problem::HostHeader));
        assert_eq!(verdict(&Method::GET, &[("host", "a b")]), Err(Problem::HostHeader));
        let first = Hosts::default().check(&Method::GET, Version::HTTP_10, &HeaderMap::new());
        assert_eq!(first, Ok(()));
    }

    #[test]
    fn a_page_of_another_site_is_refused_in_every_browser() {
        let host = ("host", "127.0.0.1:8080");
        for told in [
            ("sec-fetch-site", "cross-site"),
            ("sec-fetch-site", "same-site"),
            ("origin", "http://evil.example"),
            ("origin", "http://127.0.0.1:9090"),
            ("origin", "null"),
        ] {
            for method in [Method::POST, Method::GET] {
                assert_eq!(verdict(&method, &[host, told]), Err(Problem::CrossSite), "{told:?}");
            }
        }
        for told in [
            ("sec-fetch-site", "same-origin"),
            ("sec-fetch-site", "none"),
            ("origin", "http://127.0.0.1:8080"),
        ] {
            assert_eq!(verdict(&Method::POST, &[host, told]), Ok(()), "{told:?}");
        }
        let link = [host, ("sec-fetch-site", "cross-site"), ("sec-fetch-mode", "navigate")];
        assert_eq!(verdict(&Method::GET, &link), Ok(()));
        assert_eq!(verdict(&Method::POST, &link), Err(Problem::CrossSite));
    }
}
