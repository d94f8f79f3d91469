//! Pages of HTML that need no network.

use maud::{DOCTYPE, Markup, PreEscaped, html};

/// What the browser holds a page of one file to: its own script and style, and nothing from anywhere.
const POLICY: &str = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'";

const STYLE: &str = include_str!("page.css");

/// A page that needs no other file, with a style of its own.
pub(crate) fn one_file(title: &str, style: &str, body: &Markup) -> String {
    let head = html! {
        meta http-equiv="Content-Security-Policy" content=(POLICY);
        style { (PreEscaped(STYLE)) (PreEscaped(style)) }
    };
    whole(title, &head, body)
}

/// A text with pictures that lie beside it.
pub(crate) fn article(title: &str, body: &Markup) -> String {
    let head = html! { style { (PreEscaped(STYLE)) } };
    whole(title, &head, &html! { main.article { (body) } })
}

fn whole(title: &str, head: &Markup, body: &Markup) -> String {
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width";
                title { (title) }
                (head)
            }
            body { (body) }
        }
    };
    page.into_string() + "\n"
}
