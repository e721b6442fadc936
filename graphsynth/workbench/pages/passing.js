"use strict";
/* Four-bars whose coupler passes through two to five wanted poses: the dyads are the kernel's, the engine drives pairs of
   them from pose to pose.  What is kept passes all poses in their order, the crank in one sense and within a turn, without
   leaving its assembly.

     Passing.found(design, motion, poses, turns, tell)    -> [{data, quality}], the best first
         poses: [[x, y, angle], ...]; turns: by how much the crank has turned in each pose after the first, or null; data: in the form of files, drawn in the first pose
         quality: sine of the least transmission angle on the way, seen at STEPS places between poses */

const Passing = (() => {
  const LINES = { 4: 60, 5: 720 }, MOST = 1500, PAIRS = 700, KEPT = 12, STEPS = 6, NEAR = 1e-6, GOOD = 60;
  /* Lengths of links, and distances of pivots from the poses, in sizes of the task. */
  const SHORT = 0.12, LONG = 4, AWAY = 3, ALIKE = 0.1;

  const turned = ([x, y], [fx, fy, fa], [tx, ty, ta]) => {
    const c = Math.cos(ta - fa), s = Math.sin(ta - fa);
    return [tx + c * (x - fx) - s * (y - fy), ty + s * (x - fx) + c * (y - fy)];
  };

  /* Dyads of practical size: [pivot, joint in the first pose]; with given turns of the link, or any. */
  function dyads(design, poses, size, turns = null) {
    const out = { data: new Float64Array(4 * MOST), shape: [MOST, 4] };
    const given = { data: Float64Array.from(poses.flat()), shape: [poses.length, 3] };
    const count = turns ? design.call("design.poses.kernels.cranks", given, Float64Array.from(turns), out)
      : design.call("design.poses.kernels.candidates", given, LINES[poses.length] || 1, out);
    const middle = [0, 1].map(c => poses.reduce((sum, pose) => sum + pose[c], 0) / poses.length);
    return Array.from({ length: count }, (_, k) => [Array.from(out.data.subarray(4 * k, 4 * k + 2)), Array.from(out.data.subarray(4 * k + 2, 4 * k + 4))])
      .filter(([pivot, joint]) => {
        const length = Math.hypot(joint[0] - pivot[0], joint[1] - pivot[1]);
        return length > SHORT * size && length < LONG * size && [pivot, joint].every(p => Math.hypot(p[0] - middle[0], p[1] - middle[1]) < AWAY * size);
      });
  }

  /* Pairs that can be links, the driven one first, the more compact ones first. */
  function pairs(driven, all, size) {
    const far = (p, q) => Math.hypot(p[0] - q[0], p[1] - q[1]), found = [];
    for (const a of driven) for (const b of all) {
      const sides = [far(a[0], a[1]), far(a[1], b[1]), far(b[0], b[1]), far(a[0], b[0])];
      if (Math.min(...sides) > SHORT * size) found.push([Math.max(...sides) / Math.min(...sides), a, b]);
    }
    return found.sort((p, q) => p[0] - q[0]).slice(0, PAIRS);
  }

  const file = (a, b, [x, y]) => Turning.file(4, 0, [[0, 1], [1, 2], [2, 3], [0, 3]], [a[0], a[1], b[1], b[0]], [[0, 1]], { P: { link: 2, at: [x, y] } });

  /* Drive it through all poses; the least sine of the transmission angle, or 0 if it does not pass them. */
  function quality(motion, data, a, poses, size, turns) {
    const angles = poses.map(pose => { const [x, y] = turned(a[1], poses[0], pose); return Math.atan2(y - a[0][1], x - a[0][0]); });
    let best = 0;
    for (const sense of turns ? [1] : [1, -1]) {
      const engine = Engine.open(motion, data);
      try {
        if (engine.fault || engine.open || !engine.ready) return 0;
        let at = 0, least = 1, passed = true;
        for (let i = 1; i < poses.length && passed; i++) {
          const by = turns ? turns[i - 1] - (turns[i - 2] || 0) : sense * (((sense * (angles[i] - angles[i - 1])) % (2 * Math.PI) + 2 * Math.PI) % (2 * Math.PI)), from = engine.inputs[0];
          at += Math.abs(by);
          passed = at < 2 * Math.PI;
          for (let k = 1; k <= STEPS && passed; k++) {
            passed = engine.advance(from + (by * k) / STEPS).reached;
            for (const { angle } of engine.transmission()) least = Math.min(least, Math.sin(angle));
          }
          const [x, y] = [engine.pose[6], engine.pose[7]], turn = engine.pose[8] - (poses[i][2] - poses[0][2]);
          const wanted = turned([0, 0], poses[0], poses[i]);
          passed = passed && Math.hypot(x - wanted[0], y - wanted[1]) < NEAR * size * 10 && Math.abs(Math.sin(turn / 2)) < NEAR;
        }
        if (passed) best = Math.max(best, least);
      } finally { engine.close(); }
    }
    return best;
  }

  async function found(design, motion, poses, turns = null, tell = () => true) {
    const size = Turning.extent(poses);
    if (!(size > 0)) return [];
    const kept = [], free = dyads(design, poses, size), all = pairs(turns ? dyads(design, poses, size, turns) : free, free, size);
    const alike = ([a, b], [c, d]) => [[a[0], c[0]], [a[1], c[1]], [b[0], d[0]], [b[1], d[1]]].every(([p, q]) => Math.hypot(p[0] - q[0], p[1] - q[1]) < ALIKE * size);
    for (const [k, [, a, b]] of all.entries()) {
      const data = file(a, b, poses[0]), good = kept.some(own => alike(own.pair, [a, b])) ? 0 : quality(motion, data, a, poses, size, turns);
      if (good > 1e-3) kept.push({ data, quality: good, pair: [a, b] });
      if (k % 20 === 19 && (await tell(k / all.length)) === false) break;
      if (kept.length >= GOOD) break;
    }
    return kept.sort((p, q) => q.quality - p.quality).slice(0, KEPT).map(({ data, quality: good }) => ({ data, quality: good }));
  }

  return { found };
})();

if (typeof module !== "undefined") module.exports = Passing;
