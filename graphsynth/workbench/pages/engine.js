"use strict";
/* The planar engine for the page: glue round the kernels of the module `motion`; it holds no mathematics of its own.

     const engine = Engine.open(await Kernels.load("motion"), drawn);

   `drawn` is a mechanism in the form of files (JSON).  Links, joints and drivers are told by their numbers in it, driver
   coordinates in radians and lengths, counted as angles of the pose are; poses are Float64Array of links x 3 (x, y,
   angle).  Velocities and accelerations are derivatives by the coordinate of the driver that moved last.

     engine.mobility, engine.fault      fault: null or {kind, tooMany, loose, link}, see FAULTS
     engine.groups                      [{kind, links, closed}], kind as in the library: "RRR", "group of 4 links", ...
     engine.pose, engine.inputs         what it stands in now; engine.velocities, engine.accelerations
     engine.advance(to, driver = 0)     -> {reached, input, stop}, stop: null or {kind, group, links}, see STOPS
     engine.drag(link, point, target)   -> {left, end}, end: "reached", "nearest", "singular", "open"
     engine.sweep(n, driver = 0)        -> {inputs, poses, velocities, accelerations, margins, events, full, turns}, turns: after how many it closes
     engine.instantCentres()            -> Float64Array links x links x 2
     engine.pointMotion(link, at, swept) -> n x [x, y, vx, vy, ax, ay] of a point of a link over a sweep, or as it stands
     engine.transmission(margins)       -> [{group, angle}]
     engine.drivers()                   -> joints that could drive it
     Engine.graphOf(text)               -> {links, frame} of the text of a graph
     engine.place(pose)                 -> whether the joints close there; the branch is the nearest one
     engine.close()                     gives its memory back */

const Engine = (() => {
  const PLACE = "kinematics.engine.kernels.";
  const KINDS = ["R", "P", "pin-slot", "gear", "cam"];
  const FAULTS = ["", "drivers", "length", "parallel", "twice"];
  const STOPS = ["", "limit", "lost", "lost", "singular", "input", "change point", "passage"];
  const LIMIT = 1, MEETING = 6, BEHIND = 4e-7, TWO_MODES = [2, 3, 4, 7], DRIVE_P = 1, TURNS = 6;
  const ROW_WIDTH = 12, ELIMINATED_WIDTH = 13, DRIVE_WIDTH = 8, SAMPLES = 4;
  const STEPS = 0, TOUCHED = 1, ROWS = 2, CORE = 3, GONE = 4, DRIVES = 5, GEARS = 6, AT = 7;
  /* Shifts of driver coordinates with which a pose on the limit of a driver is assembled. */
  const SHIFTS = [0, 1e-13, 1e-12, 1e-11, 1e-10, 1e-9, 1e-8, 1e-7];

  const numbers = (joint) => [
    ...joint.at_a, joint.angle_a || 0, ...joint.at_b, joint.angle_b || 0,
    joint.radius_a ?? joint.radius ?? 0, joint.radius_b ?? 0,
    joint.kind === "gear" ? (joint.internal ? -1 : 1) : 0, joint.offset || 0,
  ];

  /* How many links, and which one is the frame: the text of a graph. */
  function graphOf(text) {
    const [chain, ...fields] = text.trim().split(/\s+/);
    const codes = [...chain].map((letter) => letter.charCodeAt(0) - 63);
    const links = codes[0] < 63 ? codes[0] : (codes[1] << 12) | (codes[2] << 6) | codes[3];
    const frame = fields.find((field) => /^f\d+$/.test(field));
    return { links, frame: frame === undefined ? 0 : Number(frame.slice(1)) };
  }

  class Mechanism {
    constructor(motion, drawn) {
      this.motion = motion;
      this.kept = [];
      const { links, frame } = graphOf(drawn.graph);
      const joints = drawn.joints;
      Object.assign(this, { drawn, links, frame, joints, fault: null, groups: [], ready: false });
      this.number = (driver) => joints.findIndex((j) =>
        (j.a === driver.base && j.b === driver.link) || (j.b === driver.base && j.a === driver.link));
      const drivers = (drawn.drivers || []).map((driver) => [this.number(driver), driver.base]);
      this.mobility = joints.reduce((sum, j) => sum - (j.kind === "R" || j.kind === "P" ? 2 : 1), 3 * (links - 1));
      this.given = this.givenOf(drivers);
      [this.Lc, this.far] = this.call("planning.sizes_of", this.given, links);
      this.sizes = [this.Lc, this.far];
      this.equations();
      this.pose = Float64Array.from((drawn.pose || joints.map(() => [0, 0, 0]).concat(Array(links).fill([0, 0, 0]))).slice(0, links).flat());
      this.velocities = new Float64Array(3 * links);
      this.accelerations = new Float64Array(3 * links);
      this.inputs = new Float64Array(drivers.length);
      this.plan();
      this.place(this.pose);
    }

    call(kernel, ...args) {
      return this.motion.call(PLACE + kernel, ...args);
    }

    array(type, shape) {
      const made = this.motion.array(type, shape);
      this.kept.push(made);
      return made;
    }

    close() {
      this.motion.free(...this.kept);
      this.kept = [];
    }

    /* What the kernels read of a mechanism. */
    givenOf(drivers) {
      const { joints } = this;
      const waves = Math.max(0, ...joints.map((joint) => 2 * (joint.harmonics || []).length));
      const harmonics = new Float64Array(joints.length * waves);
      joints.forEach((joint, k) => harmonics.set((joint.harmonics || []).flat(), k * waves));
      return {
        joints: { data: joints.flatMap((j) => [KINDS.indexOf(j.kind), j.a, j.b]), shape: [joints.length, 3] },
        sizes: { data: Float64Array.from(joints.flatMap(numbers)), shape: [1, joints.length, 10] },
        waves: { data: harmonics, shape: [joints.length, waves] },
        drivers: { data: drivers.flat(), shape: [drivers.length, 2] },
      };
    }

    /* All equations of the joints, for pulling. */
    equations() {
      const count = this.joints.reduce((sum, j) => sum + (j.kind === "R" || j.kind === "P" ? 2 : 1), 0);
      const width = ROW_WIDTH + this.given.waves.shape[1];
      this.rows = this.array("i8", [count, 6]);
      const table = this.array("f8", [1, count, width]);
      this.call("planning.joint_rows", { ...this.given, drivers: { data: [], shape: [0, 2] } }, this.rows, table);
      this.rowTable = this.array("f8", [count, width]);
      this.rowTable.data.set(table.data);
      this.way = this.array("f8", [3 * (this.links - 1)]);
    }

    /* An outline of the program: its arrays, and what stands in the way. */
    outline(given) {
      const { links } = this, joints = this.joints.length, drivers = given.drivers.shape[0], most = 2 * joints + drivers + links;
      const shapes = {
        steps: [links + drivers, 10], touched: [2 * joints + 1], rows: [most, 5], source: [most, 4], core: [links + 1],
        eliminated: [links, 4], pins: [links, 2], drives: [drivers, 4], gears: [joints], structure: [links, 3], counts: [8],
      };
      const found = Object.fromEntries(Object.entries(shapes).map(([name, shape]) => [name, this.motion.array("i8", shape)]));
      return [found, this.call("planning.outline", given, this.frame, found)];
    }

    /* The program of the drivers, or the fault. */
    plan() {
      const [found, fault] = this.outline(this.given), { links } = this;
      const whole = (array, length, width = 1) => Array.from(array.data.subarray(0, length * width), Number);
      const counts = whole(found.counts, 8), structure = whole(found.structure, links, 3);
      const marked = (bit) => [...Array(links).keys()].filter((link) => structure[3 * link + 2] & bit);
      if (fault) {
        const kind = fault > 1 ? FAULTS[fault] : this.mobility === this.inputs.length ? "over-constrained" : "drivers";
        this.fault = { kind, tooMany: fault === 1 ? marked(1) : [], loose: fault === 1 ? marked(2) : [], link: fault > 1 ? counts[AT] : null };
        this.motion.free(...Object.values(found));
        return;
      }
      const cut = (array, length, width) => {
        const made = this.array("i8", width ? [length, width] : [length]);
        made.data.set(array.data.subarray(0, made.length));
        return made;
      };
      const width = ROW_WIDTH + this.given.waves.shape[1], rows = counts[ROWS];
      const tables = {
        steps: cut(found.steps, counts[STEPS], 10), touched: cut(found.touched, Math.max(1, counts[TOUCHED])),
        rows: cut(found.rows, rows, 5), row_table: this.array("f8", [1, rows, width]),
        core: cut(found.core, Math.max(1, counts[CORE])), eliminated: cut(found.eliminated, counts[GONE], 4),
        eliminated_table: this.array("f8", [1, counts[GONE], ELIMINATED_WIDTH]), drives: cut(found.drives, counts[DRIVES], 4),
        drive_table: this.array("f8", [1, counts[DRIVES], DRIVE_WIDTH]), need_angle: this.array("b1", [links]),
      };
      this.call("planning.fill", this.given, found, tables.row_table, tables.eliminated_table, tables.drive_table);
      this.steps = whole(tables.steps, counts[STEPS], 10);
      const gears = whole(found.gears, counts[GEARS]), table = whole(tables.rows, rows, 5);
      for (const r of gears) tables.need_angle.data[table[5 * r + 1]] = tables.need_angle.data[table[5 * r + 2]] = 1;
      this.motion.free(...Object.values(found));
      this.tables = tables;
      this.modes = this.array("f8", [counts[STEPS]]);
      this.state = this.newState(gears.length);
      this.spare = this.newState(gears.length);
      this.groupNumber = Array.from({ length: links }, (_, link) => structure[3 * link + 1]);
      this.groups = this.describe();
      this.order = Array.from({ length: counts[STEPS] }, (_, s) => this.steps[10 * s + 9]);
    }

    newState(gears) {
      const { links } = this, steps = this.modes.shape[0], f8 = (...shape) => this.array("f8", [...shape, SAMPLES]);
      return { X: f8(links, 4), TH: f8(links), V: f8(links, 3), W: f8(links, 3), PHI: f8(Math.max(1, gears)), M: f8(steps) };
    }

    /* The groups by their joints: a dyad as outer, inner, outer. */
    describe() {
      const found = [];
      for (let group = 1; group <= Math.max(0, ...this.groupNumber); group++) {
        const at = (link) => this.groupNumber[link];
        const own = this.joints.filter((j) => Math.max(at(j.a), at(j.b)) === group);
        const inner = own.filter((j) => at(j.a) === at(j.b)), outer = own.filter((j) => at(j.a) !== at(j.b));
        const links = [...this.groupNumber.keys()].filter((link) => at(link) === group);
        let kind = `group of ${links.length} links`;
        if (links.length === 2 && inner.length === 1 && outer.length === 2) {
          const [first, last] = outer.map((j) => j.kind).sort().reverse();
          kind = first + inner[0].kind + last;
        } else if (links.length === 1) kind = outer.map((j) => j.kind).join("+");
        found.push({ kind, links });
      }
      for (let s = 0; s < this.modes.shape[0]; s++) {
        const group = this.steps[10 * s + 9];
        if (group >= 0) found[group].twoModes = TWO_MODES.includes(this.steps[10 * s]);
      }
      return found;
    }

    /* Take a pose, or one near it where the joints close; the branch of the drivers is the nearest one. */
    place(pose) {
      if (this.mobility < 0) {
        this.open = true; /* more equations than freedoms: only a drawing */
        return false;
      }
      const poses = { data: Float64Array.from(pose), shape: [this.links, 3] };
      const far = this.call("dragging.closed_pose", this.rows, this.rowTable, this.frame, poses, this.Lc);
      this.open = !Number.isFinite(far);
      if (!this.open) this.take(poses.data);
      return !this.open;
    }

    /* Make a pose on the joints the one that everything starts from. */
    take(pose) {
      this.pose = Float64Array.from(pose);
      this.ready = false;
      if (this.fault || !this.inputs.length) return;
      const poses = { data: this.pose, shape: [this.links, 3] };
      this.call("advancing.driver_coordinates", this.given, poses, this.inputs);
      const rate = new Float64Array(this.inputs.length);
      rate[0] = 1;
      /* on the limit of a driver rounding decides whether it can be assembled: a last digit is given away there */
      for (const shift of SHIFTS) {
        for (const sign of shift ? [1, -1] : [1]) {
          const inputs = this.inputs.map((q) => q + sign * shift);
          const [code] = this.call("advancing.settle", this.tables, this.modes, this.state, inputs, rate, poses, this.sizes);
          if (code === 0) {
            this.inputs = inputs;
            this.ready = true;
            this.read();
            return;
          }
        }
      }
    }

    /* Velocities and accelerations, and the pose with its turns, from the state. */
    read(withPose = false) {
      const { X, TH, V, W } = this.state, need = this.tables.need_angle.data;
      for (let link = 0; link < this.links; link++) {
        for (let c = 0; c < 3; c++) {
          this.velocities[3 * link + c] = V.data[SAMPLES * (3 * link + c)];
          this.accelerations[3 * link + c] = W.data[SAMPLES * (3 * link + c)];
        }
        if (!withPose) continue;
        const at = (c) => X.data[SAMPLES * (4 * link + c)], before = this.pose[3 * link + 2];
        this.pose[3 * link] = at(0);
        this.pose[3 * link + 1] = at(1);
        const raw = Math.atan2(at(3), at(2)), turn = 2 * Math.PI;
        this.pose[3 * link + 2] = need[link] ? TH.data[SAMPLES * link] : raw + turn * Math.floor((before - raw) / turn + 0.5);
      }
    }

    /* What stopped a driver that went a way to coordinates; where two modes meet and it is not assembled right behind, they end. */
    stopOf(code, step, inputs, driver, way, state) {
      if (code === 0) return null;
      const group = step >= 0 ? this.order[step] : -1, found = new Float64Array(3);
      if (code === MEETING) {
        const on = inputs.map((q, k) => (k === driver ? q + Math.sign(way) * BEHIND * (this.slides(driver) ? this.Lc : 1) : q));
        this.spared(state);
        this.call("advancing.advance", this.tables, this.modes, this.spare, on, on, new Float64Array(on.length), this.sizes, found);
      }
      return { kind: STOPS[found[1] ? LIMIT : code], group, links: group >= 0 ? this.groups[group].links : [] };
    }
    slides(driver) { return this.joints[this.given.drivers.data[2 * driver]].kind === "P"; }
    spared(from) { for (const [name, array] of Object.entries(this.spare)) array.data.set(from[name].data); }

    /* Move a driver to a coordinate, the others stay. */
    advance(to, driver = 0) {
      if (!this.ready) return { reached: false, input: this.inputs[driver], stop: { kind: "lost", group: -1, links: [] } };
      const goal = Float64Array.from(this.inputs), rate = new Float64Array(goal.length), found = new Float64Array(3);
      goal[driver] = to;
      rate[driver] = 1;
      this.call("advancing.advance", this.tables, this.modes, this.state, this.inputs, goal, rate, this.sizes, found);
      const from = this.inputs[driver], [part, code, step] = found;
      this.inputs[driver] = part === 1 ? to : from + part * (to - from);
      this.read(true);
      return { reached: code === 0, input: this.inputs[driver], stop: this.stopOf(code, step, this.inputs, driver, to - from, this.state) };
    }

    /* Pull a point of a link (in its own frame) to a place, as near as it comes. */
    drag(link, point, target) {
      if (this.open) return { left: NaN, end: "open" };
      if (this.mobility === 0) return { left: NaN, end: "nearest" };
      const poses = { data: this.pose, shape: [this.links, 3] }, found = new Float64Array(3);
      this.call("dragging.drag", this.rows, this.rowTable, this.frame, poses, link, Float64Array.from(point),
        Float64Array.from(target), this.way, this.Lc, found);
      if (found[1] !== 9) this.take(poses.data);
      return { left: found[0], end: { 0: "reached", 4: "singular", 8: "nearest", 9: "open" }[found[1]] };
    }

    /* The drivers at their coordinates swept over n samples; nothing that stands here changes. */
    swept(from, start, goal, driver, n) {
      const { links } = this, steps = this.modes.shape[0], watched = this.watched();
      this.spared(from);
      const out = {
        poses: { data: new Float64Array(n * links * 3), shape: [n, links, 3] },
        velocities: { data: new Float64Array(n * links * 3), shape: [n, links, 3] },
        accelerations: { data: new Float64Array(n * links * 3), shape: [n, links, 3] },
        margins: { data: new Float64Array(n * steps), shape: [n, steps] },
        reversals: { data: new Float64Array(128), shape: [64, 2] },
      };
      const found = new Float64Array(5), way = goal[driver] - start[driver];
      const table = { data: Float64Array.from(watched.flatMap(({ link, along }) => [link, ...along])), shape: [watched.length, 3] };
      this.call("advancing.sweep", this.tables, this.modes, this.spare, start, goal, 1 / way, table, out, this.sizes, found);
      const [reached, part, code, step, count] = found, at = start[driver] + part * way, there = start.map((q, k) => (k === driver ? at : q));
      const events = Array.from({ length: count }, (_, k) => ({
        kind: "dead centre", input: start[driver] + out.reversals.data[2 * k + 1] * way,
        links: [watched[out.reversals.data[2 * k]].link], group: this.groupNumber[watched[out.reversals.data[2 * k]].link] - 1,
      }));
      const inputs = Float64Array.from({ length: n }, (_, i) => start[driver] + (i / Math.max(1, n - 1)) * way);
      return { inputs, ...Object.fromEntries(Object.entries(out).map(([name, array]) => [name, array.data])),
        events, reached, at, stop: this.stopOf(code, step, there, driver, way, this.spare) };
    }

    /* Coordinates on the frame that are not driven: a link, and the direction in which it slides (zeros if it turns). */
    watched() {
      const driven = new Set((this.drawn.drivers || []).map((driver) => this.number(driver)));
      return this.joints.flatMap((joint, k) => {
        const angle = joint.a === this.frame ? joint.angle_a : joint.angle_b;
        if (driven.has(k) || (joint.a !== this.frame && joint.b !== this.frame) || !["R", "P"].includes(joint.kind)) return [];
        const link = joint.a === this.frame ? joint.b : joint.a;
        return [{ link, along: joint.kind === "P" ? [Math.cos(angle), Math.sin(angle)] : [0, 0] }];
      });
    }

    /* A whole rotation from here, or all that is reached from here in both directions, over n samples. */
    sweep(n = 361, driver = 0) {
      if (!this.ready) return null;
      const slides = this.slides(driver), span = slides ? 4 * this.Lc : 2 * Math.PI, start = Float64Array.from(this.inputs);
      const end = (by) => start.map((q, k) => (k === driver ? q + by : q));
      const forward = this.swept(this.state, start, end(span), driver, n);
      if (!forward.stop && !slides) {
        /* a group of more than two links may come back in another assembly: it is turned until it closes */
        for (let turns = 1, whole = forward; turns <= TURNS && !whole.stop; whole = this.swept(this.state, start, end(++turns * span), driver, turns * (n - 1) + 1)) {
          if (this.closes(whole)) return { ...whole, full: true, turns };
        }
        return { ...forward, full: true, turns: Infinity };
      }
      const backward = this.swept(this.state, start, end(-span), driver, 2);
      const events = [backward, forward].filter((way) => way.stop).map((way) => ({ ...way.stop, input: way.at }));
      const whole = this.between(start, backward.at, forward.at, driver, n);
      return { ...whole, events: [...events, ...whole.events].sort((a, b) => a.input - b.input), full: false };
    }

    /* Samples from one limit to the other, followed from here both ways: a group of more than two links is singular there. */
    between(start, low, high, driver, n) {
      const at = (input) => start.map((q, j) => (j === driver ? input : q)), step = (high - low) / (n - 1);
      const k = Math.min(n - 2, Math.max(1, Math.round((start[driver] - low) / step) || 1)), middle = at(low + k * step);
      const [down, up] = [[low, k + 1], [high, n - k]].map(([end, count]) => {
        this.swept(this.state, start, middle, driver, 2);
        return this.swept(this.spare, middle, at(end), driver, count);
      });
      const found = { events: [...down.events, ...up.events] };
      for (const name of ["inputs", "poses", "velocities", "accelerations", "margins"]) {
        const width = up[name].length / (n - k), made = found[name] = new Float64Array(n * width);
        for (let i = 0; i < k; i++) made.set(down[name].subarray((k - i) * width, (k - i + 1) * width), i * width);
        made.set(up[name], k * width);
      }
      return found;
    }

    /* Whether the last pose of a sweep is the first one, but for whole turns. */
    closes({ poses }) {
      const last = poses.length - 3 * this.links, near = 1e-6;
      for (let k = 0; k < 3 * this.links; k++) {
        const far = poses[last + k] - poses[k], turn = 2 * Math.PI;
        if (Math.abs(k % 3 === 2 ? far - turn * Math.round(far / turn) : far / this.Lc) > near) return false;
      }
      return true;
    }

    instantCentres() {
      const centres = { data: new Float64Array(2 * this.links ** 2), shape: [this.links, this.links, 2] };
      this.call("advancing.instant_centres", this.state.X, this.state.V, centres);
      return centres.data;
    }

    pointMotion(link, [x, y], swept = null) {
      const { poses, velocities, accelerations } = swept || { ...this, poses: this.pose };
      const n = poses.length / (3 * this.links), out = { data: new Float64Array(6 * n), shape: [n, 6] };
      const given = [poses, velocities, accelerations].map((data) => ({ data, shape: [n, this.links, 3] }));
      this.call("advancing.point_motion", ...given, link, x, y, out);
      return Array.from({ length: n }, (_, i) => out.data.subarray(6 * i, 6 * i + 6));
    }

    /* Transmission angles of dyads: their sine is the root of the margin. */
    transmission(margins = null) {
      const own = margins || Array.from(this.order, (_, s) => this.state.M.data[SAMPLES * s]);
      return this.order.flatMap((group, s) => (group >= 0 && this.groups[group].twoModes
        ? [{ group, angle: Math.asin(Math.sqrt(Math.min(1, Math.max(0, own[s])))) }] : []));
    }

    /* Joints that could drive the mechanism, one driver in place of the first. */
    drivers() {
      const others = (this.drawn.drivers || []).slice(1).map((driver) => [this.number(driver), driver.base]);
      return this.joints.flatMap((joint, k) => {
        if (!["R", "P"].includes(joint.kind) || others.some(([other]) => other === k)) return [];
        const [found, fault] = this.outline(this.givenOf([[k, joint.a], ...others]));
        this.motion.free(...Object.values(found));
        return fault ? [] : [k];
      });
    }
  }

  return { open: (motion, drawn) => new Mechanism(motion, drawn), graphOf, FAULTS, STOPS, TURNS, DRIVE_P };
})();

if (typeof module !== "undefined") module.exports = Engine;
