"use strict";
/* Whether joints bind when an axis is tilted: glue round the kernels of the module `binding`; no mathematics of its own.
   All joints share the misalignment, small tilts, as `assess_coupled` of the library has it: estimated.

     const binding = Binding.open(await Kernels.load("binding"), drawn, limits, tilt);

   `drawn` is a mechanism in the form of files (JSON), as for the engine.  `limits` has one entry for each joint, angles in
   radians, lengths in the unit of the drawing:

     {tilt, end}                              a revolute joint: largest tilt, end float to either side
     {radius, height, clearance, slanted, end}   a bearing: its critical tilt; slanted: the hole is the long part (B)
     {roll, pitch, end}                       a guide or a slot
     null                                     guides nothing out of the plane, as gears and cams do

   `tilt` is {joint, alpha, direction = 0, base = joint.a, rigid = true}: the seat of that joint on the link `base` leans
   by alpha towards a direction in the frame of that link; a rigid one, a motor shaft, takes no clearance of its own.

     binding.fault           null, "limits" (one is negative or no number), "tilt" (no such joint, or no number)
     binding.at(pose)        -> {factor, lower, upper, allowed, binds, first, joints: [{joint, used, price, what}]}
     binding.over(poses, n)  -> {factors, used, prices, first, worst}, arrays over n poses
     binding.python()        a program that proves it with the library
     binding.close()         gives its memory back

   `factor`: the least factor on all limits with which the pose can be assembled; above 1 it binds, Infinity: no factor
   helps; NaN where the pose is not assembled.  `allowed`: how many times as large the misalignment may be.  `used`: the
   part of its limit that a joint uses at that factor, 1 where it is at its limit; `price`: the share of the joint in it;
   `first`: the joint with the largest one, which binds first, or null (-1 in `over`).  `what`: "tilt", "roll", "pitch" or
   "end".  `used` and `prices` of `over` are n x joints x 3: tilt or roll, pitch, end float. */

const Binding = (() => {
  const PLACE = "jamming.joints.kernels.sharing.";
  const GUIDES = ["P", "pin-slot"];

  class Seats {
    constructor(module, drawn, limits, tilt) {
      Object.assign(this, { module, drawn, limits, tilt, fault: null, kept: [] });
      /* joints that guide nothing are no part of the program */
      this.joints = drawn.joints.map((_, k) => k).filter((k) => limits[k] || tilt.joint === k);
      const tilted = drawn.joints[tilt.joint];
      if (!tilted || ![tilt.alpha, tilt.direction ?? 0].every(Number.isFinite)) this.fault = "tilt";
      const rows = this.joints.map((k) => this.limitsOf(k));
      if (rows.flat().some((value) => !(value >= 0 && value < Infinity))) this.fault = this.fault || "limits";
      if (this.fault) return;
      const { links, frame } = Engine.graphOf(drawn.graph);
      this.links = links;
      const own = this.joints.map((k) => drawn.joints[k]), count = own.length;
      const direction = tilt.direction ?? 0, side = (tilt.base ?? tilted.a) === tilted.a ? 1 : -1;
      this.seats = {
        pairs: this.array("i8", [count, 2], own.flatMap((j) => [BigInt(j.a), BigInt(j.b)])),
        guided: this.array("i8", [count], own.map((j) => BigInt(GUIDES.includes(j.kind)))),
        sizes: this.array("f8", [count, 10], own.flatMap((j) => [
          ...j.at_a, j.angle_a || 0, ...j.at_b, j.angle_b || 0, 0, 0, 0, 0])),
        limits: this.array("f8", [count, 3], rows.flat()),
        tilts: this.array("f8", [count, 3], this.joints.flatMap((k) => (k === tilt.joint
          ? [tilt.alpha * Math.cos(direction), tilt.alpha * Math.sin(direction), side] : [0, 0, 1]))),
      };
      const loops = this.array("f8", [Math.max(1, count), Math.max(1, count)]);
      const found = this.call("loops", this.seats.pairs, this.links, frame, loops);
      this.incidence = this.array("f8", [found, count], loops.data.slice(0, found * count));
    }

    /* Limits on tilt or roll, on pitch, and end float of a joint. */
    limitsOf(k) {
      const own = this.limits[k];
      if (k === this.tilt.joint && this.tilt.rigid !== false) return [0, 0, 0];
      if (!own) return [NaN, NaN, NaN];
      const end = Number(own.end ?? 0);
      if (GUIDES.includes(this.drawn.joints[k].kind)) return [Number(own.roll), Number(own.pitch), end];
      if (own.radius === undefined) return [Number(own.tilt), 0, end];
      const [radius, height, clearance] = [own.radius, own.height, own.clearance].map(Number);
      return [this.call("critical_tilt", radius, height / 2, clearance, Boolean(own.slanted)), 0, end];
    }

    call(kernel, ...args) {
      return this.module.call(PLACE + kernel, ...args);
    }

    array(type, shape, values = []) {
      const made = this.module.array(type, shape);
      made.data.set(values);
      this.kept.push(made);
      return made;
    }

    close() {
      this.module.free(...this.kept);
      this.kept = [];
    }

    shared(poses, n) {
      const joints = this.joints.length, shape = [n, joints, 3], size = 3 * n * joints;
      const found = {
        factors: { data: new Float64Array(2 * n), shape: [n, 2] },
        used: { data: new Float64Array(size), shape }, prices: { data: new Float64Array(size), shape },
      };
      const given = { data: Float64Array.from(poses), shape: [n, this.links, 3] };
      this.call("share", this.seats, this.incidence, given, found.factors, found.used, found.prices);
      /* nothing is known where the mechanism is not assembled */
      for (let i = 0; i < n; i++) {
        if (given.data.subarray(3 * this.links * i, 3 * this.links * (i + 1)).every(Number.isFinite)) continue;
        found.factors.data.fill(NaN, 2 * i, 2 * i + 2);
        for (const part of [found.used, found.prices]) part.data.fill(0, 3 * joints * i, 3 * joints * (i + 1));
      }
      return { factors: found.factors.data, used: found.used.data, prices: found.prices.data };
    }

    /* The joint and the limit with the largest price of pose i, or null. */
    largest(prices, i) {
      const width = 3 * this.joints.length, own = prices.subarray(i * width, (i + 1) * width);
      const at = own.reduce((best, price, k) => (price > own[best] ? k : best), 0);
      return own[at] > 0 ? at : null;
    }

    whatOf(column, part) {
      const guided = GUIDES.includes(this.drawn.joints[this.joints[column]].kind);
      return ["tilt", "pitch", "end"][part].replace("tilt", guided ? "roll" : "tilt");
    }

    at(pose) {
      if (this.fault) return null;
      const { factors: [lower, upper], used, prices } = this.shared(pose, 1), at = this.largest(prices, 0);
      const joints = this.joints.map((joint, column) => {
        const own = prices.subarray(3 * column, 3 * column + 3), lean = used.subarray(3 * column, 3 * column + 3);
        const part = [0, 1, 2].reduce((best, k) => (own[k] > own[best] || (own[k] === own[best] && lean[k] > lean[best]) ? k : best));
        return { joint, used: Math.max(...lean), price: own[0] + own[1] + own[2], what: this.whatOf(column, part) };
      });
      const first = at === null ? null : this.joints[Math.floor(at / 3)];
      return { factor: lower, lower, upper, allowed: 1 / lower, binds: lower > 1, first, joints };
    }

    over(poses, n) {
      if (this.fault) return null;
      const { factors: both, used, prices } = this.shared(poses, n), count = this.joints.length, all = this.drawn.joints.length;
      const factors = Float64Array.from({ length: n }, (_, i) => both[2 * i]);
      const first = Int32Array.from({ length: n }, (_, i) => {
        const at = this.largest(prices, i);
        return at === null ? -1 : this.joints[Math.floor(at / 3)];
      });
      const spread = (values) => {
        const wide = new Float64Array(3 * n * all);
        for (let i = 0; i < n; i++) {
          this.joints.forEach((k, c) => wide.set(values.subarray(3 * (i * count + c), 3 * (i * count + c) + 3), 3 * (i * all + k)));
        }
        return wide;
      };
      const worst = factors.reduce((best, value, i) => (value > factors[best] || Number.isNaN(factors[best]) ? i : best), 0);
      return { factors, used: spread(used), prices: spread(prices), first, worst };
    }

    /* The same question for the library, which proves the answer over the whole motion. */
    python() {
      const { drawn, tilt } = this, joint = drawn.joints[tilt.joint], [a, b] = [joint.a, joint.b].map(Number);
      const base = Number(tilt.base ?? a);
      const limits = this.joints.map((k) => {
        const own = drawn.joints[k], [first, second, end] = this.limitsOf(k);
        if (k === tilt.joint && tilt.rigid !== false) return "";
        const guided = GUIDES.includes(own.kind);
        const text = guided ? `SlideLimits(${first}, ${second}, ${end})` : `JointLimits(${first}, ${end})`;
        return `    (${Number(own.a)}, ${Number(own.b)}): ${text},\n`;
      });
      return program(drawn, ["from graphsynth.jamming.joints import JointLimits, Misalignment, SlideLimits"], [
        `limits = {\n${limits.join("")}}`,
        `tilt = Misalignment(${base}, ${a + b - base}, ${tilt.alpha}, ${tilt.direction ?? 0}, rigid=${tilt.rigid === false ? "False" : "True"})`,
        "print(graphsynth.assess_jamming(motion, tilt=tilt, joints=limits, certify=True))\n",
      ]);
    }
  }

  /* A program that asks the library about a turn of a mechanism: imports, then lines about `mechanism` and `motion`. */
  const program = (drawn, imports, lines) => [
    "import math\n",
    "import numpy as np\n",
    "import graphsynth",
    ...imports,
    `\nmechanism = graphsynth.Mechanism.from_json(${JSON.stringify(JSON.stringify(drawn))})`,
    "motion = mechanism.simulate(np.linspace(0.0, math.tau, 361))",
    ...lines,
  ].join("\n");

  return { program, open: (module, drawn, limits, tilt) => new Seats(module, drawn, limits, tilt) };
})();

if (typeof module !== "undefined") module.exports = Binding;
