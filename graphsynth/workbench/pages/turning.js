"use strict";
/* Dimensions for a chain with which it turns: those of its sketch, its cranks shortened until the drivers turn fully.  With
   short cranks a mechanism moves little about the pose in which it is drawn, which is no singular one in general; so this
   ends.  Frames and drivers are tried in order; the least transmission angle decides among those that turn.

     Turning.found(motion, links, joints, places, { frame, drivers, size })    a mechanism in the form of files, or null */

const Turning = (() => {
  const SHRINKS = [1, 0.7, 0.5, 0.35, 0.25, 0.15, 0.08], SAMPLES = 73, GOOD = 0.5, TRIES = 60, MOST = 12;
  /* Sketches are regular, and regular dimensions have change points: joints are shifted by parts of the mean side, always alike. */
  const SHIFTS = [0.08, 0.2, 0.35];

  /* Sets of driven joints, as many as the mobility: those on the frame first. */
  function sets(joints, frame, count, from = 0) {
    const order = [...joints.keys()].sort((p, q) => joints[q].includes(frame) - joints[p].includes(frame));
    const choose = (left, at) => (left === 0 ? [[]] : order.slice(at).flatMap((joint, k) => choose(left - 1, at + k + 1).map(rest => [joint, ...rest])));
    return choose(count, from).filter((set, k) => k < MOST || set.every(joint => joints[joint].includes(frame)));
  }

  /* The text of a graph, as the library writes it: graph6 and the frame. */
  function graphText(links, frame, joints) {
    const chunks = new Array(Math.ceil((links * (links - 1)) / 12)).fill(0);
    for (const [a, b] of joints) { const low = Math.min(a, b), bit = (Math.max(a, b) * (Math.max(a, b) - 1)) / 2 + low; chunks[Math.floor(bit / 6)] |= 32 >> bit % 6; }
    return `${String.fromCharCode(...[links, ...chunks].map(value => value + 63))} f${frame}`;
  }

  /* Revolute joints at these places in the form of files, the links not moved yet. */
  function file(links, frame, joints, at, drivers, points) {
    return {
      format: "graphsynth mechanism", version: 1, graph: graphText(links, frame, joints), pose: Array.from({ length: links }, () => [0, 0, 0]),
      joints: joints.map(([a, b], k) => ({ kind: "R", a, b, at_a: at[k], at_b: at[k] })),
      drivers: drivers.map(([base, link]) => ({ base, link, law: { kind: "linear", rate: 1, offset: 0 } })), points,
    };
  }

  /* A mechanism of the joints at these places; links that are driven are drawn smaller about their pivots. */
  function drawn(links, joints, places, frame, driven, shrink) {
    const at = places.map(place => [...place]), drivers = driven.map(k => (joints[k][1] === frame ? [...joints[k]].reverse() : joints[k]));
    for (const [n, [base, link]] of drivers.entries()) {
      const [x, y] = places[driven[n]];
      if (base !== frame) continue;
      joints.forEach((pair, k) => { if (pair.includes(link) && !pair.includes(frame)) at[k] = [x + shrink * (places[k][0] - x), y + shrink * (places[k][1] - y)]; });
    }
    return file(links, frame, joints, at, drivers, traced(links, joints, at, frame));
  }

  /* A point in the middle of up to two links that have no joint on the frame. */
  function traced(links, joints, at, frame) {
    const floating = Array.from({ length: links }, (_, link) => link).filter(link => link !== frame && !joints.some(pair => pair.includes(link) && pair.includes(frame)));
    return Object.fromEntries(floating.slice(0, 2).map((link, n) => {
      const own = at.filter((_, k) => joints[k].includes(link));
      return [`P${n + 1}`, { link, at: [0, 1].map(c => own.reduce((sum, place) => sum + place[c], 0) / own.length) }];
    }));
  }

  /* The least sine of a transmission angle over full turns of all drivers on the frame; 0 if one does not turn, or not back to its place. */
  function quality(motion, data) {
    const engine = Engine.open(motion, data);
    try {
      if (engine.fault || engine.open || !engine.ready) return engine.fault ? null : 0;
      let least = 1;
      for (let driver = 0; driver < data.drivers.length; driver++) {
        if (data.drivers[driver].base !== engine.frame) continue;
        const swept = engine.sweep(SAMPLES, driver);
        if (!swept || swept.turns !== 1) return 0;
        const steps = swept.margins.length / swept.inputs.length;
        for (let i = 0; i < swept.inputs.length; i++) for (const { angle } of engine.transmission(swept.margins.subarray(i * steps, (i + 1) * steps))) least = Math.min(least, Math.sin(angle));
      }
      return Math.max(least, 1e-6);
    } finally { engine.close(); }
  }

  function found(motion, links, joints, places, { frame = null, drivers = null, size = 100 } = {}) {
    const mobility = 3 * (links - 1) - 2 * joints.length, near = Array.from({ length: links }, () => []);
    for (const [a, b] of joints) { near[a].push(b); near[b].push(a); }
    const away = ([own, set]) => set.filter(joint => joint >= 0 && !joints[joint].includes(own)).length; /* drivers away from the frame come last */
    const wide = Math.max(...[0, 1].map(c => Math.max(...places.map(p => p[c])) - Math.min(...places.map(p => p[c])))) || 1;
    let seed = 12345;
    const lot = () => { seed = (seed * 48271) % 2147483647; return (2 * seed) / 2147483647 - 1; };
    const scaled = SHIFTS.map(shift => places.map(place => place.map(value => Number((((value + shift * lot()) * size) / wide).toPrecision(5)))));
    const frames = frame === null ? [...near.keys()].sort((p, q) => near[q].length - near[p].length) : [frame];
    const asked = own => drivers.map(link => joints.findIndex(pair => pair.includes(own) && pair.includes(link)));
    const choices = frames.flatMap(own => (drivers ? [asked(own)] : sets(joints, own, mobility)).map(set => [own, set]))
      .sort((p, q) => away(p) - away(q)).slice(0, TRIES).filter(([, set]) => set.every(joint => joint >= 0));
    let best = null, most = 0;
    for (const at of scaled) {
      let least = Infinity;
      for (const [own, set] of choices) {
        if (away([own, set]) > least) break; /* a driver away from the frame is not judged: only where none on it turns */
        for (const shrink of SHRINKS) {
          const data = drawn(links, joints, at, own, set, shrink), good = quality(motion, data);
          if (good === null) break;
          if (good > most) { most = good; best = data; least = away([own, set]); }
          if (good > 0) break;
        }
        if (most > GOOD) break;
      }
      if (best) break;
    }
    return best || (choices.length ? drawn(links, joints, scaled[0], ...choices[0], 1) : null);
  }

  /* The diagonal of the box around points. */
  const extent = points => Math.hypot(...[0, 1].map(c => Math.max(...points.map(p => p[c])) - Math.min(...points.map(p => p[c]))));

  return { found, graphText, file, extent };
})();

if (typeof module !== "undefined") module.exports = Turning;
