// Numbers over time, as columns that grow.

/** Rows of numbers ordered by time, stored as columns. */
export class Series {
  /** @param {string[]} names the first is the time */
  constructor(...names) {
    this.names = names;
    this.length = 0;
    /** @type {{ [name: string]: Float64Array }} */
    this.columns = Object.fromEntries(names.map((name) => [name, new Float64Array(64)]));
  }

  /** @param {string} name */
  column(name) {
    return this.columns[name];
  }

  get first() {
    return this.length ? this.columns[this.names[0]][0] : NaN;
  }

  get last() {
    return this.length ? this.columns[this.names[0]][this.length - 1] : NaN;
  }

  /**
   * Inserts a row in order of time, because reports come late. A row with an existing time replaces that row.
   * @param {number[]} values
   */
  push(...values) {
    const time = values[0];
    if (!Number.isFinite(time)) return;
    let at = this.length;
    if (at && time <= this.last) {
      at = this.indexAt(time);
      if (at < 0 || this.columns[this.names[0]][at] !== time) {
        at += 1;
        this.grow();
        for (const column of Object.values(this.columns)) column.copyWithin(at + 1, at, this.length);
        this.length += 1;
      }
    } else {
      this.grow();
      this.length += 1;
    }
    this.names.forEach((name, i) => { this.columns[name][at] = values[i] ?? NaN; });
  }

  grow() {
    if (this.length < this.columns[this.names[0]].length) return;
    for (const [name, column] of Object.entries(this.columns)) {
      const longer = new Float64Array(2 * column.length);
      longer.set(column);
      this.columns[name] = longer;
    }
  }

  /**
   * Index of the last row at `time` or before; −1 if there is none.
   * @param {number} time
   */
  indexAt(time) {
    const times = this.columns[this.names[0]];
    let low = -1, high = this.length - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (times[middle] <= time) low = middle; else high = middle - 1;
    }
    return low;
  }

  /**
   * The value at `time`, held from the previous row.
   * @param {string} name
   * @param {number} time
   */
  at(name, time) {
    const i = this.indexAt(time);
    return i < 0 ? NaN : this.columns[name][i];
  }
}
