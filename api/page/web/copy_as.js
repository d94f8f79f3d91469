// A request as a command or a program, for copying.

import { el, fill } from "./dom.js";

/** More hashes than follow any quote in `body`: fewer could end a Rust raw string. @param {string} body */
function hashesAround(body) {
  return "#".repeat(1 + Math.max(...Array.from(body.matchAll(/"(#*)/g), ([, hashes]) => hashes.length), 0));
}

/** @type {[string, (body: string, url: string) => string][]} */
const KINDS = [
  ["curl", (body, url) => `curl -s ${url}/v1/plan -H 'content-type: application/json' -d '${body.replaceAll("'", "'\\''")}'`],
  ["Python", (body, url) => `import json\nfrom pilotfish import Client\n\nsnapshot = json.loads(r"""${body.replaceAll('"""', '\\"\\"\\"')}""")\nwith Client(${JSON.stringify(url)}) as client:\n    plan = client.plan(snapshot)\nprint(plan["reference"])`],
  ["Rust", (body, url, hashes = hashesAround(body)) => `// [dependencies] serde_json = "1", ureq = { version = "3", features = ["json"] }\nfn main() -> Result<(), Box<dyn std::error::Error>> {\n    let snapshot = r${hashes}"${body}"${hashes};\n    let answer = ureq::post("${url}/v1/plan").content_type("application/json").send(snapshot)?;\n    let plan: serde_json::Value = answer.into_body().read_json()?;\n    println!("{}", plan["reference"]);\n    Ok(())\n}`],
];

/**
 * Buttons that copy the request `body`.
 * @param {() => string} body
 */
export function copyButtons(body) {
  const said = el("span", { class: "said", role: "status" });
  const shown = el("textarea", { class: "copy-shown", readOnly: true, hidden: true, rows: 6, "aria-label": "Text to copy" });
  const copy = async (/** @type {string} */ kind, /** @type {string} */ text) => {
    try {
      await navigator.clipboard.writeText(text);
      fill(said, `${kind}: copied`);
    } catch {
      // Without access to the clipboard the text is shown instead.
      shown.hidden = false;
      shown.value = text;
      shown.select();
      fill(said, `${kind}: copy the text below`);
    }
  };
  return el("span", { class: "row copy-as" }, "Copy as", KINDS.map(([kind, write]) => el("button", { type: "button", onclick: () => copy(kind, write(body(), location.origin)) }, kind)), said, shown);
}
