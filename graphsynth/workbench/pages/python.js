// The drawing as Python that makes the same mechanism with the library.
"use strict";

(function () {
  const number = value => (Number.isInteger(value) ? value.toFixed(1) : String(value));
  const pair = point => `(${number(point.x)}, ${number(point.y)})`;
  const text = JSON.stringify;

  /** Whether `Mechanism.from_points` says all of it: pins alone, each about its first link, one plain driver. */
  function plain(sheet) {
    const points = Object.entries(sheet.points), [first] = Object.keys(sheet.links), law = sheet.drivers.map(d => d.law);
    const unnamed = Object.values(sheet.links).every(link => !link.name);
    const pinned = points.every(([id, point]) => {
      const star = Bench.linksAt(sheet, id);
      return !point.tree || JSON.stringify(Bench.pinsAt(sheet, id)) === JSON.stringify(star.slice(1).map(other => [star[0], other]));
    });
    return first === Bench.GROUND && unnamed && pinned && !sheet.range && Object.keys(sheet.pairs).length === 0 &&
      sheet.drivers.length === 1 && law.every(own => own.kind === "linear" && own.rate === 1 && own.offset === 0) &&
      Object.values(sheet.links).every((link, k) => link.points.length > (k ? 1 : 0)) &&
      points.every(([id, point]) => point.trace === false || Bench.linksAt(sheet, id).length > 0);
  }

  function fromPoints(sheet) {
    const name = id => text(sheet.points[id].name), ids = Object.keys(sheet.links);
    const list = link => `[${sheet.links[link].points.map(name).join(", ")}]`;
    const traced = Object.keys(sheet.points).filter(id => sheet.points[id].trace && Bench.linksAt(sheet, id).length > 1);
    const [driver] = sheet.drivers, where = own => ids.indexOf(own);
    return [
      "mechanism = Mechanism.from_points(",
      `    {${Object.values(sheet.points).map(point => `${text(point.name)}: ${pair(point)}`).join(", ")}},`,
      `    links=[${ids.slice(1).map(list).join(", ")}],`,
      `    frame=${list(Bench.GROUND)},`,
      `    driver=(${where(driver.base)}, ${where(driver.link)}),`,
      ...(traced.length ? [`    trace=[${traced.map(name).join(", ")}],`] : []),
      ")",
    ];
  }

  const python = value => {
    if (value === true || value === false) return value ? "True" : "False";
    if (typeof value === "number") return Number.isInteger(value) ? String(value) : number(value);
    if (typeof value === "string") return text(value);
    if (Array.isArray(value)) return `[${value.map(python).join(", ")}]`;
    return `{${Object.entries(value).map(([key, own]) => `${text(key)}: ${python(own)}`).join(", ")}}`;
  };

  function fromFile(sheet) {
    const { joints, ...rest } = Bench.written(sheet), lines = ["mechanism = from_dict({"];
    for (const [key, value] of Object.entries(rest)) lines.push(`    ${text(key)}: ${python(value)},`);
    lines.push("    \"joints\": [", ...joints.map(joint => `        ${python(joint)},`), "    ],", "})");
    return lines;
  }

  /** Lines of Python: the mechanism, its motion, and a picture of it. */
  Bench.toPython = sheet => {
    const short = plain(sheet), moves = sheet.drivers.length > 0;
    const lines = [short ? "from graphsynth import Mechanism" : "from graphsynth.mechanism.files import from_dict", "",
      ...(short ? fromPoints(sheet) : fromFile(sheet))];
    if (moves) lines.push("motion = mechanism.simulate()", "print(motion)", "motion.animate(\"mechanism.html\")");
    else lines.push("mechanism.draw(\"mechanism.svg\")");
    return `${lines.join("\n")}\n`;
  };
})();
