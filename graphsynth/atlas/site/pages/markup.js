// The one way from data to markup: everything put into a template is escaped, unless it is markup itself.
"use strict";

(function () {
  /** Text as markup that shows it. */
  Atlas.plain = text => String(text).replace(/[&<>"'`]/g, c => `&#${c.charCodeAt(0)};`);

  class Markup {
    constructor(text) { this.text = text; }
    toString() { return this.text; }
  }

  function piece(value) {
    if (value instanceof Markup) return value.text;
    if (Array.isArray(value)) return value.map(piece).join("");
    return value === null || value === undefined || value === false ? "" : Atlas.plain(value);
  }

  /** html`<b>${anything}</b>`: markup; lists are joined, nothing is shown of null, undefined and false. */
  Atlas.html = (strings, ...values) => new Markup(strings.reduce((made, next, k) => made + piece(values[k - 1]) + next));

  /** SVG that this page has drawn, of numbers and escaped titles, as markup. */
  Atlas.drawn = svg => new Markup(svg || "");
})();
