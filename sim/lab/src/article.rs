//! Pages of HTML that need no network.

use maud::{DOCTYPE, Markup, PreEscaped, html};

const STYLE: &str = include_str!("article.css");

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
