"use strict";
/* Proof that a mechanism moves over a range of its driver on one branch: glue round the kernels of the module `proof`.

     Proving.found(motion, proof, data, asked, tell)    -> {low, high, full, boxes, known}
         data: in the form of files; asked: {pose, driver, from, to, turns}; from, to: the range of a sweep; turns: after
         how many it closes, 0 if it does not turn
         low, high: proved from the pose to there; full: it turns and is proved to close; known: false for gears and cams

   What is proved: for every input in the range the joint equations (the other drivers held) have exactly one solution
   beside that branch, which is continuous, regular everywhere, and begins beside the pose.

     Proving.binds(motion, proof, binding, data, asked, tell)    -> {known, verdict, free, binds, everywhere, pieces, at, factor}
         data, asked: as above, with the `limits` and the `tilt` of `Binding`; binding: the module of that name
         verdict: "free" over the whole range, "binds" somewhere in it, or "undecided"; free, binds: shares of the
         range that are proved; pieces: [[low, high, lower, upper, state]]; at, factor: the middle of the
         piece that binds most and the least factor there; known: false for what the kernels do not know

   What is proved is the verdict of the library's `certify_coupled`, by a kernel that the library has too: bounds of the
   small-tilt model, and of what exact tilts change, in every box of the branch.  Limits are the numbers given. */

const Proving = (() => {
  const PLACE = "kinematics.certify.kernels.marching.", FIRST = 0.05, PART = 40, MOST = 200000;
  /* Narrowest and widest piece of a range, as in the library. */
  const WALK = "jamming.joints.kernels.walking.walk", SMALLEST = 1e-4, WIDEST = 128, PIECES = 4;
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

  /* The seats of all joints as the kernel of the walk takes them; null where a joint has no limits. */
  function seated(module, data, limits, tilt) {
    const own = Binding.open(module, data, limits, tilt);
    try {
      if (own.fault || own.joints.length !== data.joints.length || own.incidence.shape[0] === 0) return null;
      const copied = ({ data: values, shape }) => ({ data: values.slice(), shape });
      const { pairs, guided, sizes, limits: rows } = own.seats, tilts = new Float64Array(5 * own.joints.length);
      const { a } = data.joints[tilt.joint], direction = tilt.direction ?? 0;
      tilts.set([tilt.alpha, tilt.alpha, direction, direction, (tilt.base ?? a) === a ? 1 : -1], 5 * tilt.joint);
      return {
        pairs: copied(pairs), guided: copied(guided), sizes: copied(sizes), limits: copied(rows), low: copied(rows), high: copied(rows),
        tilts: { data: tilts, shape: [own.joints.length, 5] }, incidence: copied(own.incidence),
      };
    } finally { own.close(); }
  }

  async function binds(motion, proof, binding, data, { pose, driver, from, to, turns, limits, tilt }, tell = () => true) {
    const seats = seated(binding, data, limits, tilt);
    if (!seats) return { known: false };
    const engine = Engine.open(motion, data);
    try {
      engine.place(pose);
      const [rows, p] = equations(engine), { inputs, links, frame, Lc } = engine, start = inputs[driver];
      const whole = turns ? 2 * Math.PI * turns : to - from, widths = Float64Array.of(SMALLEST * whole, whole / WIDEST);
      const box = { data: new Float64Array(12 * links), shape: [4, links, 3] }, state = Float64Array.of(start, whole / WIDEST / 4, 0, 0, 0);
      const task = { rows, p, frame, turns: new Float64Array(rows.shape[0]), inputs, driver }, pieces = [];
      const room = { data: new Float64Array(5 * PART), shape: [PART, 5] };
      box.data.set(engine.pose);
      const walk = (goal, limit) => {
        state[PIECES] = 0;
        const code = proof.call(WALK, task, seats, goal, Lc, box, state, limit, widths, room);
        for (let k = 0; k < state[PIECES]; k++) pieces.push(Array.from(room.data.subarray(5 * k, 5 * k + 5)));
        return code;
      };
      /* until it stops, some pieces at a time */
      const go = async goal => {
        for (;;) {
          const code = walk(goal, Math.min(MOST, state[TESTED] + PART));
          if (code !== LIMIT || state[TESTED] >= MOST || (await tell(pieces.reduce((sum, own) => sum + own[1] - own[0], 0) / whole)) === false) return code;
        }
      };
      if (walk(start, 0) === UNKNOWN) return { known: false };
      let done = false;
      if (state[NODES]) {
        const first = box.data.slice();
        done = (await go(turns ? start + whole : to)) === DONE;
        if (done && !turns && from < start) {
          box.data.set(first);
          state.set([start, -whole / WIDEST / 4, 1, state[TESTED]]);
          done = (await go(from)) === DONE;
        }
      }
      const width = some => pieces.reduce((sum, own) => sum + (some(own[4]) ? own[1] - own[0] : 0), 0);
      const span = done ? width(() => true) : whole, free = width(own => own === 1) / span, bound = width(own => own === -1) / span;
      const all = done && pieces.every(own => own[4] === 1), most = pieces.filter(own => own[4] === -1).reduce((a, b) => (a && a[2] >= b[2] ? a : b), null);
      return {
        known: true, verdict: most ? "binds" : all ? "free" : "undecided", free, binds: bound, pieces,
        everywhere: done && pieces.every(own => own[4] === -1),
        at: most && 0.5 * (most[0] + most[1]), factor: most && most[2],
      };
    } finally { engine.close(); }
  }

  return { found, binds };
})();

if (typeof module !== "undefined") module.exports = Proving;
