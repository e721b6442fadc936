// A mechanism from outside (a file, an address) is looked at here before anything is made of it: known keys, bounded
// numbers, bounded sizes.  What is not a mechanism is a `Fault` with one sentence; nothing of the text is ever run.
"use strict";

(function () {
  const KINDS = {
    R: {}, P: { angle_a: 0, angle_b: 0 }, "pin-slot": { angle_a: 0 },
    gear: { radius_a: 1, radius_b: 1, internal: false, offset: 0 }, cam: { angle_a: 0, radius: 1, harmonics: [] },
  };
  const LAWS = {
    linear: { rate: 1, offset: 0 }, harmonic: { mean: 0, amplitude: 1, order: 1, phase: 0 },
    polynomial: { coefficients: [0, 1] }, table: { inputs: [], values: [] },
  };
  const KEYS = ["format", "version", "graph", "joints", "drivers", "points", "pose", "input_range", "link_names"];
  const LIST_MAX = 2000;

  const bad = (place, what, more = {}) => { throw new Bench.Fault(`fault.file.${what}`, { place, ...more }); };
  const short = value => (typeof value === "string" ? value : typeof value).slice(0, 40);

  function table(value, place, known) {
    if (typeof value !== "object" || value === null || Array.isArray(value)) bad(place, "table");
    if (known) for (const key of Object.keys(value)) if (!known.includes(key)) bad(place, "key", { key: short(key) });
    return value;
  }

  function list(value, place, most, length) {
    if (!Array.isArray(value)) bad(place, "list");
    if (value.length > most) bad(place, "many", { most });
    if (length !== undefined && value.length !== length) bad(place, "length", { length });
    return value;
  }

  function number(value, place) {
    if (typeof value !== "number" || !Number.isFinite(value) || Math.abs(value) > Bench.LIMITS.size) {
      bad(place, "number", { most: Bench.LIMITS.size });
    }
    return value;
  }

  function whole(value, place, most) {
    if (!Number.isInteger(value) || value < 0 || value >= most) bad(place, "link", { most: most - 1 });
    return value;
  }

  const numbers = (value, place, length) =>
    list(value, place, LIST_MAX, length).map((one, k) => number(one, `${place}[${k}]`));

  function positive(value, place) {
    if (!(number(value, place) > 0)) bad(place, "positive");
    return value;
  }

  /** Number of links and the frame of the text form of a graph; the joints are said again in the file. */
  function graph(text) {
    if (typeof text !== "string" || text.length > 4000) bad("graph", "graph");
    const [head, ...fields] = text.split(" "), code = head.charCodeAt(0) - 63;
    const links = code === 63 ? ((head.charCodeAt(1) - 63) << 12) + ((head.charCodeAt(2) - 63) << 6) +
      head.charCodeAt(3) - 63 : code;
    if (!(links >= 1)) bad("graph", "graph");
    if (links > Bench.LIMITS.links) bad("graph", "links", { links, most: Bench.LIMITS.links });
    const frame = /^f(\d{1,3})$/.exec(fields[0] || "");
    if (!frame) bad("graph", "frame");
    if (fields.some(field => field.startsWith("pi"))) bad("graph", "space");
    return { links, frame: whole(Number(frame[1]), "graph", links) };
  }

  function joint(value, place, links) {
    table(value, place);
    if (typeof value.kind !== "string" || !Object.hasOwn(KINDS, value.kind)) bad(place, "kind");
    const more = KINDS[value.kind];
    table(value, place, ["kind", "a", "b", "at_a", "at_b", ...Object.keys(more)]);
    const made = { kind: value.kind, a: whole(value.a, `${place}.a`, links), b: whole(value.b, `${place}.b`, links) };
    if (made.a === made.b) bad(place, "itself");
    for (const key of ["at_a", "at_b"]) {
      made[key] = Object.hasOwn(value, key) ? numbers(value[key], `${place}.${key}`, 2) : [0, 0];
    }
    for (const [key, usual] of Object.entries(more)) {
      const own = Object.hasOwn(value, key) ? value[key] : usual;
      if (typeof usual === "boolean") {
        if (typeof own !== "boolean") bad(`${place}.${key}`, "boolean");
        made[key] = own;
      } else if (Array.isArray(usual)) {
        made[key] = list(own, `${place}.${key}`, 1024).map((pair, k) => numbers(pair, `${place}.${key}[${k}]`, 2));
      } else made[key] = (key.startsWith("radius") ? positive : number)(own, `${place}.${key}`);
    }
    return made;
  }

  function law(value, place) {
    if (value === undefined) return { kind: "linear", ...LAWS.linear };
    table(value, place);
    if (typeof value.kind !== "string" || !Object.hasOwn(LAWS, value.kind)) bad(place, "law");
    const usual = LAWS[value.kind], made = { kind: value.kind };
    table(value, place, ["kind", ...Object.keys(usual)]);
    for (const [key, own] of Object.entries(usual)) {
      const given = Object.hasOwn(value, key) ? value[key] : own;
      made[key] = Array.isArray(own) ? numbers(given, `${place}.${key}`) : number(given, `${place}.${key}`);
    }
    if (made.kind === "polynomial" && !made.coefficients.length) bad(place, "law");
    if (made.kind === "table" && (made.inputs.length < 2 || made.inputs.length !== made.values.length ||
        made.inputs.some((one, k) => k && one <= made.inputs[k - 1]))) bad(place, "law");
    return made;
  }

  const named = name => {
    if (!name || name.length > Bench.LIMITS.name) bad("points", "name", { most: Bench.LIMITS.name });
    return name;
  };

  /** A mechanism in the form of files, every number looked at and every default put in. */
  Bench.checked = data => {
    table(data, "top", KEYS);
    if (data.format !== "graphsynth mechanism") bad("format", "format");
    if (data.version !== 1) bad("version", "version");
    const { links, frame } = graph(data.graph);
    const joints = list(data.joints, "joints", 3 * Bench.LIMITS.pairs).map((one, k) => joint(one, `joints[${k}]`, links));
    const pairs = new Set(joints.map(one => `${Math.min(one.a, one.b)}-${Math.max(one.a, one.b)}`));
    if (pairs.size < joints.length) bad("joints", "twice");
    const drivers = list(data.drivers === undefined ? [] : data.drivers, "drivers", joints.length).map((one, k) => {
      const place = `drivers[${k}]`;
      table(one, place, ["base", "link", "law"]);
      return { base: whole(one.base, place, links), link: whole(one.link, place, links), law: law(one.law, `${place}.law`) };
    });
    const points = Object.entries(table(data.points === undefined ? {} : data.points, "points"));
    if (points.length > Bench.LIMITS.points) bad("points", "many", { most: Bench.LIMITS.points });
    const places = points.map(([name, one]) => {
      table(one, "points", ["link", "at"]);
      return { name: named(name), link: whole(one.link, "points", links), at: numbers(one.at, "points", 2) };
    });
    if (data.pose === undefined && links > 1) bad("pose", "pose");
    const pose = list(data.pose === undefined ? [[0, 0, 0]] : data.pose, "pose", links, links)
      .map((row, k) => numbers(row, `pose[${k}]`, 3));
    if (pose[frame].some(value => value !== 0)) bad("pose", "still");
    const range = data.input_range === undefined ? null : numbers(data.input_range, "input_range", 2);
    const names = Object.entries(table(data.link_names === undefined ? {} : data.link_names, "link_names"))
      .map(([name, link]) => [named(name), whole(link, "link_names", links)]);
    return { links, frame, joints, drivers, points: places, pose, range, names };
  };

  /** A mechanism from the text of a file, JSON or TOML. */
  Bench.fromText = text => {
    if (text.length > 400000) throw new Bench.Fault("fault.file.long", { most: 400000 });
    const plain = text.replace(/^\ufeff/, "");
    let data;
    if (/^\s*\{/.test(plain)) {
      try { data = JSON.parse(plain); } catch { throw new Bench.Fault("fault.file.json"); }
    } else data = Bench.parseToml(plain);
    return Bench.opened(Bench.checked(data));
  };
})();
