"use strict";
/* Mechanisms for a drawn curve, closed or open, from the small index of the library's curves: the rows whose sizes of Fourier coefficients
   are nearest (docs/theory/curve-index.md) are moved by the engine, laid on the target, and the best are refined: damped
   Gauss-Newton steps on the distances from the target to the curve, with differences of the engine's sweeps.

   An open one is laid on parts of every third curve of the index, for a part has no sizes of coefficients.

     Curves.found(motion, target, tell, closed = true)    -> [{data, error}], the best first
         target: [[x, y], ...]; data: in the form of files; error: root mean square distance over its size, of an open
         target that of its points from the curve, which goes on beyond it */

const Curves = (() => {
  const HARMONICS = 8, JOINTS = 7, ROW = 2 + 4 * (JOINTS + 1) + 2 * HARMONICS, GRID = 32767;
  const LOOKED = 120, LAID = 8, KEPT = 6, SAMPLES = 73, POINTS = 48, STEPS = 10, ENOUGH = 1e-3, DIFFERENCE = 1e-5;
  /* Open targets: points along them and along a whole curve, lengths of parts in such points, and where they begin. */
  const FEW = 16, ROUND = 96, PARTS = [12, 16, 24, 32, 48, 64, 80], BEGINS = 2, ROWS = 3, TOLD = 37;
  let text = "", index = null;

  const register = packed => { text = packed; };
  const scripts = () => (text ? [["curves", text]] : []);

  async function open() {
    if (index) return index;
    const bytes = Uint8Array.from(atob(text), letter => letter.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
    const all = new Uint8Array(await new Response(stream).arrayBuffer()), line = all.indexOf(10);
    index = { families: JSON.parse(new TextDecoder().decode(all.subarray(0, line))), rows: all.subarray(line + 1) };
    return index;
  }

  /* A row: its family, the tracing link, places of joints and point, sizes of coefficients. */
  function row({ families, rows }, k) {
    const view = new DataView(rows.buffer, rows.byteOffset + k * ROW, ROW), family = families[view.getUint8(0)];
    const at = j => [view.getInt16(2 + 4 * j, true) / GRID, view.getInt16(4 + 4 * j, true) / GRID];
    return { family, link: view.getUint8(1), places: family[1].map((_, j) => at(j)), point: at(JOINTS), sizes: sizesAt(rows, k) };
  }
  const sizesAt = (rows, k) => Array.from(rows.subarray((k + 1) * ROW - 2 * HARMONICS, (k + 1) * ROW), own => (own / 255) ** 2);

  /* Sizes of the coefficients over the arc length, of the unit curve: orders -8 ... -1, 1 ... 8, normed over 16. */
  function sizes(points) {
    const sides = points.map(([x, y], k) => { const [u, v] = points[(k + 1) % points.length]; return [u - x, v - y]; }), lengths = sides.map(side => Math.hypot(...side));
    const total = lengths.reduce((sum, own) => sum + own, 0), ways = sides.map(([x, y], k) => (lengths[k] ? [x / lengths[k], y / lengths[k]] : [0, 0]));
    const size = k => {
      let re = 0, im = 0, at = 0;
      ways.forEach(([x, y], j) => {
        const before = ways[(j + ways.length - 1) % ways.length], turn = (-2 * Math.PI * k * at) / total, c = Math.cos(turn), s = Math.sin(turn), bx = before[0] - x, by = before[1] - y;
        re += bx * c - by * s;
        im += bx * s + by * c;
        at += lengths[j];
      });
      return Math.hypot(re, im) / k ** 2;
    };
    const all = Array.from({ length: 2 * HARMONICS }, (_, k) => [size(k - 2 * HARMONICS), size(k + 1)]);
    const norm = Math.hypot(...all.flat()) || 1;
    return [...all.slice(HARMONICS).map(own => own[0]), ...all.slice(0, HARMONICS).map(own => own[1])].map(own => own / norm);
  }

  /* So many points at equal steps of the length of a polygon. */
  function even(points, count, closed = true) {
    const sides = points.slice(0, closed ? points.length : -1).map((p, k) => { const q = points[(k + 1) % points.length]; return Math.hypot(q[0] - p[0], q[1] - p[1]); });
    const total = sides.reduce((sum, own) => sum + own, 0), found = [];
    for (let k = 0, j = 0, gone = 0; k < count; k++) {
      const wanted = (k * total) / (closed ? count : count - 1);
      while (j < sides.length - 1 && gone + sides[j] < wanted) gone += sides[j++];
      const share = sides[j] ? Math.min(1, (wanted - gone) / sides[j]) : 0, p = points[j], q = points[(j + 1) % points.length];
      found.push([p[0] + share * (q[0] - p[0]), p[1] + share * (q[1] - p[1])]);
    }
    return found;
  }

  /* The error of a similar motion that takes one centre to another, and where it takes a point. */
  function similar({ error, a, b, mirror, from }, to) {
    return { error, map: ([x, y]) => { const u = x - from[0], v = mirror * (y - from[1]); return [to[0] + a * u - b * v, to[1] + b * u + a * v]; } };
  }

  /* The similar motion, reflected or not, that takes a curve onto the target, over all beginnings and both senses. */
  function laid(target, curve) {
    const mean = points => [0, 1].map(c => points.reduce((sum, p) => sum + p[c], 0) / points.length);
    const about = (points, [x, y]) => points.map(p => [p[0] - x, p[1] - y]), own = even(curve, POINTS), from = mean(own), to = mean(target);
    const w = about(target, to), size = w.reduce((sum, p) => sum + p[0] ** 2 + p[1] ** 2, 0);
    let best = { error: Infinity };
    for (const mirror of [1, -1]) {
      const z = about(own, from).map(([x, y]) => [x, mirror * y]), square = z.reduce((sum, p) => sum + p[0] ** 2 + p[1] ** 2, 0);
      for (const sense of [1, -1]) {
        for (let shift = 0; shift < POINTS; shift++) {
          let re = 0, im = 0;
          for (let k = 0; k < POINTS; k++) {
            const [x, y] = z[(((sense * k + shift) % POINTS) + POINTS) % POINTS], [u, v] = w[k];
            re += u * x + v * y;
            im += v * x - u * y;
          }
          const error = Math.sqrt(Math.max(0, 1 - (re * re + im * im) / (square * size)));
          if (error < best.error) best = { error, a: re / square, b: im / square, mirror };
        }
      }
    }
    return similar({ ...best, from }, to);
  }

  /* The part of a curve that is most like an open target, and the similar motion that takes it there. */
  function part(target, curve) {
    const own = even(curve, ROUND), mean = points => [0, 1].map(c => points.reduce((sum, p) => sum + p[c], 0) / points.length);
    const to = mean(target), w = target.map(p => [p[0] - to[0], p[1] - to[1]]), size = w.reduce((sum, p) => sum + p[0] ** 2 + p[1] ** 2, 0);
    let best = { error: Infinity };
    for (const length of PARTS) {
      for (let begin = 0; begin < ROUND; begin += BEGINS) {
        const z = w.map((_, k) => own[(begin + Math.round((k * length) / (FEW - 1))) % ROUND]), from = mean(z);
        const sums = [0, 0, 0, 0, 0, 0, 0, 0];
        let square = 0;
        for (let k = 0; k < FEW; k++) {
          const x = z[k][0] - from[0], y = z[k][1] - from[1], [u, v] = w[k], [r, t] = w[FEW - 1 - k];
          square += x * x + y * y;
          sums[0] += u * x + v * y; sums[1] += v * x - u * y; sums[2] += u * x - v * y; sums[3] += v * x + u * y;
          sums[4] += r * x + t * y; sums[5] += t * x - r * y; sums[6] += r * x - t * y; sums[7] += t * x + r * y;
        }
        for (let way = 0; way < 8; way += 2) {
          const [re, im] = [sums[way], sums[way + 1]], error = Math.sqrt(Math.max(0, 1 - (re * re + im * im) / (square * size || 1)));
          if (error < best.error) best = { error, a: re / square, b: im / square, mirror: way % 4 ? -1 : 1, from };
        }
      }
    }
    return similar(best, to);
  }

  /* A mechanism with these places; the last is the tracing point. */
  function drawn({ family: [links, joints, driven], link }, places) {
    return Turning.file(links, 0, joints, places, [[0, driven]], { P: { link, at: places[joints.length] } });
  }

  /* The curve that it draws in a turn; null if it does not turn, or does not close. */
  function curve(motion, own, places) {
    const engine = Engine.open(motion, drawn(own, places));
    try {
      if (engine.fault || engine.open || !engine.ready) return null;
      const swept = engine.sweep(SAMPLES);
      if (!swept || swept.turns !== 1) return null;
      return engine.pointMotion(own.link, places[places.length - 1], swept).slice(0, SAMPLES - 1).map(([x, y]) => [x, y]);
    } finally { engine.close(); }
  }

  /* For every target point the nearest place on a closed polygon: [side, share, distance along the normal]. */
  function feet(target, points) {
    return target.map(([x, y]) => {
      let best = [0, 0, Infinity];
      points.forEach(([ax, ay], k) => {
        const [bx, by] = points[(k + 1) % points.length], dx = bx - ax, dy = by - ay, square = dx * dx + dy * dy || 1e-300;
        const share = Math.min(1, Math.max(0, ((x - ax) * dx + (y - ay) * dy) / square)), far = Math.hypot(x - ax - share * dx, y - ay - share * dy);
        if (far < best[2]) best = [k, share, far];
      });
      return best;
    });
  }
  const between = (points, [k, share]) => { const p = points[k], q = points[(k + 1) % points.length]; return [p[0] + share * (q[0] - p[0]), p[1] + share * (q[1] - p[1])]; };

  /* Root mean square distance, target to curve and, of a closed target, curve to target. */
  function error(target, points, closed) {
    const square = (from, to) => feet(from, to).reduce((sum, own) => sum + own[2] ** 2, 0) / from.length;
    return closed === false ? Math.sqrt(square(target, points)) : Math.sqrt(0.5 * (square(target, points) + square(even(points, POINTS), target)));
  }

  /* The solution of A x = b by elimination with pivots. */
  function solve(A, b) {
    const n = b.length, M = A.map((own, k) => [...own, b[k]]);
    for (let c = 0; c < n; c++) {
      let p = c;
      for (let r = c + 1; r < n; r++) if (Math.abs(M[r][c]) > Math.abs(M[p][c])) p = r;
      [M[c], M[p]] = [M[p], M[c]];
      if (!M[c][c]) return null;
      for (let r = c + 1; r < n; r++) { const f = M[r][c] / M[c][c]; for (let k = c; k <= n; k++) M[r][k] -= f * M[c][k]; }
    }
    const x = new Array(n).fill(0);
    for (let r = n - 1; r >= 0; r--) x[r] = (M[r][n] - M[r].slice(r + 1, n).reduce((sum, own, k) => sum + own * x[r + 1 + k], 0)) / M[r][r];
    return x;
  }

  /* Damped Gauss-Newton steps over all places: residuals are the gaps from target points to their feet, and back. */
  function refined(motion, target, own, places, size, closed) {
    let points = curve(motion, own, places), best = error(target, points, closed), damping = 1e-2;
    for (let step = 0; step < STEPS && best > ENOUGH * size; step++) {
      const back = closed ? even(points, POINTS) : [], there = feet(target, points), here = feet(back, target).map(foot => between(target, foot)), on = feet(back, points);
      const gaps = now => [...there.map((foot, k) => { const [x, y] = between(now, foot); return [target[k][0] - x, target[k][1] - y]; }),
        ...on.map((foot, k) => { const [x, y] = between(now, foot); return [here[k][0] - x, here[k][1] - y]; })].flat();
      const r = gaps(points), columns = [];
      for (let k = 0; k < 2 * places.length; k++) {
        const moved = places.map(place => [...place]), h = DIFFERENCE * size;
        moved[k >> 1][k & 1] += h;
        const other = curve(motion, own, moved);
        columns.push(other ? gaps(other).map((value, i) => (value - r[i]) / h) : r.map(() => 0));
      }
      const normal = columns.map(p => columns.map(q => p.reduce((sum, value, i) => sum + value * q[i], 0))), slope = columns.map(p => -p.reduce((sum, value, i) => sum + value * r[i], 0));
      const trace = normal.reduce((sum, own2, k) => sum + own2[k], 0) / normal.length;
      let better = false;
      for (let trial = 0; trial < 5 && !better; trial++, damping *= 4) {
        const by = solve(normal.map((line, k) => line.map((value, j) => value + (k === j ? damping * trace : 0))), slope);
        if (!by || !by.every(Number.isFinite)) break;
        const moved = places.map(([x, y], k) => [x + by[2 * k], y + by[2 * k + 1]]), next = curve(motion, own, moved), far = next ? error(target, next, closed) : Infinity;
        if (far < best) { better = true; places = moved; points = next; damping = Math.max(1e-9, damping / 40); if (far > 0.995 * best) step = STEPS; best = far; }
      }
      if (!better) break;
    }
    return { places, error: best };
  }

  /* The rows that are worth looking at: a closed curve is asked by its sizes. */
  function likely(held, target) {
    const wanted = sizes(target), reversed = [...wanted].reverse(), far = [], apart = (a, b) => a.reduce((sum, own, k) => sum + (own - b[k]) ** 2, 0);
    for (let k = 0; k < held.rows.length / ROW; k++) { const own = sizesAt(held.rows, k); far.push([Math.min(apart(wanted, own), apart(reversed, own)), k]); }
    return far.sort((p, q) => p[0] - q[0]).slice(0, LOOKED).map(own => own[1]);
  }

  async function found(motion, drawnTarget, tell = () => true, closed = true) {
    const held = await open(), target = even(drawnTarget, POINTS, closed), few = closed ? null : even(drawnTarget, FEW, false), near = [];
    const looked = closed ? likely(held, target) : Array.from({ length: Math.floor(held.rows.length / ROW / ROWS) }, (_, k) => k * ROWS);
    for (const [n, k] of looked.entries()) {
      const own = row(held, k), places = [...own.places, own.point], points = curve(motion, own, places);
      if (points) { const { error: apart, map } = closed ? laid(target, points) : part(few, points); near.push({ own, places: places.map(map), error: apart }); }
      if (!closed && n % TOLD === 0 && (await tell((0.5 * n) / looked.length)) === false) break;
    }
    near.sort((p, q) => p.error - q.error);
    const size = Turning.extent(target), all = [];
    for (const [k, { own, places }] of near.slice(0, LAID).entries()) {
      if (curve(motion, own, places)) {
        const done = refined(motion, target, own, places, size, closed);
        all.push({ data: drawn(own, done.places), error: done.error / size });
      }
      if ((await tell(closed ? (k + 1) / LAID : 0.5 + (0.5 * (k + 1)) / LAID)) === false) break;
    }
    return all.sort((p, q) => p.error - q.error).slice(0, KEPT);
  }

  return { register, scripts, sizes, row, open, curve, found };
})();

if (typeof module !== "undefined") module.exports = Curves;
