// TOML as mechanism files use it: written as the library writes it, read with strings, numbers, lists and tables.
"use strict";

(function () {
  const number = value => (Number.isInteger(value) ? value.toFixed(1) : String(value));
  const text = value => JSON.stringify(value).replace(/\x7f/g, "\\u007f");

  function value(key, own) {
    if (typeof own === "boolean") return String(own);
    if (typeof own === "string") return text(own);
    if (typeof own === "number") return ["a", "b", "base", "link", "version"].includes(key) ? String(own) : number(own);
    if (Array.isArray(own)) return `[${own.map(one => value("", one)).join(", ")}]`;
    return `{ ${Object.entries(own).map(([name, part]) => `${name} = ${value(name, part)}`).join(", ")} }`;
  }

  /** The unit that the comment at the head of a file names, as `toToml` writes it in any language; null for any other comment. */
  Bench.unitOf = text => (/^# [^\s:]+: (mm|cm|m|in)\r?\n/.exec(text) || /^# lengths in (mm|cm|m|in)\r?\n/.exec(text) || [null, null])[1];

  /** Write a mechanism in the form of files as TOML; the lengths are in this unit, which a comment says. */
  Bench.toToml = (data, unit) => {
    const lines = [`# ${Bench.word("file.unit", { unit })}`];
    for (const key of ["format", "version", "graph", "pose", "input_range"]) {
      if (data[key] !== undefined) lines.push(`${key} = ${value(key, data[key])}`);
    }
    for (const key of ["joints", "drivers"]) {
      if (!data[key].length) lines.push(`${key} = []`);
    }
    for (const key of ["joints", "drivers"]) {
      for (const one of data[key]) {
        lines.push("", `[[${key}]]`, ...Object.entries(one).map(([name, part]) => `${name} = ${value(name, part)}`));
      }
    }
    if (data.link_names) {
      lines.push("", "[link_names]", ...Object.entries(data.link_names).map(([name, link]) => `${text(name)} = ${link}`));
    }
    if (Object.keys(data.points).length) {
      lines.push("", "[points]", ...Object.entries(data.points).map(([name, one]) => `${text(name)} = ${value("", one)}`));
    }
    return `${lines.join("\n")}\n`;
  };

  /** JSON in the form of files. */
  Bench.toJson = data => `${JSON.stringify(data, null, 1)}\n`;

  class Reader {
    constructor(source) { this.source = source; this.at = 0; this.depth = 0; }
    fault() {
      return new Bench.Fault("fault.file.toml", { line: this.source.slice(0, this.at).split("\n").length });
    }
    match(pattern) {
      pattern.lastIndex = this.at;
      const found = pattern.exec(this.source);
      if (found) this.at += found[0].length;
      return found;
    }
    blank() { this.match(/(?:[ \t\r\n]|#[^\n]*)*/y); }
    space() { this.match(/[ \t]*/y); }
    expect(letter) {
      if (this.source[this.at] !== letter) throw this.fault();
      this.at++;
    }
    end() {
      this.space();
      if (!this.match(/(?:#[^\n]*)?(?:\r?\n|$)/y)) throw this.fault();
    }

    key() {
      this.space();
      const bare = this.match(/[A-Za-z0-9_-]+/y);
      const name = bare ? bare[0] : this.string();
      this.space();
      return name;
    }
    string() {
      const plain = this.match(/'([^'\n]*)'/y);
      if (plain) return plain[1];
      const quoted = this.match(/"(?:[^"\\\n]|\\.)*"/y);
      if (!quoted) throw this.fault();
      const long = quoted[0].replace(/\\U([0-9a-fA-F]{8})/g, (all, code) => {
        const point = parseInt(code, 16);
        if (point > 0x10ffff) throw this.fault();
        return JSON.stringify(String.fromCodePoint(point)).slice(1, -1);
      });
      try { return JSON.parse(long.replace(/\\e/g, "\\u001b").replace(/\t/g, "\\t")); } catch { throw this.fault(); }
    }

    value() {
      if (++this.depth > 20) throw this.fault();
      const letter = this.source[this.at];
      const made = letter === "[" ? this.list() : letter === "{" ? this.inline()
        : letter === '"' || letter === "'" ? this.string() : this.word();
      this.depth--;
      return made;
    }
    word() {
      const found = this.match(/true\b|false\b|[+-]?\d[\d_]*(?:\.\d[\d_]*)?(?:[eE][+-]?\d[\d_]*)?(?![\w:.-])/y);
      if (!found) throw this.fault();
      if (found[0] === "true" || found[0] === "false") return found[0] === "true";
      return Number(found[0].replace(/_/g, ""));
    }
    list() {
      const found = [];
      this.expect("[");
      for (this.blank(); this.source[this.at] !== "]"; this.blank()) {
        if (found.length > 5000) throw this.fault();
        found.push(this.value());
        this.blank();
        if (this.source[this.at] !== "]") this.expect(",");
      }
      this.at++;
      return found;
    }
    inline() {
      const found = Object.create(null);
      this.expect("{");
      for (this.space(); this.source[this.at] !== "}"; this.space()) {
        this.pair(found);
        this.space();
        if (this.source[this.at] !== "}") this.expect(",");
      }
      this.at++;
      return found;
    }
    pair(into) {
      const name = this.key();
      this.expect("=");
      this.space();
      if (name in into) throw this.fault();
      into[name] = this.value();
    }

    /** One table of a header, at most two names deep: [points] or [points.P]; [[joints]] begins an entry. */
    header(top) {
      const many = Boolean(this.match(/\[\[/y));
      if (!many) this.expect("[");
      const names = [this.key()];
      while (this.source[this.at] === "." && names.length < 3) { this.at++; names.push(this.key()); }
      this.expect("]");
      if (many) this.expect("]");
      let here = top;
      names.forEach((name, k) => {
        const last = k === names.length - 1;
        if (!(name in here)) here[name] = many && last ? [] : Object.create(null);
        if (many && last) here[name].push(Object.create(null));
        here = here[name];
        if (Array.isArray(here)) here = here[here.length - 1];
        if (typeof here !== "object" || here === null || Object.getPrototypeOf(here) !== null) throw this.fault();
      });
      return here;
    }

    whole() {
      const top = Object.create(null);
      let here = top;
      for (this.blank(); this.at < this.source.length; this.blank()) {
        if (this.source[this.at] === "[") here = this.header(top);
        else this.pair(here);
        this.end();
      }
      return top;
    }
  }

  /** Plain values of a text in TOML; a `Fault` that names the line for anything else. */
  Bench.parseToml = source => {
    try { return new Reader(source).whole(); } catch (fault) {
      if (fault instanceof Bench.Fault) throw fault;
      throw new Bench.Fault("fault.file.toml", { line: 1 });
    }
  };
})();
