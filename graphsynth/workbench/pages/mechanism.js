// Between the drawing and the form of files, which is that of the library: `written` and `opened`.
"use strict";

(function () {
  const GROUND = Bench.GROUND;

  /** The text form of a graph: graph6, the frame, joints of mobility 2. */
  function graphText(links, frame, joints) {
    const size = (links * (links - 1)) / 2, chunks = new Array(Math.ceil(size / 6)).fill(0), loose = [];
    for (const { a, b, kind } of joints) {
      const low = Math.min(a, b), high = Math.max(a, b);
      if (kind !== "R" && kind !== "P") { loose.push([low, high]); }
      const bit = (high * (high - 1)) / 2 + low;
      chunks[Math.floor(bit / 6)] |= 32 >> bit % 6;
    }
    const head = links <= 62 ? [links] : [63, links >> 12, (links >> 6) & 63, links & 63];
    loose.sort((p, q) => p[0] - q[0] || p[1] - q[1]);
    const fields = [String.fromCharCode(...[...head, ...chunks].map(value => value + 63)), `f${frame}`];
    if (loose.length) fields.push(`2:${loose.map(pair => pair.join("-")).join(",")}`);
    return fields.join(" ");
  }

  /** The joints of a drawing, with links by number. */
  function jointsOf(sheet) {
    const number = id => Bench.linkNumber(sheet, id), found = [], place = id => [sheet.points[id].x, sheet.points[id].y];
    for (const id of Object.keys(sheet.points)) {
      for (const [a, b] of Bench.pinsAt(sheet, id)) {
        found.push({ kind: "R", a: number(a), b: number(b), at_a: place(id), at_b: place(id) });
      }
    }
    for (const pair of Object.values(sheet.pairs)) {
      const base = { kind: pair.kind, a: number(pair.a), b: number(pair.b), at_a: place(pair.at), at_b: place(pair.on || pair.at) };
      const angle = pair.kind === "gear" ? 0 : Bench.direction(sheet, pair);
      if (pair.kind === "P") found.push({ ...base, angle_a: angle, angle_b: angle });
      if (pair.kind === "pin-slot") found.push({ ...base, angle_a: angle });
      if (pair.kind === "cam") found.push({ ...base, angle_a: angle, radius: pair.radius, harmonics: pair.harmonics });
      if (pair.kind === "gear") {
        // in the drawn position the wheels are in mesh: that is what the offset says
        const phi = Math.atan2(base.at_b[1] - base.at_a[1], base.at_b[0] - base.at_a[0]);
        const second = (pair.internal ? -1 : 1) * pair.radii[1];
        const offset = -(phi * (pair.radii[0] + second)) / second;
        found.push({ ...base, radius_a: pair.radii[0], radius_b: pair.radii[1], internal: pair.internal, offset });
      }
    }
    return found;
  }

  /** The mechanism in the form of files: every link's own frame is the fixed one at the drawn position. */
  Bench.written = sheet => {
    const ids = Object.keys(sheet.links), joints = jointsOf(sheet), number = id => ids.indexOf(id);
    const points = Object.create(null), inPairs = new Set(Object.values(sheet.pairs).flatMap(pair => [pair.at, pair.on]));
    for (const [id, point] of Object.entries(sheet.points)) {
      const links = Bench.linksAt(sheet, id), alone = links.length === 1 && !inPairs.has(id);
      const moving = links.filter(link => link !== GROUND);
      if (links.length && (alone || (point.trace && moving.length))) {
        points[point.name] = { link: number(alone ? links[0] : moving[moving.length - 1]), at: [point.x, point.y] };
      }
    }
    const data = { format: "graphsynth mechanism", version: 1, graph: graphText(ids.length, number(GROUND), joints) };
    data.pose = ids.map(() => [0, 0, 0]);
    if (sheet.range) data.input_range = [...sheet.range];
    const named = ids.filter(id => sheet.links[id].name);
    if (named.length) data.link_names = Object.fromEntries(named.map(id => [sheet.links[id].name, number(id)]));
    data.joints = joints;
    data.drivers = sheet.drivers.map(d => ({ base: number(d.base), link: number(d.link), law: { ...d.law } }));
    data.points = points;
    return data;
  };

  /** A motion law whose coordinate is counted from elsewhere. */
  Bench.shiftedLaw = (law, by) => {
    if (!by) return law;
    if (law.kind === "linear") return { ...law, offset: law.offset + by };
    if (law.kind === "harmonic") return { ...law, mean: law.mean + by };
    if (law.kind === "table") return { ...law, values: law.values.map(value => value + by) };
    return { ...law, coefficients: [law.coefficients[0] + by, ...law.coefficients.slice(1)] };
  };

  /** Drivers in step: at the input at which the first one is in the drawn position all linear ones are. */
  Bench.inStep = drivers => {
    const { law = {} } = drivers[0] || {}, there = law.kind === "linear" && law.rate ? law.offset / law.rate : NaN;
    return drivers.map((own, k) => (k && own.law.kind === "linear" && Number.isFinite(there) ? { ...own, law: { ...own.law, offset: own.law.rate * there } } : own));
  };

  /** Where a pose of a link takes a place of its frame. */
  Bench.carried = (pose, at) => {
    const c = Math.cos(pose[2]), s = Math.sin(pose[2]);
    return [pose[0] + c * at[0] - s * at[1], pose[1] + s * at[0] + c * at[1]];
  };

  /** Points of an opened mechanism: places on links, one point where revolute joints meet. */
  class Places {
    constructor(size) { this.all = []; this.near = 1e-9 * size; }
    find(link, [x, y]) {
      return this.all.find(p => p.links.has(link) && Math.hypot(p.x - x, p.y - y) <= this.near);
    }
    at(link, [x, y]) {
      let found = this.find(link, [x, y]);
      if (!found) this.all.push(found = { x, y, links: new Set([link]), pins: [], name: "", trace: false });
      return found;
    }
    pin(a, b, place, other) {
      const one = this.at(a, place), two = this.find(b, other) || this.find(b, place);
      if (two && two !== one) {
        if ([...two.links].some(link => one.links.has(link))) throw new Bench.Fault("fault.file.twice", { place: "joints" });
        two.links.forEach(link => one.links.add(link));
        one.pins.push(...two.pins);
        this.all.splice(this.all.indexOf(two), 1);
      } else if (two === one) throw new Bench.Fault("fault.file.twice", { place: "joints" });
      one.links.add(b);
      one.pins.push([a, b]);
    }
  }

  /** A drawing of a mechanism that `checked` has looked at, in its pose. */
  Bench.opened = file => {
    const world = (link, at) => Bench.carried(file.pose[link], at), turn = link => file.pose[link][2];
    const ends = file.joints.map(one => [world(one.a, one.at_a), world(one.b, one.at_b)]);
    const spots = [...ends.flat(), ...file.points.map(one => world(one.link, one.at))];
    const size = Math.max(1e-12, ...[0, 1].map(c =>
      Math.max(...spots.map(p => p[c]), -Infinity) - Math.min(...spots.map(p => p[c]), Infinity)).filter(Number.isFinite));
    const places = new Places(size);
    file.joints.forEach((one, k) => {
      const [p, q] = ends[k], t = turn(one.a) + (one.angle_a || 0), d = [q[0] - p[0], q[1] - p[1]];
      const gap = one.kind === "R" ? Math.hypot(...d)
        : one.kind === "P" || one.kind === "pin-slot" ? Math.abs(Math.cos(t) * d[1] - Math.sin(t) * d[0]) : 0;
      const tilt = one.kind === "P" ? Math.abs(Math.sin(t - turn(one.b) - one.angle_b)) * size : 0;
      if (Math.max(gap, tilt) > 1e-6 * size) throw new Bench.Fault("fault.file.open", { a: one.a, b: one.b });
      if (one.kind === "R") places.pin(one.a, one.b, p, q);
    });
    const slid = {}, pairs = file.joints.filter(one => one.kind !== "R").map(one => {
      const p = world(one.a, one.at_a), q = world(one.b, one.at_b), t = turn(one.a) + (one.angle_a || 0);
      slid[`${one.a} ${one.b}`] = Math.cos(t) * (q[0] - p[0]) + Math.sin(t) * (q[1] - p[1]);
      if (one.kind === "P" || one.kind === "pin-slot") return { kind: one.kind, a: one.a, b: one.b, at: places.at(one.b, q), angle: t };
      const base = { kind: one.kind, a: one.a, b: one.b, at: places.at(one.a, p), on: places.at(one.b, q) };
      if (one.kind === "gear") return { ...base, radii: [one.radius_a, one.radius_b], internal: one.internal };
      return { ...base, angle: t, radius: one.radius, harmonics: one.harmonics };
    });
    for (const one of file.points) {
      const found = places.at(one.link, world(one.link, one.at));
      if (!found.name) Object.assign(found, { name: one.name, trace: true });
    }
    return drawing(file, places.all, pairs, slid);
  };

  /** The sheet of places, pairs and drivers that were found. */
  function drawing(file, places, pairs, slid) {
    let sheet = { ...Bench.empty(), links: {}, range: file.range };
    const link = k => (k === file.frame ? GROUND : `l${1000 + k}`), point = new Map();
    for (let k = 0; k < file.links; k++) {
      sheet.links[link(k)] = { points: [], name: (file.names.find(([, own]) => own === k) || [""])[0] };
    }
    const taken = new Set(places.map(place => place.name));
    for (const place of places) {
      let name = place.name;
      for (let k = 0; !name; k++) {
        const next = String.fromCharCode(65 + (k % 26)) + (k >= 26 ? Math.floor(k / 26) : "");
        if (!taken.has(next)) taken.add(name = next);
      }
      const own = { name, trace: place.trace, tree: place.pins.map(pair => pair.map(link)) };
      let id;
      [sheet, id] = Bench.withPoint(sheet, place.x, place.y, own);
      point.set(place, id);
      for (const k of place.links) sheet.links[link(k)].points.push(id);
      if (place.pins.length === 0) delete sheet.points[id].tree;
    }
    sheet.next = Math.max(sheet.next, 2000);
    for (const pair of pairs) {
      const ids = { a: link(pair.a), b: link(pair.b), at: point.get(pair.at) };
      [sheet] = Bench.withPair(sheet, { ...pair, ...ids, ...(pair.on ? { on: point.get(pair.on) } : {}) });
    }
    const turned = k => file.pose[k][2];
    sheet.drivers = file.drivers.map(({ base, link: driven, law }) => {
      const there = slid[`${base} ${driven}`] !== undefined ? slid[`${base} ${driven}`]
        : slid[`${driven} ${base}`] !== undefined ? slid[`${driven} ${base}`] : turned(driven) - turned(base);
      return { base: link(base), link: link(driven), law: Bench.shiftedLaw(law, -there) };
    });
    if (sheet.drivers.some(d => !Bench.drivable(sheet, d.base, d.link))) throw new Bench.Fault("fault.file.driver");
    return sheet;
  }

  /** The drawing with every link carried to a pose, row by row [x, y, angle]: what is seen is what is drawn on. */
  Bench.rebased = (sheet, poses) => {
    const ids = Object.keys(sheet.links), pose = id => poses[ids.indexOf(id)], places = {};
    for (const [id, point] of Object.entries(sheet.points)) {
      const carrier = Bench.linksAt(sheet, id)[0];
      places[id] = carrier ? Bench.carried(pose(carrier), [point.x, point.y]) : [point.x, point.y];
    }
    let slides = {};
    const pairs = Object.fromEntries(Object.entries(sheet.pairs).map(([id, pair]) => {
      if (pair.angle === undefined) return [id, pair];
      const angle = Bench.direction(sheet, pair) + pose(pair.a)[2], from = sheet.points[pair.at];
      const old = Bench.carried(pose(pair.a), [from.x, from.y]), at = places[pair.at];
      slides[`${pair.a} ${pair.b}`] = Math.cos(angle) * (at[0] - old[0]) + Math.sin(angle) * (at[1] - old[1]);
      return [id, { ...pair, angle }];
    }));
    const drivers = Bench.inStep(sheet.drivers.map(driver => {
      const key = [`${driver.base} ${driver.link}`, `${driver.link} ${driver.base}`].find(own => own in slides);
      const by = key ? slides[key] : pose(driver.link)[2] - pose(driver.base)[2];
      return { ...driver, law: Bench.shiftedLaw(driver.law, -by) };
    }));
    const points = Object.fromEntries(Object.entries(sheet.points).map(([id, point]) =>
      [id, { ...point, x: places[id][0], y: places[id][1] }]));
    return { ...sheet, points, pairs, drivers };
  };
})();
