// Words of the page in the reader's language, and sentences about faults.  Every text that is shown comes from here.
"use strict";
var Bench = globalThis.Bench = globalThis.Bench || {};

(function () {
  const tables = {};
  let language = "en";

  /** What menus, buttons and keys do, by name. */
  Bench.do = {};

  /** Take the words of a language; the page and its tests hand them in. */
  Bench.words = (name, table) => { tables[name] = table; };
  Bench.languages = () => Object.keys(tables);
  Bench.language = () => language;
  Bench.speak = name => { if (Object.hasOwn(tables, name)) language = name; };

  /** A text by its key, with {names} replaced by values. */
  Bench.word = (key, values = {}) => {
    const own = tables[language] || {}, text = Object.hasOwn(own, key) ? own[key] : key;
    return text.replace(/\{(\w+)\}/g, (all, name) => (Object.hasOwn(values, name) ? String(values[name]) : all));
  };

  /** A unit as it is written in the reader's language; what is no length ("°") as it is. */
  Bench.unitName = unit => (Bench.UNITS.includes(unit) ? Bench.word(`unit.${unit}`) : unit);

  /** The kind of a joint in the reader's language; R and P are signs. */
  Bench.kindName = kind => (["pin-slot", "gear", "cam"].includes(kind) ? Bench.word(`kind.${kind}`) : kind);

  /** What a user can mend: the key of a sentence and its values. */
  Bench.Fault = class extends Error {
    constructor(key, values = {}) {
      super(key);
      this.key = key;
      this.values = values;
    }
    get sentence() { return Bench.word(this.key, this.values); }
  };

  /** A number as it is shown: at most so many digits, no tail of zeros. */
  Bench.shown = (value, digits = 6) => String(Number(Number(value).toPrecision(digits))).replace("-", "−");
})();
