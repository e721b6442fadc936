"use strict";
/* Dimensions for a chain with which it turns: those of its sketch, its cranks shortened until the drivers turn fully.  With
   short cranks a mechanism moves little about the pose in which it is drawn, which is no singular one in general; so this
   ends.  Frames and drivers are tried in order; the least transmission angle decides among those that turn.

   Joints may be prismatic.  Such a joint of a binary link slides across the line to the link's other joint: that is a rocker
   of infinite length, and moves in this pose as the rocker does.  Other directions follow, then dimensions by lot, frames made
   short among them, since a link that turns a guide round needs a short frame and no short crank.

     Turning.found(motion, links, joints, places, { frame, drivers, sliders, size })    a mechanism in the form of files, or null */

const Turning = (() => {
  const SHRINKS = [1, 0.7, 0.5, 0.35, 0.25, 0.15, 0.08], SAMPLES = 73, GOOD = 0.5, TRIES = 60, MOST = 12;
  /* Sketches are regular, and regular dimensions have change points: joints are shifted by parts of the mean side, always alike. */
  const SHIFTS = [0.08, 0.2, 0.35];
  /* Of prismatic joints: directions tried, directions kept for lots, lots, the largest shift in them, how short a
     frame is made; sine of the least angle between two of one link. */
  const WAYS = 8, MOST_WAYS = 64, LOTS = 120, WILD = 0.7, FRAMES = [1, 0.5, 0.25, 0.12], APART = 0.3;

  /* Choices of so many of a list, one after another: there may be very many. */
  function* choose(list, count, from = 0) {
    if (!count) yield [];
    else for (let k = from; k <= list.length - count; k++) for (const rest of choose(list, count - 1, k + 1)) yield [list[k], ...rest];
  }
  function first(choices, most) {
    const found = [];
    for (const own of choices) if (found.push(own) === most) break;
    return found;
  }

  /* Sets of driven joints, as many as the mobility: those on the frame, then some of the others. */
  function sets(joints, frame, count, most) {
    const on = joint => joints[joint].includes(frame), order = [...joints.keys()].sort((p, q) => on(q) - on(p));
    return [...first(choose(order.filter(on), count), TRIES), ...first(choose(order, count), most).filter(set => !set.every(on))];
  }

  /* The text of a graph, as the library writes it: graph6 and the frame. */
  function graphText(links, frame, joints) {
    const chunks = new Array(Math.ceil((links * (links - 1)) / 12)).fill(0);
    for (const [a, b] of joints) { const low = Math.min(a, b), bit = (Math.max(a, b) * (Math.max(a, b) - 1)) / 2 + low; chunks[Math.floor(bit / 6)] |= 32 >> bit % 6; }
    return `${String.fromCharCode(...[links, ...chunks].map(value => value + 63))} f${frame}`;
  }

  /* Joints at these places in the form of files, the links not moved yet; those with a direction are prismatic. */
  function file(links, frame, joints, at, drivers, points, angles = new Map()) {
    const kind = k => (angles.has(k) ? { kind: "P", angle_a: angles.get(k), angle_b: angles.get(k) } : { kind: "R" });
    return {
      format: "graphsynth mechanism", version: 1, graph: graphText(links, frame, joints), pose: Array.from({ length: links }, () => [0, 0, 0]),
      joints: joints.map(([a, b], k) => ({ ...kind(k), a, b, at_a: at[k], at_b: at[k] })),
      drivers: drivers.map(([base, link]) => ({ base, link, law: { kind: "linear", rate: 1, offset: 0 } })), points,
    };
  }

  /* Directions of prismatic joints, as functions of all places: for each joint those worth trying, the best first. */
  function waysOf(joints, k, sliders) {
    const rest = joints[k].map(link => [...joints.keys()].filter(other => other !== k && joints[other].includes(link)));
    const along = (p, q) => at => Math.atan2(at[q][1] - at[p][1], at[q][0] - at[p][0]), across = other => at => along(k, other)(at) + Math.PI / 2;
    const sides = rest.filter(own => own.length === 1 && !sliders.includes(own[0])).map(own => across(own[0]));
    const between = rest.every(own => own.length === 1) ? [along(rest[0][0], rest[1][0])] : [];
    return [...sides, ...between, ...rest.flat().map(across), ...[0, 1, 2].map(n => () => k + n)];
  }

  /* Directions of all prismatic joints together: [[joint, function], ...], those first that are early for each. */
  function together(joints, sliders) {
    const late = own => own.reduce((sum, [, , n]) => sum + n, 0);
    let all = [[]];
    for (const k of sliders) {
      all = all.flatMap(own => waysOf(joints, k, sliders).slice(0, WAYS).map((way, n) => [...own, [k, way, n]]));
      all = all.sort((p, q) => late(p) - late(q)).slice(0, MOST_WAYS);
    }
    return all;
  }

  /* Whether two prismatic joints of one link are nearly parallel: one takes back what the other slides. */
  function parallel(joints, ways, at) {
    return ways.some(([k, way], n) => ways.slice(n + 1).some(([m, other]) =>
      joints[k].some(link => joints[m].includes(link)) && Math.abs(Math.sin(way(at) - other(at))) < APART));
  }

  /* A mechanism of the joints at these places; links that are driven are drawn smaller about their pivots, the frame about the
     first of them. */
  function drawn(links, joints, placed, frame, driven, shrink, ways = [], close = 1) {
    const [px, py] = placed[driven[0]];
    const places = placed.map(([x, y], k) => (close < 1 && joints[k].includes(frame) ? [px + close * (x - px), py + close * (y - py)] : [x, y]));
    const at = places.map(place => [...place]), drivers = driven.map(k => (joints[k][1] === frame ? [...joints[k]].reverse() : joints[k]));
    for (const [n, [base, link]] of drivers.entries()) {
      const [x, y] = places[driven[n]];
      if (base !== frame) continue;
      joints.forEach((pair, k) => { if (pair.includes(link) && !pair.includes(frame)) at[k] = [x + shrink * (places[k][0] - x), y + shrink * (places[k][1] - y)]; });
    }
    return file(links, frame, joints, at, drivers, traced(links, joints, at, frame), new Map(ways.map(([k, way]) => [k, way(at)])));
  }

  /* A point in the middle of up to two links that have no joint on the frame. */
  function traced(links, joints, at, frame) {
    const floating = Array.from({ length: links }, (_, link) => link).filter(link => link !== frame && !joints.some(pair => pair.includes(link) && pair.includes(frame)));
    return Object.fromEntries(floating.slice(0, 2).map((link, n) => {
      const own = at.filter((_, k) => joints[k].includes(link));
      return [`P${n + 1}`, { link, at: [0, 1].map(c => own.reduce((sum, place) => sum + place[c], 0) / own.length) }];
    }));
  }

  /* Whether a driver gets round; a sweep that is stopped is long. */
  function round(engine, driver) {
    const pose = Float64Array.from(engine.pose), { reached } = engine.advance(engine.inputs[driver] + 2 * Math.PI, driver);
    engine.take(pose);
    return reached;
  }

  /* The least sine of a transmission angle over full turns of all drivers on the frame; 0 if one does not turn, or not back to its
     place.  A driver that slides counts by how far, in lengths of the mechanism. */
  function quality(motion, data) {
    const engine = Engine.open(motion, data);
    try {
      if (engine.fault || engine.open || !engine.ready) return engine.fault ? null : 0;
      let least = 1;
      for (let driver = 0; driver < data.drivers.length; driver++) {
        if (data.drivers[driver].base !== engine.frame) continue;
        const slides = engine.joints[engine.number(data.drivers[driver])].kind === "P";
        if (!slides && !round(engine, driver)) return 0;
        const swept = engine.sweep(SAMPLES, driver);
        if (swept && slides) {
          least = Math.min(least, (swept.inputs[SAMPLES - 1] - swept.inputs[0]) / engine.Lc);
          continue;
        }
        if (!swept || swept.turns !== 1) return 0;
        const steps = swept.margins.length / swept.inputs.length;
        for (let i = 0; i < swept.inputs.length; i++) for (const { angle } of engine.transmission(swept.margins.subarray(i * steps, (i + 1) * steps))) least = Math.min(least, Math.sin(angle));
      }
      return Math.max(least, 1e-6);
    } finally { engine.close(); }
  }

  /* Where nothing turns, what its first driver moves farthest. */
  function farthest(motion, all) {
    const span = data => {
      const engine = Engine.open(motion, data);
      try {
        const swept = engine.fault || engine.open ? null : engine.sweep(SAMPLES, 0);
        return swept ? swept.inputs[SAMPLES - 1] - swept.inputs[0] : 0;
      } finally { engine.close(); }
    };
    const spans = all.length > 1 ? all.map(span) : [0];
    return all[spans.indexOf(Math.max(...spans))];
  }

  function found(motion, links, joints, places, { frame = null, drivers = null, sliders = [], size = 100 } = {}) {
    const mobility = 3 * (links - 1) - 2 * joints.length, near = Array.from({ length: links }, () => []);
    for (const [a, b] of joints) { near[a].push(b); near[b].push(a); }
    const between = (a, b) => joints.findIndex(pair => pair.includes(a) && pair.includes(b)), sliding = sliders.map(pair => between(...pair));
    /* drivers away from the frame come last, before them those that slide: they do not turn */
    const away = ([own, set]) => set.reduce((sum, joint) => sum + (joint < 0 ? 0 : !joints[joint].includes(own) ? 100 : sliding.includes(joint) ? 1 : 0), 0);
    const wide = Math.max(...[0, 1].map(c => Math.max(...places.map(p => p[c])) - Math.min(...places.map(p => p[c])))) || 1;
    let seed = 12345;
    const lot = () => { seed = (seed * 48271) % 2147483647; return (2 * seed) / 2147483647 - 1; };
    const shifted = shift => places.map(place => place.map(value => Number((((value + shift * lot()) * size) / wide).toPrecision(5))));
    const scaled = SHIFTS.map(shifted), ways = together(joints, sliding);
    const frames = frame === null ? [...near.keys()].sort((p, q) => near[q].length - near[p].length) : [frame];
    const asked = own => drivers.map(link => between(own, link));
    const choices = frames.flatMap(own => (drivers ? [asked(own)] : sets(joints, own, mobility, frame === null ? MOST : TRIES)).map(set => [own, set]))
      .sort((p, q) => away(p) - away(q)).slice(0, TRIES).filter(([, set]) => set.every(joint => joint >= 0));
    let best = null, most = 0;
    const judged = (...dimensions) => {
      if (parallel(joints, dimensions[4], dimensions[0])) return null;
      const data = drawn(links, joints, ...dimensions), good = quality(motion, data);
      if (good > most) { most = good; best = data; }
      return good;
    };
    const tried = (at, way) => {
      let least = Infinity;
      for (const choice of choices) {
        if (away(choice) > least) break; /* what cannot turn is not judged: only where none turns */
        for (const shrink of SHRINKS) {
          const before = most, good = judged(at, ...choice, shrink, way);
          if (good === null) break;
          if (most > before) least = away(choice);
          if (good > 0) break;
        }
        if (most > GOOD) break;
      }
      return best !== null;
    };
    const pick = list => list[Math.floor((list.length * (lot() + 1)) / 2.000001)];
    scaled.some(at => ways.slice(0, WAYS).some(way => tried(at, way)));
    for (let n = 0; n < LOTS && sliding.length && !best && choices.length; n++)
      judged(shifted(WILD), ...choices[n % choices.length], pick(SHRINKS), pick(ways), pick(FRAMES));
    return best || (choices.length ? farthest(motion, ways.slice(0, WAYS).map(way => drawn(links, joints, scaled[0], ...choices[0], 1, way))) : null);
  }

  /* The diagonal of the box around points. */
  const extent = points => Math.hypot(...[0, 1].map(c => Math.max(...points.map(p => p[c])) - Math.min(...points.map(p => p[c]))));

  return { found, graphText, file, extent };
})();

if (typeof module !== "undefined") module.exports = Turning;
