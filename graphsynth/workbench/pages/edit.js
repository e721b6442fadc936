// What the tools do to a drawing; every function takes a sheet and returns a new one.
"use strict";

(function () {
  const GROUND = Bench.GROUND;

  /** Points of picks: those that are there, or new ones; returns [sheet, ids]. */
  Bench.picked = (sheet, picks) => {
    const ids = [];
    for (const pick of picks) {
      let id = pick.point;
      if (!id) {
        [sheet, id] = Bench.withPoint(sheet, pick.x, pick.y);
        if (pick.link) sheet = Bench.extended(sheet, pick.link, [id]);
      }
      ids.push(id);
    }
    return [sheet, ids];
  };

  /** Draw a link through picked places; returns [sheet, id of the link]. */
  Bench.drawLink = (sheet, picks) => {
    let ids;
    [sheet, ids] = Bench.picked(sheet, picks);
    if (new Set(ids).size < 2) throw new Bench.Fault("fault.short");
    return Bench.withLink(sheet, ids);
  };

  /** Fix a point to the frame, or free it. */
  Bench.toggleGround = (sheet, point) => {
    const frame = sheet.links[GROUND];
    if (!frame.points.includes(point)) return Bench.extended(sheet, GROUND, [point]);
    const points = frame.points.filter(id => id !== point);
    return Bench.settled({ ...sheet, links: { ...sheet.links, [GROUND]: { ...frame, points } } });
  };

  /** A block at a point that slides on a link (by default the frame) in a direction; returns [sheet, id of the pair]. */
  Bench.addSlider = (sheet, point, angle, guide = GROUND) => {
    const links = Bench.linksAt(sheet, point).filter(id => id !== guide);
    if (links.length === 0) throw new Bench.Fault("fault.nothing");
    if (sheet.links[guide].points.includes(point)) throw new Bench.Fault("fault.fixed");
    let block;
    [sheet, block] = Bench.withLink(sheet, [point]);
    return Bench.withPair(sheet, { kind: "P", a: guide, b: block, at: point, angle });
  };

  /** A pin in a straight slot of a link; returns [sheet, id of the pair]. */
  Bench.addSlot = (sheet, point, slotted, angle, along) => {
    const carrier = Bench.linksAt(sheet, point).find(id => id !== slotted);
    if (!carrier) throw new Bench.Fault("fault.pin");
    const pair = { kind: "pin-slot", a: slotted, b: carrier, at: point, angle };
    return Bench.withPair(sheet, along ? { ...pair, along } : pair);
  };

  /** Two wheels about two points; a wheel of its own where only the frame has the point; returns [sheet, id]. */
  Bench.addGears = (sheet, one, other, internal = false) => {
    const length = one !== other ? Bench.distance(sheet, one, other) : 0;
    if (!(length > 0)) throw new Bench.Fault("fault.short");
    const wheels = [];
    for (const point of [one, other]) {
      const carriers = Bench.linksAt(sheet, point);
      let wheel = carriers.filter(id => id !== GROUND && !(sheet.links[id].points.includes(one) &&
        sheet.links[id].points.includes(other))).pop();
      if (!wheel) [sheet, wheel] = Bench.withLink(sheet, [point]);
      wheels.push(wheel);
    }
    const radii = internal ? [length, 2 * length] : [length / 2, length / 2];
    return Bench.withPair(sheet, { kind: "gear", a: wheels[0], b: wheels[1], at: one, on: other, radii, internal });
  };

  /** A disk cam about one point and a roller at another; a cam of its own where only the frame has the first; returns [sheet, id].
      In the drawn position the roller is at the mean radius. */
  Bench.addCam = (sheet, centre, roller) => {
    const radius = centre !== roller ? Bench.distance(sheet, centre, roller) : 0, [p, q] = [sheet.points[centre], sheet.points[roller]];
    if (!(radius > 0)) throw new Bench.Fault("fault.short");
    const movers = Bench.linksAt(sheet, roller).filter(id => id !== GROUND), slides = id => Object.values(sheet.pairs).some(pair => pair.kind === "P" && pair.b === id);
    const follower = movers.find(slides) || movers[0];
    if (!follower) throw new Bench.Fault("fault.roller");
    let cam = Bench.linksAt(sheet, centre).find(id => id !== GROUND && id !== follower);
    if (!cam) [sheet, cam] = Bench.withLink(sheet, [centre]);
    const angle = Math.atan2(q.y - p.y, q.x - p.x);
    return Bench.withPair(sheet, { kind: "cam", a: cam, b: follower, at: centre, on: roller, angle, radius, harmonics: [[0, radius / 4]] });
  };

  /** Give wheels a ratio of teeth; the distance of the centres stays. */
  Bench.withTeeth = (sheet, id, first, second, internal) => {
    const pair = sheet.pairs[id], sum = internal ? second - first : first + second;
    if (!(first > 0 && second > 0) || sum === 0) throw new Bench.Fault("fault.teeth");
    const unit = Bench.distance(sheet, pair.at, pair.on) / Math.abs(sum);
    const next = { ...pair, internal, radii: [first * unit, second * unit] };
    return { ...sheet, pairs: { ...sheet.pairs, [id]: next } };
  };

  /** The driver of a joint picked at a point or a pair: there, turned round, gone. */
  Bench.toggleDriver = (sheet, base, link) => {
    const own = driver => (driver.base === base && driver.link === link) || (driver.base === link && driver.link === base);
    if (sheet.drivers.some(own)) return { ...sheet, drivers: Bench.inStep(sheet.drivers.filter(d => !own(d))), range: null };
    if (!Bench.drivable(sheet, base, link)) throw new Bench.Fault("fault.driver");
    const driver = { base, link, law: { kind: "linear", rate: 1, offset: 0 } };
    return { ...sheet, drivers: Bench.inStep([...sheet.drivers, driver]), range: null };
  };

  /** The two links that a driver at this place would drive: [base, link], the frame as base where it is there. */
  Bench.driverAt = (sheet, point) => {
    const sliding = Object.values(sheet.pairs).find(pair => pair.kind === "P" && pair.at === point);
    if (sliding) return [sliding.a, sliding.b];
    const pins = Bench.pinsAt(sheet, point);
    return pins.length ? pins[0] : null;
  };

  /** Put one point onto another: their links are jointed. */
  Bench.merged = (sheet, from, onto) => {
    if (from === onto) return sheet;
    const swap = id => (id === from ? onto : id);
    const links = Object.fromEntries(Object.entries(sheet.links).map(([id, link]) =>
      [id, { ...link, points: [...new Set(link.points.map(swap))] }]));
    const thin = Object.entries(links).find(([id, link]) => link.points.length < sheet.links[id].points.length);
    if (thin) throw new Bench.Fault("fault.collapse", { a: Bench.linkName(sheet, thin[0]) });
    const pairs = Object.fromEntries(Object.entries(sheet.pairs).map(([id, pair]) =>
      [id, { ...pair, at: swap(pair.at), ...(pair.on ? { on: swap(pair.on) } : {}) }]));
    const points = { ...sheet.points };
    points[onto] = { ...points[onto], trace: points[onto].trace || points[from].trace, tree: undefined };
    delete points[from];
    const next = { ...sheet, points, links, pairs };
    for (const id of Object.keys(links)) {
      for (const other of Object.keys(links)) {
        if (other > id && links[id].points.filter(point => links[other].points.includes(point)).length > 1) {
          throw new Bench.Fault("fault.shared", { a: Bench.linkName(sheet, other) });
        }
      }
    }
    return Bench.settled(next);
  };

  /** Separate the links at a point: each gets a point of its own. */
  Bench.unpinned = (sheet, point) => {
    const old = sheet.points[point];
    for (const link of Bench.linksAt(sheet, point).slice(1)) {
      let id;
      [sheet, id] = Bench.withPoint(sheet, old.x, old.y);
      const points = sheet.links[link].points.map(own => (own === point ? id : own));
      sheet = { ...sheet, links: { ...sheet.links, [link]: { ...sheet.links[link], points } } };
      const pairs = Object.fromEntries(Object.entries(sheet.pairs).map(([key, pair]) =>
        [key, pair.b === link && pair.at === point ? { ...pair, at: id } : pair]));
      sheet = { ...sheet, pairs };
    }
    return Bench.settled(sheet);
  };

  /** The points that a selection of points, links and pairs moves. */
  Bench.pointsOf = (sheet, selection) => {
    const found = new Set();
    for (const id of selection) {
      if (sheet.points[id]) found.add(id);
      if (sheet.links[id]) sheet.links[id].points.forEach(point => found.add(point));
      if (sheet.pairs[id]) [sheet.pairs[id].at, sheet.pairs[id].on].forEach(point => point && found.add(point));
    }
    return [...found];
  };

  /** Copies of links, of points between them and of their drivers, changed by a map of places, which may turn angles round;
      returns [sheet, new ids]. */
  Bench.copied = (sheet, selection, map, turn = angle => angle, sense = 1) => {
    const chosen = new Set(selection), points = new Set(Bench.pointsOf(sheet, selection));
    const links = Object.keys(sheet.links).filter(id => id !== GROUND &&
      (chosen.has(id) || (sheet.links[id].points.every(point => points.has(point)))));
    const to = {}, from = sheet;
    for (const point of new Set(links.flatMap(id => from.links[id].points))) {
      const old = from.points[point];
      [sheet, to[point]] = Bench.withPoint(sheet, ...map(old.x, old.y), { trace: old.trace });
    }
    if (links.length === 0) throw new Bench.Fault("fault.select");
    for (const id of links) [sheet, to[id]] = Bench.withLink(sheet, from.links[id].points.map(point => to[point]));
    const fixed = from.links[GROUND].points.filter(point => to[point]).map(point => to[point]);
    sheet = Bench.extended(sheet, GROUND, fixed);
    const of = id => (id === GROUND ? GROUND : to[id]);
    const trees = Object.keys(from.points).filter(id => to[id] && from.points[id].tree).map(id =>
      [to[id], { ...sheet.points[to[id]], tree: from.points[id].tree.map(pins => pins.map(of)) }]);
    sheet = { ...sheet, points: { ...sheet.points, ...Object.fromEntries(trees) } };
    for (const pair of Object.values(from.pairs)) {
      if (!of(pair.a) || !of(pair.b) || !to[pair.at] || (pair.on && !to[pair.on])) continue;
      const along = pair.along && pair.along.every(p => to[p]) ? pair.along.map(p => to[p]) : undefined;
      const more = { ...(pair.on ? { on: to[pair.on] } : {}), ...(along ? { along } : {}) };
      const angle = pair.angle === undefined ? {} : { angle: turn(Bench.direction(from, pair)) };
      [sheet] = Bench.withPair(sheet, { ...pair, a: of(pair.a), b: of(pair.b), at: to[pair.at], ...angle, ...more });
    }
    const drivers = from.drivers.filter(own => of(own.base) && of(own.link) && Bench.drivable(sheet, of(own.base), of(own.link))).map(own => ({
      base: of(own.base), link: of(own.link), law: Bench.scaledLaw(own.law, Bench.drivable(from, own.base, own.link).turns ? sense : 1) }));
    return [drivers.length ? { ...sheet, drivers: [...sheet.drivers, ...drivers], range: null } : sheet, links.map(id => to[id])];
  };

  /** Mirror images of a selection about the vertical line through x. */
  Bench.mirrored = (sheet, selection, x) =>
    Bench.copied(sheet, selection, (px, py) => [2 * x - px, py], angle => Math.PI - angle, -1);

  /** The box around points: [left, bottom, right, top], or null. */
  Bench.box = (sheet, ids = Object.keys(sheet.points)) => {
    const own = ids.map(id => sheet.points[id]);
    if (!own.length) return null;
    const x = own.map(p => p.x), y = own.map(p => p.y);
    return [Math.min(...x), Math.min(...y), Math.max(...x), Math.max(...y)];
  };
})();
