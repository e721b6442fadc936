"use strict";
/* Proof that a mechanism moves over a range of its driver on one branch: glue round the kernels of the module `proof`.

     Proving.found(motion, proof, data, asked, tell)    -> {low, high, full, boxes, known}
         data: in the form of files; asked: {pose, driver, from, to, turns}; from, to: the range of a sweep; turns: after
         how many it closes, 0 if it does not turn
         low, high: proved from the pose to there; full: it turns and is proved to close; known: false for gears and cams

   What is proved: for every input in the range the joint equations (the other drivers held) have exactly one solution
   beside that branch, which is continuous, regular everywhere, and begins beside the pose. */

const Proving = (() => {
  const PLACE = "kinematics.certify.kernels.", FIRST = 0.05, PART = 40, MOST = 200000;
  const AT = 0, STEP = 1, NODES = 2, TESTED = 3, DONE = 0, LIMIT = 1, UNKNOWN = 3;

  /* All equations, those of the drivers too, as the planning kernel writes them. */
  function equations(engine) {
    const { given } = engine, rows = engine.rows.shape[0] + given.drivers.shape[0], width = engine.rowTable.shape[1];
    const codes = { data: new BigInt64Array(6 * rows), shape: [rows, 6] }, table = { data: new Float64Array(width * rows), shape: [1, rows, width] };
    engine.call("planning.joint_rows", given, codes, table);
    return [codes, { data: table.data, shape: [rows, width] }];
  }

  async function found(motion, proof, data, { pose, driver, from, to, turns }, tell = () => true) {
    const engine = Engine.open(motion, data);
    try {
      engine.place(pose);
      const [rows, table] = equations(engine), { inputs, links, frame, Lc } = engine, start = inputs[driver];
      const box = { data: new Float64Array(12 * links), shape: [4, links, 3] }, whole = new Float64Array(rows.shape[0]);
      const step = FIRST * (data.joints[engine.number(data.drivers[driver])].kind === "P" ? Lc : 1), state = Float64Array.of(start, step, 0, 0);
      box.data.set(engine.pose);
      const march = (goal, limit) => proof.call(`${PLACE}march`, rows, table, frame, inputs, driver, goal, Lc, whole, box, state, limit);
      /* until it stops, some boxes at a time */
      const go = async goal => {
        for (;;) {
          const code = march(goal, Math.min(MOST, state[TESTED] + PART));
          if (code !== LIMIT || state[TESTED] >= MOST || (await tell(Math.abs((state[AT] - start) / (turns ? goal - start : to - from)))) === false) return code;
        }
      };
      if (march(to, 0) === UNKNOWN) return { known: false };
      const first = { data: Float64Array.from(box.data), shape: box.shape };
      const code = state[NODES] ? await go(turns ? start + 2 * Math.PI * turns : to) : LIMIT, high = state[AT], boxes = state[NODES];
      if (turns || !boxes) {
        const full = code === DONE && proof.call(`${PLACE}closes`, rows, table, frame, driver, first, start, box, high, turns);
        return { low: start, high, full, boxes, known: true };
      }
      /* and from the first node the other way */
      box.data.set(first.data);
      state.set([start, -step, 1, 0]);
      await go(from);
      return { low: state[AT], high, full: false, boxes: boxes + state[NODES] - 1, known: true };
    } finally { engine.close(); }
  }

  return { found };
})();

if (typeof module !== "undefined") module.exports = Proving;
