"use strict";
/* Poses in which one group is assembled otherwise at the same driver coordinates: of a dyad the other one; of a larger
   group those that are found from random poses of its links, not necessarily all.

     Assembling.found(engine, group)    -> poses, each links x 3 */

const Assembling = (() => {
  const SAMPLES = 4;

  function found(engine, group, trials = 200) {
    if (!engine.ready) return [];
    const { links } = engine, own = engine.groups[group], steps = engine.modes.shape[0], kept = Float64Array.from(engine.modes.data);
    const rate = engine.inputs.map((_, k) => (k ? 0 : 1)), others = [], before = Float64Array.from(engine.pose);
    const read = () => {
      const X = engine.spare.X.data, pose = Float64Array.from(before);
      for (let link = 0; link < links; link++) {
        const at = c => X[SAMPLES * (4 * link + c)], raw = Math.atan2(at(3), at(2));
        pose.set([at(0), at(1), raw + 2 * Math.PI * Math.round((before[3 * link + 2] - raw) / (2 * Math.PI))], 3 * link);
      }
      const far = other => own.links.reduce((sum, link) => sum + Math.hypot((pose[3 * link] - other[3 * link]) / engine.Lc,
        (pose[3 * link + 1] - other[3 * link + 1]) / engine.Lc, 2 * Math.sin((pose[3 * link + 2] - other[3 * link + 2]) / 2)), 0);
      if (pose.every(Number.isFinite) && [before, ...others].every(other => far(other) > 1e-6)) others.push(pose);
    };
    let seed = 4711;
    const lot = () => { seed = (seed * 48271) % 2147483647; return (2 * seed) / 2147483647 - 1; };
    if (own.twoModes) {
      for (const [name, array] of Object.entries(engine.spare)) array.data.set(engine.state[name].data);
      const reached = new Float64Array(3);
      for (let s = 0; s < steps; s++) if (engine.order[s] === group) engine.modes.data[s] *= -1;
      engine.call("advancing.advance", engine.tables, engine.modes, engine.spare, engine.inputs, engine.inputs, rate, engine.sizes, reached);
      if (reached[1] === 0) read();
    } else {
      for (let trial = 0; trial < trials; trial++) {
        const poses = Float64Array.from(before);
        for (const link of own.links) poses.set([before[3 * link] + engine.Lc * lot(), before[3 * link + 1] + engine.Lc * lot(), before[3 * link + 2] + Math.PI * lot()], 3 * link);
        const [code] = engine.call("advancing.settle", engine.tables, engine.modes, engine.spare, engine.inputs, rate, { data: poses, shape: [links, 3] }, engine.sizes);
        if (code === 0) read();
      }
    }
    engine.modes.data.set(kept);
    return others;
  }

  return { found };
})();

if (typeof module !== "undefined") module.exports = Assembling;
