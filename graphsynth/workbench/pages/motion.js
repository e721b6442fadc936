// The mechanism in motion: the drawing is handed to the engine, whose kernels do the mathematics; here is only when.
"use strict";

(function () {
  /** Numbers of links and places on them, as the engine counts: every link's own frame is that of the drawing. */
  const inverse = (pose, [x, y]) => {
    const c = Math.cos(pose[2]), s = Math.sin(pose[2]), u = x - pose[0], v = y - pose[1];
    return [c * u + s * v, c * v - s * u];
  };

  Bench.Motion = class {
    constructor(app, kernels) {
      Object.assign(this, { app, kernels, engine: null, sheet: null, swept: null, driver: 0, pulled: null, playing: false, way: 1 });
      Object.assign(this, { speed: 1, beat: 0 });
    }

    /** The engine for the drawing as it is now; opened when it is first needed. */
    current() {
      const { app } = this;
      if (this.sheet === app.sheet) return this.engine;
      if (this.engine) this.engine.close();
      Object.assign(this, { sheet: app.sheet, engine: null, swept: null, pulled: null });
      if (this.driver >= Math.max(1, app.sheet.drivers.length)) this.driver = 0;
      if (Object.keys(app.sheet.links).length < 2) return null;
      const data = Bench.written(app.sheet);
      if (data.joints.length) this.engine = Engine.open(this.kernels, data);
      this.way = 1;
      return this.engine;
    }
    get ready() { const engine = this.current(); return Boolean(engine && !engine.open); }
    /** Whether a driver can move it. */
    get driven() { const engine = this.current(); return Boolean(engine && engine.ready); }
    get input() { return this.driven ? this.engine.inputs[this.driver] : 0; }
    get turns() {
      const own = this.app.sheet.drivers[this.driver], joint = own && Bench.drivable(this.app.sheet, own.base, own.link);
      return !joint || joint.turns;
    }
    /** Whether the driver cannot move at all from here. */
    get stands() { const swept = this.sweep(); return !swept || !(swept.inputs[swept.inputs.length - 1] > swept.inputs[0]); }
    /** Why nothing moves, as the key of a sentence. */
    get why() {
      const engine = this.current();
      if (!engine) return "said.noengine";
      if (engine.open) return "said.open";
      return engine.fault ? "said.fault" : "said.undrivable";
    }

    /** One pass of the first driver: all that is reached from here. */
    sweep() {
      if (!this.driven) return null;
      if (!this.swept) this.swept = this.engine.sweep(361, this.driver);
      return this.swept;
    }

    /** Whether what is beside the drawing may wait for a later picture: numbers and charts follow every sixth one. */
    get waits() { return this.playing && this.beat !== 0; }

    row(link) { return Array.from(this.engine.pose.subarray(3 * link, 3 * link + 3)); }
    /** Show where it stands: moved, it is no longer what is drawn on. */
    show() {
      this.app.setMode("run");
      this.beat = (this.beat + 1) % 6;
      this.app.pose = Float64Array.from(this.engine.pose);
      this.app.changed("pose");
    }

    /** Take hold of a point or a link: the mechanism follows where it can. */
    grip(hit, place) {
      const { app } = this, { sheet } = app;
      const id = hit.point ? Bench.linksAt(sheet, hit.point).find(own => own !== Bench.GROUND) || Bench.GROUND : hit.link;
      const link = Bench.linkNumber(sheet, id);
      const point = hit.point ? [sheet.points[hit.point].x, sheet.points[hit.point].y] : inverse(this.row(link), [place.x, place.y]);
      let last = "";
      this.pause();
      return {
        to: target => {
          const { end } = this.engine.drag(link, point, [target.x, target.y]);
          this.pulled = end === "reached" ? null : { from: Bench.carried(this.row(link), point), to: [target.x, target.y] };
          if (end !== last) { last = end; app.say(`said.drag.${end}`); }
          this.show();
        },
        end: () => { this.pulled = null; this.settle(); },
      };
    }

    /** Dragged onto another branch than that of the sweep: it is swept anew. */
    settle() {
      if (this.swept && this.driven) {
        const k = this.nearest(), { poses } = this.swept, n = this.engine.pose.length;
        let far = 0;
        for (let c = 0; c < n; c++) far = Math.max(far, c % 3 === 2 ? 0 : Math.abs(poses[k * n + c] - this.engine.pose[c]));
        if (far > 0.05 * this.engine.Lc) this.swept = null;
      }
      this.app.changed("rest");
    }
    /** The sample of the sweep that is nearest to the input. */
    nearest(input = this.input) {
      const { inputs, full } = this.swept, span = inputs[inputs.length - 1] - inputs[0];
      const at = full ? ((((input - inputs[0]) % span) + span) % span) : input - inputs[0];
      return Math.max(0, Math.min(inputs.length - 1, Math.round((at / span) * (inputs.length - 1))));
    }

    /** Move the driver to a coordinate; what stops it is said. */
    to(input, quiet = false) {
      if (!this.driven) { this.app.say(this.why); return false; }
      const { reached, stop } = this.engine.advance(input, this.driver);
      this.show();
      if (stop && !quiet) this.app.line(this.told(stop), "");
      return reached;
    }

    /** A sentence about a stop or an event. */
    told({ kind, links = [], input }) {
      const names = links.map(k => Bench.linkName(this.app.sheet, Object.keys(this.app.sheet.links)[k])).join(", ");
      return Bench.word(`event.${kind.replace(" ", "-")}`, { links: names || "–", at: Bench.shownInput(this, input ?? this.input) });
    }

    /** Assemble a group in the next of its modes; says whether there is another. */
    assemble(group) {
      const all = Assembling.found(this.engine, group), { links } = this.engine.groups[group];
      if (!all.length) { this.app.say("said.nomode"); return; }
      // in the order of the first angle in which they differ, so that the button goes through all of them
      const turn = pose => links.map(link => Math.atan2(Math.sin(pose[3 * link + 2]), Math.cos(pose[3 * link + 2])));
      const below = (p, q) => { const k = p.findIndex((own, n) => Math.abs(own - q[n]) > 1e-6); return k >= 0 && p[k] < q[k]; };
      const here = turn(this.engine.pose), order = all.sort((p, q) => (below(turn(p), turn(q)) ? -1 : 1));
      this.pause();
      this.engine.take(order.find(pose => below(here, turn(pose))) || order[0]);
      this.swept = null;
      this.show();
      this.app.say("said.mode", { n: all.length + 1 });
      this.app.changed("rest");
      const player = document.getElementById("player").offsetHeight;
      if (!this.app.view.holds(Bench.box(this.app.posed()), player)) Bench.do.fit(this.app);
    }

    toggle() { if (this.playing) this.pause(); else this.play(); }
    play() {
      if (!this.driven || this.stands) { this.app.say(this.why); return; }
      this.app.setMode("run");
      this.playing = true;
      let before = performance.now();
      const step = now => {
        if (!this.playing) return;
        const time = Math.min(0.1, (now - before) / 1000);
        before = now;
        this.pass(time);
        if (this.playing) requestAnimationFrame(step);
      };
      requestAnimationFrame(step);
      this.app.changed("play");
    }
    /** One step of time: the driver goes on, and turns back where it cannot. */
    pass(time) {
      if (!this.driven) { this.pause(); return; }
      const swept = this.sweep(), span = Math.abs(swept.inputs[swept.inputs.length - 1] - swept.inputs[0]);
      const rate = (this.turns ? 2 * Math.PI : span) / 6;
      let goal = this.input + this.way * rate * this.speed * time;
      if (!swept.full) {
        const [low, high] = [swept.inputs[0], swept.inputs[swept.inputs.length - 1]];
        if (goal >= high) { goal = high; this.way = -1; } else if (goal <= low) { goal = low; this.way = 1; }
      }
      if (!this.to(goal, true)) this.way = -this.way;
    }
    pause() {
      if (!this.playing) return;
      this.playing = false;
      this.app.changed("play");
      this.app.changed("rest");
    }
  };

  /** A driver coordinate as it is shown: degrees, or a length. */
  Bench.shownInput = (motion, input) => {
    const tidy = value => Bench.shown(Math.round(value * 1e9) / 1e9, 4); // nothing for a zero that is left by rounding
    return motion.turns ? `${tidy((input * 180) / Math.PI)}°` : `${tidy(input)} ${Bench.unitName(motion.app.sheet.unit)}`;
  };
})();
