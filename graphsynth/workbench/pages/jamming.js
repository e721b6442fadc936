// Tilt an axis and see which joint binds where: the kernels judge the pose that is shown and the whole motion.
"use strict";

(function () {
  const { make, svg } = Bench, DEGREE = Math.PI / 180;
  /** Pixels of the handle for one radian of tilt; the largest tilt. */
  const HANDLE = 900, MOST = (30 * Math.PI) / 180;

  /** The joints that can be asked about: [number, words]. */
  function joints(app, data) {
    const ids = Object.keys(app.sheet.links), name = k => Bench.linkName(app.sheet, ids[k]);
    return data.joints.map((joint, k) => [k, Bench.word("jam.joint", { kind: Bench.kindName(joint.kind), a: name(joint.a), b: name(joint.b) })])
      .filter(([k]) => ["R", "P", "pin-slot"].includes(data.joints[k].kind));
  }

  Bench.Jamming = class {
    constructor(app, place) {
      Object.assign(this, { app, place, on: false, module: null, seats: null, sheet: null, over: null, now: null, proof: null });
      Object.assign(this, { joint: null, alpha: 1 * DEGREE, direction: 0, tilt: 0.5 * DEGREE, end: 0 });
      app.on("sheet rest tool", () => this.build());
      app.on("pose sheet rest view", () => this.show());
    }

    get motion() { return this.app.motion; }
    /** The link on which the axis leans: the frame, or the joint's first one. */
    get base() {
      const { a, b } = this.data.joints[this.joint];
      return b === Bench.linkNumber(this.app.sheet, Bench.GROUND) ? b : a;
    }
    /** The seats of the drawing as it is now, for the kernels. */
    open() {
      const { app } = this;
      if (this.seats && this.sheet === app.sheet) return this.seats;
      this.close();
      this.sheet = app.sheet;
      this.data = Bench.written(app.sheet);
      const known = joints(app, this.data).map(([k]) => k), driver = this.data.drivers[0];
      if (!known.includes(this.joint)) {
        const driven = driver ? this.data.joints.findIndex(j => [j.a, j.b].includes(driver.base) && [j.a, j.b].includes(driver.link)) : -1;
        this.joint = driven >= 0 ? driven : known[0];
      }
      const limits = this.limits = this.data.joints.map(({ kind }) => ({ R: { tilt: this.tilt, end: this.end } })[kind] ||
        (kind === "P" || kind === "pin-slot" ? { roll: this.tilt, pitch: this.tilt, end: this.end } : null));
      this.leaning = { joint: this.joint, alpha: this.alpha, direction: this.direction, base: this.base };
      this.seats = Binding.open(this.module, this.data, limits, this.leaning);
      return this.seats;
    }
    close() {
      if (this.seats) this.seats.close();
      // a proof of what is no longer asked is given up
      if (this.proof && !this.proof.found) this.app.work.stop();
      Object.assign(this, { seats: null, over: null, now: null, proof: null });
    }
    /** The judgement over the whole motion. */
    whole() {
      const swept = this.on && this.motion.driven ? this.motion.sweep() : null, seats = swept && this.open();
      if (!seats || seats.fault) return null;
      if (!this.over || this.over.swept !== swept) this.over = { swept, ...seats.over(swept.poses, swept.inputs.length) };
      return this.over;
    }

    async turn(on) {
      const { app } = this;
      try {
        if (on) {
          await Bench.need("binding.wasm");
          this.module = await Kernels.load("binding");
        }
      } catch (fault) { app.fault(fault instanceof Bench.Fault ? fault : new Bench.Fault("fault.job", { error: fault.message })); return; }
      this.on = on;
      this.close();
      app.changed("rest");
    }
    set(more) {
      Object.assign(this, more);
      this.close();
      this.app.changed("rest");
    }

    /** What is asked, and the answer. */
    build() {
      const { app, place, motion } = this, ready = motion && motion.ready && motion.engine.joints.length > 2;
      place.closest("section").hidden = !ready;
      if (!ready) { this.close(); place.replaceChildren(); return; }
      const parts = [Bench.check("jam.on", this.on, on => this.turn(on))];
      if (this.on) {
        this.open();
        const within = (read, most) => (text, unit) => {
          const value = read(text, unit);
          if (!(value >= 0 && value <= most)) throw new Bench.Fault("fault.typed", { text: text.slice(0, 20) });
          return value;
        };
        const angle = within(Bench.typedAngle, MOST), length = within(Bench.typedLength, Infinity);
        const shown = value => String(Number((value / DEGREE).toPrecision(6)));
        parts.push(Bench.choice("jam.axis", String(this.joint), joints(app, this.data).map(([k, text]) => [String(k), text]), own => this.set({ joint: Number(own) })),
          Bench.field(app, "jam.alpha", shown(this.alpha), text => this.set({ alpha: angle(text) }), { unit: "°" }),
          Bench.field(app, "jam.direction", shown(this.direction), text => this.set({ direction: Bench.typedAngle(text) }), { unit: "°" }),
          Bench.field(app, "jam.limit", shown(this.tilt), text => this.set({ tilt: angle(text) }), { unit: "°" }),
          Bench.field(app, "jam.end", String(this.end), text => this.set({ end: length(text, app.sheet.unit) }), { unit: app.sheet.unit }),
          this.answer = make("div", { id: "jammed", "aria-live": "polite" }), this.summary(),
          ...this.proved(),
          make("div", { class: "acts" }, Bench.button(this.proof && !this.proof.found ? "jam.stop" : "jam.prove", () => this.prove(), { "data-prove": true }),
            Bench.button("jam.python", () => this.python(), { "data-program": true })));
      }
      Bench.refill(place, ...parts);
      this.show();
    }

    summary() {
      const over = this.whole();
      if (!over) return null;
      const { inputs } = over.swept, worst = over.factors[over.worst], bound = Array.from(over.factors).filter(own => own > 1).length;
      const text = bound === 0 ? Bench.word("jam.never", { factor: Bench.shown(worst, 3) })
        : Bench.word("jam.part", { share: Bench.shown((100 * bound) / inputs.length, 3), at: Bench.shownInput(this.motion, inputs[over.worst]), factor: this.factor(worst) });
      return make("div", { class: "acts" }, make("p", { class: bound ? "warn" : "soft", id: "jamWhole" }, text),
        make("button", { type: "button", on: { click: () => { this.motion.to(inputs[over.worst]); this.app.changed("rest"); } } }, Bench.word("jam.worst")));
    }
    factor(value) { return Number.isFinite(value) ? Bench.shown(value, 3) : "∞"; }

    /** The answer at the pose that is shown, and its marks on the drawing. */
    show() {
      const layer = this.app.view.layers.binding, { motion } = this;
      if (!this.on || !motion || !motion.ready) { if (layer.firstChild) layer.replaceChildren(); return; }
      const seats = this.open();
      if (seats.fault || !this.answer) { layer.replaceChildren(); return; }
      const now = this.now = seats.at(motion.engine.pose), words = new Map(joints(this.app, this.data));
      const text = now.binds ? Bench.word("jam.binds", { factor: this.factor(now.factor), joint: words.get(now.first) || "–" })
        : Bench.word(Number.isFinite(now.allowed) ? "jam.free" : "jam.loose", { factor: Bench.shown(now.allowed, 3), joint: words.get(now.first) || "–" });
      this.answer.replaceChildren(make("p", { class: now.binds ? "warn" : "" }, text));
      const at = k => { const { a, at_a: own } = this.data.joints[k]; return this.app.view.px(Bench.carried(motion.row(a), own)); };
      const rings = now.joints.filter(({ joint }) => joint !== this.joint).map(({ joint, used, price }) => {
        const [cx, cy] = at(joint), kind = joint === now.first ? (now.binds ? "used first binds" : "used first") : "used";
        const say = Bench.word("jam.used", { joint: words.get(joint), used: Bench.shown(100 * used * now.factor, 3), price: Bench.shown(100 * price, 3) });
        return svg("circle", { class: kind, "data-joint": joint, cx, cy, r: 13, "stroke-width": 2 + 5 * Math.min(1, price) }, svg("title", {}, say));
      });
      layer.replaceChildren(...rings, ...this.handle(at(this.joint)));
    }

    /** The axis that leans, seen from above: dragged, it leans more, or elsewhere. */
    handle([x, y]) {
      const turn = this.motion.row(this.base)[2];
      const long = this.alpha * HANDLE + 18, to = this.direction + turn, tip = [x + long * Math.cos(to), y - long * Math.sin(to)];
      const grip = svg("circle", { class: "lean", cx: tip[0], cy: tip[1], r: 9 }, svg("title", {}, Bench.word("jam.lean")));
      grip.addEventListener("pointerdown", event => {
        event.stopPropagation();
        event.preventDefault();
        const root = this.app.view.root, box = root.getBoundingClientRect();
        const move = own => {
          const dx = own.clientX - box.left - x, dy = y - (own.clientY - box.top);
          Object.assign(this, { alpha: Math.min(MOST, Math.max(0, (Math.hypot(dx, dy) - 18) / HANDLE)), direction: Math.atan2(dy, dx) - turn });
          this.close();
          this.show();
        };
        const up = () => { root.ownerDocument.removeEventListener("pointermove", move); root.ownerDocument.removeEventListener("pointerup", up); this.app.changed("rest"); };
        root.ownerDocument.addEventListener("pointermove", move);
        root.ownerDocument.addEventListener("pointerup", up);
      });
      return [svg("path", { class: "leans", d: Bench.pathOf([[x, y], tip]) }), grip];
    }

    /** The proof over the whole motion, in the worker; where its kernels do not know a joint, the library's program. */
    async prove() {
      const { app, motion, data } = this;
      if (this.proof && !this.proof.found) { this.proof = null; app.work.stop(); app.say("said.stopped"); app.changed("rest"); return; }
      const seats = this.open(), swept = motion.driven && !seats.fault ? motion.sweep() : null, own = { found: null, swept };
      if (!swept || this.data.drivers.length !== 1) { this.python(); return; }
      const { inputs } = swept, turns = swept.full && swept.turns < Infinity ? swept.turns : 0;
      const asked = { pose: Array.from(motion.engine.pose), driver: motion.driver, from: inputs[0], to: inputs[inputs.length - 1], turns, limits: this.limits, tilt: this.leaning };
      if (app.work.busy) app.work.stop();
      this.proof = own;
      app.changed("rest");
      app.say("said.proving", { share: 0 });
      const found = await Bench.job(app, ["proof.wasm", "binding.wasm"], "binds", [data, asked], share => app.say("said.proving", { share: Math.round(100 * share) }));
      if (this.proof !== own) return;
      this.proof = found && found.known ? { found, swept } : null;
      if (found && !found.known) this.python();
      if (this.proof) app.say(`said.jam.${found.verdict}`);
      app.changed("rest");
    }

    /** The library's program for the same question. */
    python() { Bench.showPython(this.open().python(), "python.prove", "prove.py"); }

    /** What is proved, in words; shares are rounded down. */
    proved() {
      const { found, swept } = this.proof || {};
      if (!found || !this.motion.driven || this.motion.sweep() !== swept) return [];
      const share = value => Bench.shown(Math.floor(1000 * value) / 10);
      const text = Bench.word(`jam.proved.${found.everywhere ? "everywhere" : found.verdict}`, { free: share(found.free), binds: share(found.binds), at: found.at === null ? "" : Bench.shownInput(this.motion, found.at) });
      return [make("p", { id: "jamProved", class: found.verdict === "free" ? "" : "warn" }, text), make("p", { class: "soft" }, Bench.word("jam.model", { n: found.pieces.length }))];
    }
  };
})();
