// Elements of the page from names, attributes and texts.  Nothing is ever parsed as markup.
"use strict";

(function () {
  /** An element: attributes by name; "on" holds listeners; texts are texts. */
  Bench.make = (name, { on = {}, ...attributes } = {}, ...children) => {
    const made = document.createElement(name);
    for (const [key, value] of Object.entries(attributes)) {
      if (value === true) made.setAttribute(key, "");
      else if (value !== false && value !== null && value !== undefined) made.setAttribute(key, value);
    }
    for (const [event, listener] of Object.entries(on)) made.addEventListener(event, listener);
    made.append(...children.filter(child => child !== null && child !== undefined && child !== false));
    return made;
  };
  const make = Bench.make;

  Bench.button = (key, act, more = {}) => make("button", { type: "button", on: { click: act }, ...more }, Bench.word(key));

  /** A labelled field; `take` gets its text, and a `Fault` of it is said and put back. */
  Bench.field = (app, key, value, take, { unit = "", type = "text" } = {}) => {
    const input = make("input", { type, value, inputmode: type === "text" && unit ? "decimal" : null, autocomplete: "off", spellcheck: "false" });
    input.addEventListener("change", () => {
      try { if (take(input.value) === false) input.value = value; } catch (fault) {
        if (!(fault instanceof Bench.Fault)) throw fault;
        app.fault(fault);
        input.value = value;
      }
    });
    return make("label", { class: "field" }, make("span", {}, Bench.word(key)), input, unit ? make("i", {}, Bench.unitName(unit)) : null);
  };

  Bench.check = (key, on, take, values) => {
    const input = make("input", { type: "checkbox", checked: on, on: { change: () => take(input.checked) } });
    return make("label", { class: "check" }, input, Bench.word(key, values));
  };

  Bench.choice = (key, value, all, take) => {
    const select = make("select", { on: { change: () => take(select.value) } },
      ...all.map(([own, text]) => make("option", { value: own, selected: own === value }, text)));
    return make("label", { class: "field" }, make("span", {}, Bench.word(key)), select);
  };

  /** Fill a place anew; the control that had the focus, or that stands there now, has it still. */
  Bench.refill = (place, ...children) => {
    const controls = () => [...place.querySelectorAll("input,select,button")], at = controls().indexOf(document.activeElement);
    place.replaceChildren(...children.filter(Boolean));
    if (at >= 0) controls()[at]?.focus({ preventScroll: true });
  };

  /** Rows of a name and a value. */
  Bench.rows = pairs => make("dl", {}, ...pairs.flatMap(([name, value]) =>
    [make("div", {}, make("dt", {}, name), make("dd", {}, value))]));
})();
