//! The page: draws missions, plans and reports in a browser. The service serves its files; a report
//! contains them all in one file.
//!
//! `web/` has the files: plain ES modules with types that `tsc` checks, one style sheet, no
//! library. A charting library would bring its own map, or none, and its own idea of time.
//!
//! A module begins with its imports, one line each and by name, and exports declarations. Declared
//! names are unique in all modules, so that [`one_file`] can join them.

use std::sync::LazyLock;

use serde_json::Value;

/// A file of the page.
#[derive(Clone, Copy, Debug)]
pub struct File {
    /// Its path in a service.
    pub path: &'static str,
    /// Its `Content-Type`.
    pub media_type: &'static str,
    /// Its text.
    pub content: &'static str,
}

/// A module with empty lines in place of comments: every line keeps its number.
fn without_comments(module: &str) -> String {
    let mut within = false;
    let code = module.lines().flat_map(|line| {
        let words = line.trim();
        let begins = within || words.starts_with("/**");
        let ends = words.ends_with("*/");
        // The rest of a comment's last line is code.
        let comment = within || words.starts_with("//") || begins && (ends || !words.contains("*/"));
        within = begins && !words.contains("*/");
        [if comment { "" } else { line }, "\n"]
    });
    code.collect()
}

const HTML: &str = "text/html; charset=utf-8";
const SCRIPT: &str = "text/javascript; charset=utf-8";
const STYLE: &str = "text/css; charset=utf-8";

macro_rules! module {
    ($name:literal) => {
        include_str!(concat!("../web/", $name, ".js"))
    };
}

macro_rules! files {
    ($($path:literal: $media_type:expr, $name:literal;)* modules: $($module:literal)*) => {
        LazyLock::new(|| vec![
            $(File { path: $path, media_type: $media_type, content: include_str!(concat!("../web/", $name)) },)*
            $(File {
                path: concat!("/", $module, ".js"),
                media_type: SCRIPT,
                content: without_comments(module!($module)).leak(),
            },)*
        ])
    };
}

/// The files of the page, its document first. Modules have no comments: a fifth of their bytes.
pub static FILES: LazyLock<Vec<File>> = files! {
    "/": HTML, "index.html";
    "/page.css": STYLE, "page.css";
    "/icon.svg": "image/svg+xml", "icon.svg";
    "/gallery.json": "application/json", "gallery.json";
    "/docs": HTML, "docs.html";
    "/docs.css": STYLE, "docs.css";
    modules:
    "address" "alarm" "app" "background" "beliefs" "bell" "chart" "chart_canvas" "compare" "comparison"
    "copy_as" "csv" "curves" "differences" "docs" "dom" "drawing" "editor" "explanation" "figure" "fleet"
    "fleet_recording" "fleet_strip" "format" "hand_over" "home" "journal" "lettering" "limits" "live" "map"
    "measure" "mission" "no_go_form" "order_draft" "order_form" "order_map" "orders" "picture" "plan"
    "plan_picture" "plan_tables" "playback" "pointers" "predictions" "recording" "route_form" "scores"
    "series" "service" "symbols" "theme" "thumbnail" "traffic" "visits"
};

/// Files that only comparisons, plans of a snapshot, live missions with orders, fleets and the API
/// documentation load.
pub const ON_DEMAND: [&str; 19] = [
    "/compare.js",
    "/comparison.js",
    "/copy_as.js",
    "/differences.js",
    "/editor.js",
    "/fleet.js",
    "/fleet_recording.js",
    "/fleet_strip.js",
    "/no_go_form.js",
    "/order_draft.js",
    "/order_form.js",
    "/order_map.js",
    "/plan.js",
    "/plan_picture.js",
    "/plan_tables.js",
    "/route_form.js",
    "/docs",
    "/docs.css",
    "/docs.js",
];

macro_rules! modules {
    ($($name:literal)*) => { [$(module!($name)),*] };
}

/// The modules of a report, each after its imports.
const OF_REPORTS: [&str; 32] = modules! {
    "dom" "format" "alarm" "theme" "series" "csv" "limits" "hand_over" "journal" "traffic" "recording"
    "scores" "playback" "background" "visits" "figure" "picture" "curves" "lettering" "symbols" "drawing"
    "measure" "map" "chart_canvas" "chart" "explanation" "beliefs" "mission" "differences" "comparison" "sheet"
    "report"
};

/// The policy for a page of one file: its own script and style, and nothing from elsewhere.
const POLICY: &str =
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:";

/// A page without other files and network: `report.js` shows `data` by its `kind`.
pub fn one_file(title: &str, data: &Value) -> String {
    let style = include_str!("../web/page.css");
    let script: String = OF_REPORTS.iter().copied().map(declarations).collect();
    let title = title.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
    // No text in it can end its element, or begin a comment.
    let data = data.to_string().replace('<', "\\u003c");
    format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"{POLICY}\">\n<title>{title}</title>\n\
         <style>\n{style}</style>\n</head>\n<body>\n<main id=\"main\" tabindex=\"-1\"></main>\n\
         <script type=\"application/json\" id=\"data\">{data}</script>\n\
         <script type=\"module\">\n{script}</script>\n</body>\n</html>\n"
    )
}

/// A module without imports and exports. It declares the same names.
fn declarations(module: &str) -> String {
    let module = without_comments(module);
    let lines = module.lines().filter(|line| !line.starts_with("import "));
    lines.flat_map(|line| [line.strip_prefix("export ").unwrap_or(line), "\n"]).collect()
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    /// Names that a module declares at its top level.
    fn declared(module: &str) -> impl Iterator<Item = &str> {
        module.lines().filter_map(|line| {
            let line = line.strip_prefix("export ").unwrap_or(line);
            let line = line.strip_prefix("async ").unwrap_or(line);
            let kinds = ["const ", "let ", "class ", "function* ", "function "];
            let rest = kinds.into_iter().find_map(|kind| line.strip_prefix(kind))?;
            let end = rest.find(|c: char| !c.is_alphanumeric() && c != '_' && c != '$');
            end.map(|end| &rest[..end])
        })
    }

    #[test]
    fn modules_of_a_report_declare_distinct_names() {
        let mut names = BTreeSet::new();
        for name in OF_REPORTS.into_iter().flat_map(declared) {
            assert!(names.insert(name), "{name} is declared twice");
        }
        assert!(names.contains("el"), "declarations are found");
    }

    #[test]
    fn modules_import_by_name_in_one_line_each_and_only_from_the_report() {
        let all: BTreeSet<&str> = OF_REPORTS.into_iter().flat_map(declared).collect();
        for module in OF_REPORTS {
            assert!(!declarations(module).contains("\nimport"), "imports stand on lines of their own");
            assert!(
                !module.contains(" as ") || !module.contains("import * as"),
                "no import has another name"
            );
            for line in module.lines().filter(|line| line.starts_with("import ")) {
                let (_, rest) = line.split_once('{').expect("imports by name");
                let (names, _) = rest.split_once('}').expect("in one line");
                for name in names.split(',').map(str::trim).filter(|name| !name.is_empty()) {
                    assert!(all.contains(name), "{name} is in no module of a report");
                }
            }
        }
    }

    #[test]
    fn a_module_is_served_without_comments_and_with_all_code() {
        let module = "// What it is.\n/** One line. */\nconst a = 1; // said\n  /**\n   * More.\n   */\n  /** @type {A} */ (b).c();\n";
        let lean = "\n\nconst a = 1; // said\n\n\n\n  /** @type {A} */ (b).c();\n";
        assert_eq!(without_comments(module), lean);
        for file in FILES.iter().filter(|file| file.media_type == SCRIPT) {
            let wrong = |line: &str| ["//", "* ", "/**"].iter().any(|start| line.starts_with(start));
            let left = file.content.lines().map(str::trim).find(|line| wrong(line) && !line.contains("*/ "));
            assert_eq!(left, None, "{}", file.path);
        }
    }

    #[test]
    fn no_text_of_a_report_becomes_markup() {
        let hostile = "</script><script>alert(1)</script><!--<img src=x onerror=alert(1)>";
        let page = one_file(hostile, &serde_json::json!({ "title": hostile }));
        assert!(!page.contains("<script>alert") && !page.contains("<img src=x") && !page.contains("<!--"));
        assert_eq!(page.matches("</script>").count(), 2, "the page's own");
    }
}
