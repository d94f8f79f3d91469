// The line of a JSON pointer in a JSON text, so that an error is shown at its field.

/**
 * The line, from 0, of each value in `text`, by pointer, up to the first error in the text.
 * @param {string} text
 * @returns {Map<string, number>}
 */
export function linesByPointer(text) {
  /** @type {Map<string, number>} */
  const found = new Map();
  let at = 0, line = 0;
  const skip = () => {
    for (; at < text.length && " \t\r\n".includes(text[at]); at += 1) if (text[at] === "\n") line += 1;
  };
  const string = () => {
    const start = at;
    for (at += 1; at < text.length && text[at] !== '"'; at += 1) if (text[at] === "\\") at += 1;
    at += 1;
    try {
      return String(JSON.parse(text.slice(start, at)));
    } catch {
      return "";
    }
  };
  /** @param {string} pointer @returns {boolean} whether it was JSON */
  const value = (pointer) => {
    skip();
    found.set(pointer, line);
    const close = { "{": "}", "[": "]" }[text[at]];
    if (text[at] === '"') {
      string();
      return true;
    }
    if (!close) {
      const start = at;
      while (at < text.length && !" \t\r\n,]}".includes(text[at])) at += 1;
      return at > start;
    }
    at += 1;
    for (let i = 0; ; i += 1) {
      skip();
      if (at >= text.length) return false;
      if (text[at] === close) {
        at += 1;
        return true;
      }
      let key = String(i);
      if (close === "}") {
        if (text[at] !== '"') return false;
        key = string().replaceAll("~", "~0").replaceAll("/", "~1");
        skip();
        if (text[at] !== ":") return false;
        at += 1;
      }
      if (!value(`${pointer}/${key}`)) return false;
      skip();
      if (text[at] === ",") at += 1;
    }
  };
  value("");
  return found;
}

/**
 * The line of `pointer`, or of its nearest ancestor in the text.
 * @param {Map<string, number>} lines
 * @param {string} pointer
 */
export function lineOf(lines, pointer) {
  for (let around = pointer; ; around = around.slice(0, around.lastIndexOf("/"))) {
    const line = lines.get(around);
    if (line !== undefined) return line;
    if (!around) return 0;
  }
}
