// A table as CSV that comes in pieces, RFC 4180.

/** Reads the lines of one table. */
export class Table {
  constructor() {
    /** Column by name. @type {Map<string, number>} */
    this.header = new Map();
    this.open = "";
  }

  /**
   * The rows of some lines, each as a function from a column's name to its cell. The first line of all is the header.
   * @param {string[]} some
   */
  *rows(some) {
    for (const piece of some) {
      // A name may contain a line break: then its quotes are still open.
      const line = this.open ? `${this.open}\n${piece}` : piece;
      const quoted = line.includes('"');
      this.open = quoted && line.split('"').length % 2 === 0 ? line : "";
      if (!line || this.open) continue;
      const cells = quoted ? quotedCells(line) : line.split(",");
      if (this.header.size) yield (/** @type {string} */ name) => cells[this.header.get(name) ?? -1] ?? "";
      else cells.forEach((name, i) => this.header.set(name.trim(), i));
    }
  }
}

/** @param {string} line @returns {string[]} */
function quotedCells(line) {
  return Array.from(line.matchAll(/(?:^|,)(?:"((?:[^"]|"")*)"|([^,]*))/gs), ([, quoted, plain]) => quoted?.replaceAll('""', '"') ?? plain);
}
