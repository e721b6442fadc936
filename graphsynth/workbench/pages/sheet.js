// The drawing: points, links through points, pairs that slide or roll, drivers.  A sheet is never changed; every
// function returns a new one.  Where links share a point they are jointed by a revolute joint; link "l0" is the frame.
// All coordinates of joints are counted from the drawn position.
"use strict";

(function () {
  const GROUND = "l0";
  const LIMITS = { points: 400, links: 64, pairs: 100, size: 1e7, name: 40 };
  const UNIT_SIZE = { mm: 1, cm: 10, m: 1000, in: 25.4 }, UNITS = Object.keys(UNIT_SIZE);
  Bench.GROUND = GROUND;
  Bench.LIMITS = LIMITS;
  Bench.UNITS = UNITS;
  Bench.UNIT_SIZE = UNIT_SIZE;

  Bench.empty = () => ({
    unit: "mm", next: 1, points: {}, links: { [GROUND]: { points: [], name: "" } }, pairs: {}, drivers: [], range: null,
  });

  /** The smallest name A, B, ... Z, A1, ... that no point has. */
  function freeName(sheet) {
    const taken = new Set(Object.values(sheet.points).map(point => point.name));
    for (let k = 0; ; k++) {
      const name = String.fromCharCode(65 + (k % 26)) + (k >= 26 ? Math.floor(k / 26) : "");
      if (!taken.has(name)) return name;
    }
  }
  Bench.freeName = freeName;

  const bounded = value => {
    if (!Number.isFinite(value) || Math.abs(value) > LIMITS.size) {
      throw new Bench.Fault("fault.number", { value, most: LIMITS.size });
    }
    return value;
  };

  function room(sheet, kind) {
    if (Object.keys(sheet[kind]).length >= LIMITS[kind]) {
      throw new Bench.Fault("fault.full", { what: Bench.word(`name.${kind}`), most: LIMITS[kind] });
    }
  }

  /** A new point; returns [sheet, id]. */
  Bench.withPoint = (sheet, x, y, more = {}) => {
    room(sheet, "points");
    const id = `p${sheet.next}`, point = { x: bounded(x), y: bounded(y), name: more.name || freeName(sheet), trace: false };
    return [{ ...sheet, next: sheet.next + 1, points: { ...sheet.points, [id]: { ...point, ...more } } }, id];
  };

  /** A new link through points; returns [sheet, id]. */
  Bench.withLink = (sheet, points, name = "") => {
    room(sheet, "links");
    const id = `l${sheet.next}`, own = [...new Set(points)];
    checkShared(sheet, id, own);
    return [{ ...sheet, next: sheet.next + 1, links: { ...sheet.links, [id]: { points: own, name } } }, id];
  };

  /** A new pair: {kind: "P" | "pin-slot" | "gear" | "cam", a, b, at, ...}; returns [sheet, id]. */
  Bench.withPair = (sheet, pair) => {
    room(sheet, "pairs");
    if (pair.a === pair.b) throw new Bench.Fault("fault.itself");
    if (Bench.joined(sheet, pair.a, pair.b)) throw new Bench.Fault("fault.joined", names(sheet, pair.a, pair.b));
    const id = `j${sheet.next}`;
    return [{ ...sheet, next: sheet.next + 1, pairs: { ...sheet.pairs, [id]: pair } }, id];
  };

  const names = (sheet, a, b) => ({ a: Bench.linkName(sheet, a), b: Bench.linkName(sheet, b) });

  /** Two links through the same two points would be one link. */
  function checkShared(sheet, id, points) {
    for (const [other, link] of Object.entries(sheet.links)) {
      if (other !== id && link.points.filter(point => points.includes(point)).length > 1) {
        throw new Bench.Fault("fault.shared", { a: Bench.linkName(sheet, other) });
      }
    }
  }

  /** Links through a point, the frame first. */
  Bench.linksAt = (sheet, point) => Object.keys(sheet.links).filter(id => sheet.links[id].points.includes(point));

  /** The number that a link has in files: 0 for the frame, the others as they were drawn. */
  Bench.linkNumber = (sheet, id) => Object.keys(sheet.links).indexOf(id);

  /** What a link is called: its own name, or its number. */
  Bench.linkName = (sheet, id) => {
    const link = sheet.links[id];
    if (link && link.name) return link.name;
    return id === GROUND ? Bench.word("name.frame") : Bench.word("name.link", { k: Bench.linkNumber(sheet, id) });
  };

  /** Whether two links have a joint already: its point or the id of its pair. */
  Bench.joined = (sheet, a, b) => {
    const point = sheet.links[a].points.find(id => sheet.links[b].points.includes(id) && Bench.pinsAt(sheet, id)
      .some(([one, other]) => (one === a && other === b) || (one === b && other === a)));
    if (point) return point;
    return Object.keys(sheet.pairs).find(id => {
      const pair = sheet.pairs[id];
      return (pair.a === a && pair.b === b) || (pair.a === b && pair.b === a);
    });
  };

  /** Revolute joints at a point, as pairs of links: the first with each of the others, or as a file had them. */
  Bench.pinsAt = (sheet, point) => {
    const links = Bench.linksAt(sheet, point), tree = sheet.points[point].tree;
    const whole = tree && tree.length === links.length - 1 && tree.every(pair => pair.every(id => links.includes(id)));
    if (whole) return tree;
    return links.slice(1).map(other => [links[0], other]);
  };

  /** Put a point elsewhere; wheels in mesh stay in mesh. */
  Bench.placed = (sheet, places) => {
    const points = { ...sheet.points };
    for (const [id, [x, y]] of Object.entries(places)) points[id] = { ...points[id], x: bounded(x), y: bounded(y) };
    const moved = { ...sheet, points }, pairs = { ...sheet.pairs };
    for (const [id, pair] of Object.entries(sheet.pairs)) {
      if (pair.kind === "cam") {
        // a roller at the mean radius stays there
        const [p, q, from, to] = [moved, moved, sheet, sheet].map((own, k) => own.points[k % 2 ? pair.on : pair.at]), far = Math.hypot(to.x - from.x, to.y - from.y);
        const turned = Math.atan2(q.y - p.y, q.x - p.x) - Math.atan2(to.y - from.y, to.x - from.x), next = Math.hypot(q.x - p.x, q.y - p.y);
        if (Math.abs(pair.radius - far) < 1e-9 * far && next > 0) {
          pairs[id] = { ...pair, radius: next, angle: pair.angle + turned, harmonics: pair.harmonics.map(wave => wave.map(value => (value * next) / far)) };
        }
        continue;
      }
      if (pair.kind !== "gear") continue;
      const before = Bench.distance(sheet, pair.at, pair.on), after = Bench.distance(moved, pair.at, pair.on);
      const sum = Math.abs(pair.radii[0] * (pair.internal ? -1 : 1) + pair.radii[1]);
      if (before !== after && after > 0 && Math.abs(sum - before) < 1e-9 * before) {
        pairs[id] = { ...pair, radii: pair.radii.map(radius => (radius * after) / before) };
      }
    }
    return { ...moved, pairs };
  };

  /** A table of which some entries, numbers or lists of them, are multiplied. */
  function scaled(own, by, ...keys) {
    const times = value => (Array.isArray(value) ? value.map(times) : Number(bounded(value * by).toPrecision(15)));
    return { ...own, ...Object.fromEntries(keys.filter(key => own[key] !== undefined).map(key => [key, times(own[key])])) };
  }

  /** A motion law whose coordinate is multiplied. */
  Bench.scaledLaw = (law, by) => scaled(law, by, "rate", "offset", "mean", "amplitude", "coefficients", "values");

  /** The same mechanism in another unit: the numbers change, the mechanism is as large as it was. */
  Bench.inUnit = (sheet, unit) => {
    const by = UNIT_SIZE[sheet.unit] / UNIT_SIZE[unit];
    const each = (table, ...keys) => Object.fromEntries(Object.entries(table).map(([id, own]) => [id, scaled(own, by, ...keys)]));
    const drivers = sheet.drivers.map(own => (Bench.drivable(sheet, own.base, own.link).turns ? own : { ...own, law: Bench.scaledLaw(own.law, by) }));
    return { ...sheet, unit, points: each(sheet.points, "x", "y"), pairs: each(sheet.pairs, "radii", "radius", "harmonics"), drivers };
  };

  Bench.distance = (sheet, a, b) =>
    Math.hypot(sheet.points[a].x - sheet.points[b].x, sheet.points[a].y - sheet.points[b].y);

  /** The direction of a pair that slides, in radians: along two points of its link, or as given. */
  Bench.direction = (sheet, pair) => {
    const [p, q] = (pair.along || []).map(id => sheet.points[id]);
    return p && q && (p.x !== q.x || p.y !== q.y) ? Math.atan2(q.y - p.y, q.x - p.x) : pair.angle;
  };

  /** Add points to a link. */
  Bench.extended = (sheet, link, points) => {
    const own = [...new Set([...sheet.links[link].points, ...points])];
    checkShared(sheet, link, own);
    for (const point of points) {
      for (const other of Bench.linksAt(sheet, point)) {
        const sliding = other !== link && Object.values(sheet.pairs).some(pair =>
          (pair.a === link && pair.b === other) || (pair.a === other && pair.b === link));
        if (sliding) throw new Bench.Fault("fault.joined", names(sheet, link, other));
      }
    }
    return { ...sheet, links: { ...sheet.links, [link]: { ...sheet.links[link], points: own } } };
  };

  /** What is left when points, links and pairs are taken away: nothing that hangs on them stays. */
  Bench.without = (sheet, gone) => {
    const out = new Set(gone), keep = (table, test) => Object.fromEntries(Object.entries(table).filter(test));
    let links = {};
    for (const [id, link] of Object.entries(sheet.links)) {
      if (out.has(id) && id !== GROUND) continue;
      const points = link.points.filter(point => !out.has(point));
      const dropped = points.length < link.points.length && points.length < 2 && id !== GROUND;
      if (!dropped) links[id] = { ...link, points };
    }
    const pairs = keep(sheet.pairs, ([id, pair]) =>
      !out.has(id) && links[pair.a] && links[pair.b] && !out.has(pair.at) && !out.has(pair.on));
    // a block that nothing holds any more, and points that no link has
    const needed = id => id === GROUND || links[id].points.length > 1 ||
      Object.values(pairs).some(pair => pair.a === id || pair.b === id);
    links = keep(links, ([id]) => needed(id));
    const used = new Set(Object.values(links).flatMap(link => link.points));
    for (const pair of Object.values(pairs)) for (const id of [pair.at, pair.on]) if (id) used.add(id);
    const points = keep(sheet.points, ([id]) => used.has(id) && !out.has(id));
    for (const id of Object.keys(links)) links[id] = { ...links[id], points: links[id].points.filter(p => points[p]) };
    return settled({ ...sheet, points, links, pairs });
  };

  /** A sheet whose drivers all drive a joint; the range of the input belongs to them. */
  function settled(sheet) {
    const drivers = sheet.drivers.filter(driver => sheet.links[driver.base] && sheet.links[driver.link] &&
      Bench.drivable(sheet, driver.base, driver.link));
    return drivers.length === sheet.drivers.length ? sheet : { ...sheet, drivers, range: null };
  }
  Bench.settled = settled;

  /** The joint of two links that a driver can drive: {turns, at}, or null. */
  Bench.drivable = (sheet, base, link) => {
    const found = Bench.joined(sheet, base, link);
    if (!found) return null;
    if (sheet.points[found]) return { turns: true, at: found };
    return sheet.pairs[found].kind === "P" ? { turns: false, at: sheet.pairs[found].at, pair: found } : null;
  };
})();
