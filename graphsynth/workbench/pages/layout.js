"use strict";
/* Where the joints of a chain are drawn: what the library's sketch does (docs/explanation/sketching.md), in small.  A plane
   embedding by paths through faces (Demoucron, Malgrange and Pertuiset 1964), the barycentric drawing of Tutte (1963) of
   its joints and loops, and the library's kernel of forces, which turns no face over.  A chain without such an embedding
   is drawn by forces alone.

     const { places, planar } = Layout.places(sketch, links, [[link, link], ...])    places: [[x, y], ...] of the joints */

const Layout = (() => {
  const STRENGTHS = [0.6, 0.5, 5, 0.05, 0.6, 0.4, 4], STIFF = 3, ROUGH = 15, STEPS = 60, OUTER = 4, SWEEPS = 400;
  const next = (list, k) => list[(k + 1) % list.length];

  function neighbours(links, joints) {
    const near = Array.from({ length: links }, () => []);
    joints.forEach(([a, b], k) => { near[a].push([b, k]); near[b].push([a, k]); });
    return near;
  }

  /* A cycle of links, from a search in depth. */
  function cycle(near) {
    const above = new Map([[0, -1]]), way = [[0, 0]];
    while (way.length) {
      const top = way[way.length - 1], [link] = top;
      if (top[1] === near[link].length) { way.pop(); continue; }
      const [other] = near[link][top[1]++];
      if (other === above.get(link)) continue;
      if (above.has(other)) {
        const at = way.findIndex(([own]) => own === other);
        if (at >= 0) return way.slice(at).map(([own]) => own);
      } else { above.set(other, link); way.push([other, 0]); }
    }
    return null;
  }

  /* What is not drawn yet, in pieces: {links: inner ones, feet: drawn links that it hangs on}. */
  function pieces(near, drawn, edges) {
    const found = [], seen = new Set();
    near.forEach((own, link) => {
      if (drawn.has(link)) {
        for (const [other, k] of own) if (drawn.has(other) && !edges.has(k) && link < other) found.push({ inner: new Set(), feet: new Set([link, other]) });
      } else if (!seen.has(link)) {
        const inner = new Set([link]), feet = new Set();
        for (const one of inner) {
          seen.add(one);
          for (const [other] of near[one]) (drawn.has(other) ? feet : inner).add(other);
        }
        found.push({ inner, feet });
      }
    });
    return found;
  }

  /* A path through a piece from one foot to another. */
  function path(near, { inner, feet }, edges) {
    const [start] = feet, before = new Map([[start, null]]);
    for (const link of before.keys()) {
      if (link !== start && feet.has(link)) {
        const way = [];
        for (let at = link; at !== null; at = before.get(at)) way.unshift(at);
        return way;
      }
      for (const [other, k] of near[link]) {
        const through = link === start ? inner.has(other) || (!inner.size && feet.has(other) && !edges.has(k)) : inner.has(other) || feet.has(other);
        if (through && !before.has(other)) before.set(other, link);
      }
    }
    return null;
  }

  /* The faces as cycles of links, all in one sense; null if the chain has no plane embedding, or a link that cuts it. */
  function faces(links, near, joints) {
    const first = links > 2 && near.every(own => own.length > 1) ? cycle(near) : null;
    if (!first) return null;
    const index = new Map(joints.flatMap(([a, b], k) => [[`${a},${b}`, k], [`${b},${a}`, k]]));
    const joint = (a, b) => index.get(`${a},${b}`);
    const drawn = new Set(first), edges = new Set(first.map((link, k) => joint(link, next(first, k))));
    const found = [first, [...first].reverse()];
    while (edges.size < joints.length) {
      const open = pieces(near, drawn, edges).map(piece => ({ piece, fit: [...found.keys()].filter(f => [...piece.feet].every(foot => found[f].includes(foot))) }));
      if (!open.length || open.some(({ piece, fit }) => !fit.length || piece.feet.size < 2)) return null;
      const { piece, fit } = open.find(own => own.fit.length === 1) || open[0], way = path(near, piece, edges);
      if (!way) return null;
      const face = found[fit[0]], from = way[0], to = way[way.length - 1], inner = way.slice(1, -1);
      const turned = [...face.slice(face.indexOf(from)), ...face.slice(0, face.indexOf(from))], at = turned.indexOf(to);
      found.splice(fit[0], 1, [...turned.slice(0, at + 1), ...[...inner].reverse()], [...turned.slice(at), from, ...inner]);
      way.forEach((link, k) => { drawn.add(link); if (k) edges.add(joint(way[k - 1], link)); });
    }
    return { cycles: found.map(face => face.map((link, k) => joint(link, next(face, k)))), outlines: outlines(near, found, joint) };
  }

  /* Joints around each link: where a face comes from one neighbour and goes on to the other, these are next to each other. */
  function outlines(near, cycles, joint) {
    const after = near.map(() => new Map());
    for (const face of cycles) face.forEach((link, k) => after[next(face, k)].set(link, next(face, k + 1)));
    return near.map((own, link) => {
      const around = [], [[start]] = own;
      let at = start;
      do { around.push(joint(link, at)); at = after[link].get(at); } while (at !== start && around.length <= own.length);
      return around;
    });
  }

  const sidesOf = polygons => {
    const found = new Map();
    for (const own of polygons) if (own.length > 1) own.forEach((a, k) => { const b = next(own, k); found.set(`${Math.min(a, b)},${Math.max(a, b)}`, [Math.min(a, b), Math.max(a, b)]); });
    return [...found.values()].filter(([a, b]) => a !== b);
  };
  const corners = around => around.map((_, k) => [around.at(k - 2), around.at(k - 1), around[k]]);
  const whole = (rows, width) => ({ data: BigInt64Array.from(rows.flat(), BigInt), shape: [rows.length, width] });

  /* A drawing under way: its joints, then the hubs of its inner loops. */
  class Drawing {
    constructor(count, polygons, loops, outer) {
      const rim = outer >= 0 ? loops[outer] : [], inner = loops.filter((_, k) => k !== outer);
      const spokes = inner.flatMap((loop, hub) => loop.map(joint => [count + hub, joint]));
      this.count = count;
      this.plates = polygons.filter(own => own.length > 2).flatMap(corners);
      this.triangles = [...inner.flatMap((loop, hub) => loop.map((joint, k) => [count + hub, joint, next(loop, k)])), ...this.plates, ...(rim.length ? corners(rim) : [])];
      this.sides = sidesOf(polygons);
      const stiff = new Set(sidesOf(polygons.filter(own => own.length > 2)).map(String));
      this.stiffness = Float64Array.from(this.sides, side => (stiff.has(String(side)) ? STIFF : 1));
      this.x = new Float64Array(count + inner.length);
      this.y = new Float64Array(count + inner.length);
      const fixed = new Set(rim), around = rim.length ? rim : Array.from({ length: count }, (_, k) => k);
      around.forEach((joint, k) => { const turn = (2 * Math.PI * k) / around.length; this.x[joint] = Math.cos(turn); this.y[joint] = Math.sin(turn); });
      if (rim.length) this.settle([...this.sides, ...spokes], fixed);
      const mean = this.sides.reduce((sum, [a, b]) => sum + Math.hypot(this.x[a] - this.x[b], this.y[a] - this.y[b]), 0) / this.sides.length;
      for (const part of [this.x, this.y]) part.forEach((value, k) => { part[k] = value / mean; });
    }
    /* Every vertex that is not fixed at the mean of its neighbours, by relaxation. */
    settle(edges, fixed) {
      const near = Array.from(this.x, () => []);
      for (const [a, b] of edges) { near[a].push(b); near[b].push(a); }
      for (let sweep = 0; sweep < SWEEPS; sweep++) {
        near.forEach((own, k) => {
          if (fixed.has(k)) return;
          this.x[k] = own.reduce((sum, other) => sum + this.x[other], 0) / own.length;
          this.y[k] = own.reduce((sum, other) => sum + this.y[other], 0) / own.length;
        });
      }
    }
    area([a, b, c]) { return (this.x[b] - this.x[a]) * (this.y[c] - this.y[a]) - (this.y[b] - this.y[a]) * (this.x[c] - this.x[a]); }
    evenOut(sketch, steps, crowded = false) {
      const senses = rows => Float64Array.from(rows, row => Math.sign(this.area(row)));
      sketch.call("kinematics.dimensional.kernels.even_out", this.x, this.y, this.count, whole(this.sides, 2), this.stiffness, whole(this.triangles, 3),
        senses(this.triangles), whole(this.plates, 3), senses(this.plates), steps, crowded, STRENGTHS);
    }
    /* Smallest distance of two joints, or twice that of a joint from a side it is not on, over the size. */
    room() {
      let least = Infinity, most = 0;
      for (let a = 0; a < this.count; a++) for (let b = 0; b < a; b++) { const far = Math.hypot(this.x[a] - this.x[b], this.y[a] - this.y[b]); least = Math.min(least, far); most = Math.max(most, far); }
      for (const [a, b] of this.sides) {
        const sx = this.x[b] - this.x[a], sy = this.y[b] - this.y[a], square = Math.max(1e-12, sx * sx + sy * sy);
        for (let k = 0; k < this.count; k++) {
          if (k === a || k === b) continue;
          const wx = this.x[k] - this.x[a], wy = this.y[k] - this.y[a], at = Math.min(1, Math.max(0, (wx * sx + wy * sy) / square));
          least = Math.min(least, 2 * Math.hypot(wx - at * sx, wy - at * sy));
        }
      }
      return least / most;
    }
    get places() { return Array.from({ length: this.count }, (_, k) => [this.x[k], this.y[k]]); }
  }

  function places(sketch, links, joints) {
    const near = neighbours(links, joints), found = faces(links, near, joints), own = near.map(list => list.map(([, k]) => k));
    if (!found) {
      const drawing = new Drawing(joints.length, own, [], -1);
      drawing.evenOut(sketch, 300, true);
      return { places: drawing.places, planar: false };
    }
    const { cycles, outlines: polygons } = found, longest = Math.max(...cycles.map(loop => loop.length));
    const order = [...cycles.keys()].filter(k => cycles[k].length >= longest - 1).sort((p, q) => cycles[q].length - cycles[p].length);
    if (cycles.length === 2) return { places: new Drawing(joints.length, polygons, [cycles[0]], 0).places, planar: true };
    const drawings = order.slice(0, OUTER).map(outer => new Drawing(joints.length, polygons, cycles, outer));
    for (const drawing of drawings) drawing.evenOut(sketch, ROUGH);
    const rooms = drawings.map(drawing => drawing.room()), best = drawings[rooms.findIndex(room => room >= (1 - 1e-6) * Math.max(...rooms))];
    best.evenOut(sketch, STEPS);
    return { places: best.places, planar: true };
  }

  return { places };
})();

if (typeof module !== "undefined") module.exports = Layout;
