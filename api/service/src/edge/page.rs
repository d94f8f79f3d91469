//! The page at `/`, whose files are built into the program.

use std::sync::LazyLock;

use axum::Router;
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse as _, Response};
use axum::routing::get;

/// Hexadecimal digits of a file's tag: 128 bits.
const TAG_DIGITS: usize = 32;

/// A strong entity tag of each file, in their order.
static TAGS: LazyLock<Vec<HeaderValue>> = LazyLock::new(|| {
    let tag = |file: &page::File| {
        let digest = wire::sha256(file.content.as_bytes());
        let tag = HeaderValue::try_from(format!("\"{}\"", &digest[..TAG_DIGITS]));
        tag.expect("hexadecimal digits in quotes")
    };
    page::FILES.iter().map(tag).collect()
});

pub(crate) fn router<S: Clone + Send + Sync + 'static>() -> Router<S> {
    let files = page::FILES.iter().zip(&*TAGS);
    files.fold(Router::new(), |router, (file, tag)| {
        let answer = async move |headers: HeaderMap| answer(file, tag, &headers);
        router.route(file.path, get(answer))
    })
}

/// The file, or status 304 if the client has it.
fn answer(file: &'static page::File, tag: &'static HeaderValue, headers: &HeaderMap) -> Response {
    let tagged = [(header::ETAG, tag.clone())];
    if has_already(headers, tag) {
        return (StatusCode::NOT_MODIFIED, tagged).into_response();
    }
    let is = [(header::CONTENT_TYPE, file.media_type)];
    (tagged, is, file.content).into_response()
}

/// `true` if the client has the content with that `tag`, also weakened by a compressing proxy.
fn has_already(headers: &HeaderMap, tag: &HeaderValue) -> bool {
    let given = headers.get_all(header::IF_NONE_MATCH).iter();
    let mut given = given.filter_map(|value| value.to_str().ok()).flat_map(|list| list.split(','));
    given.any(|one| {
        let one = one.trim();
        one == "*" || one.strip_prefix("W/").unwrap_or(one).as_bytes() == tag.as_bytes()
    })
}

/// `true` for paths of the page's files, which tell nothing about missions.
pub(crate) fn has(path: &str) -> bool {
    page::FILES.iter().any(|file| file.path == path)
}
