// Mouse, pen, touch and keys on the drawing: they pick places for the tool in hand, move what is chosen, drag the
// mechanism, shift and zoom the view.
"use strict";

(function () {
  Bench.Stage = class {
    constructor(app, view) {
      Object.assign(this, { app, view, root: view.root, fingers: new Map(), action: null, cursor: null, hover: null });
      const on = (name, own) => this.root.addEventListener(name, event => own.call(this, event));
      on("pointerdown", this.down);
      on("pointermove", this.move);
      on("pointerup", this.up);
      on("pointercancel", this.cancel);
      on("pointerleave", () => { this.hover = null; this.over(); });
      on("dblclick", () => this.finish());
      on("contextmenu", event => event.preventDefault());
      on("keydown", this.key);
      on("focus", () => this.over());
      on("blur", () => { this.cursor = null; this.over(); });
      this.root.addEventListener("wheel", event => this.wheel(event), { passive: false });
    }

    at(event) {
      const box = this.root.getBoundingClientRect();
      return [event.clientX - box.left, event.clientY - box.top];
    }
    hit(place, touch = false, skip = []) {
      const { view, app } = this;
      const where = id => view.where(app.sheet, id), shape = id => view.shape(app.sheet, id);
      return Bench.hit(app.sheet, place, where, shape, touch ? 24 : 13, skip);
    }

    /** What is picked at a place in pixels, snapped. */
    pickAt(pixels, event = {}) {
      const { app, view } = this, hit = this.hit(pixels, event.pointerType === "touch");
      const point = hit.point && app.sheet.points[hit.point], grid = app.options.snap && Bench.gridStep(view.camera.scale);
      const from = this.lastPick();
      const place = Bench.snapped(view.place(pixels), { point, from, straight: event.shiftKey, grid, off: event.altKey || app.tool === "picture" });
      return { ...hit, ...place };
    }
    lastPick() { return this.app.picks[this.app.picks.length - 1] || null; }

    down(event) {
      if (event.button > 2) return;
      this.root.focus({ preventScroll: true });
      this.root.setPointerCapture(event.pointerId);
      const place = this.at(event);
      this.fingers.set(event.pointerId, place);
      this.cursor = null;
      if (this.fingers.size === 2) {
        this.drop();
        this.action = this.pinch();
        return;
      }
      if (event.button !== 0) { this.action = this.pan(place); return; }
      const { app } = this, tool = Bench.TOOLS[app.tool];
      if (app.mode === "run") this.action = this.drag(place, event);
      else if (app.tool === "target") this.action = this.trail(place);
      else if (app.tool === "poses") this.action = this.stand(place, event);
      else if (tool.picks === 0) this.action = this.choose(place, event);
      else this.action = this.press(place, event);
      event.preventDefault();
    }
    move(event) {
      const place = this.at(event);
      if (this.fingers.has(event.pointerId)) this.fingers.set(event.pointerId, place);
      if (this.action) this.action.move(place, event);
      else {
        this.hover = this.app.mode === "draw" && this.app.tool !== "select" ? this.pickAt(place, event) : null;
        this.root.style.cursor = this.pointer(place);
        this.over();
      }
    }
    pointer(place) {
      const { app } = this;
      if (app.mode === "draw" && app.tool !== "select") return "crosshair";
      const hit = this.hit(place);
      if (app.mode === "run") return hit.point || hit.link ? "grab" : "default";
      return hit.point || hit.link || hit.pair ? "move" : "default";
    }
    up(event) {
      this.fingers.delete(event.pointerId);
      const { action } = this;
      this.action = null;
      if (action && action.up) action.up(this.at(event), event);
    }
    cancel(event) {
      this.fingers.delete(event.pointerId);
      this.drop();
    }
    drop() {
      const { action } = this;
      this.action = null;
      if (action && action.cancel) action.cancel();
    }

    /** A curve that is wanted, drawn in one stroke. */
    trail(start) {
      const { app, view } = this, way = [start];
      const shown = () => this.over(Bench.svg("path", { class: "target", d: Bench.pathOf(way) }));
      return {
        move: place => {
          const last = way[way.length - 1];
          if (Math.hypot(place[0] - last[0], place[1] - last[1]) > 3 && way.length < 2000) way.push(place);
          shown();
        },
        up: () => { this.over(); Bench.answerTarget(app, way.map(place => { const { x, y } = view.place(place); return [x, y]; })); },
        cancel: () => this.over(),
      };
    }

    /** A pose that is wanted: pressed at its place, released in its direction. */
    stand(start, event) {
      const { app, view } = this, from = this.pickAt(start, event);
      let to = from;
      return {
        move: (place, more) => { to = Bench.snapped(view.place(place), { from, straight: more.shiftKey, off: !more.shiftKey }); this.over(Bench.svg("path", { class: "ghost", d: Bench.pathOf([from, to].map(own => view.px([own.x, own.y]))) })); },
        up: () => { this.over(); Bench.addPose(app, from, to); },
        cancel: () => this.over(),
      };
    }

    /** A place for the tool: press and release at two places, or click twice. */
    press(start, event) {
      const first = this.pickAt(start, event), began = this.app.picks.length === 0;
      this.add(first);
      return {
        move: (place, more) => { this.hover = this.pickAt(place, more); this.over(); },
        up: (place, more) => {
          const far = Math.hypot(place[0] - start[0], place[1] - start[1]) > 10;
          if (began && far && this.app.picks.length) this.add(this.pickAt(place, more));
          this.over();
        },
        cancel: () => { this.app.picks = []; this.over(); },
      };
    }
    add(pick) {
      const { app } = this, tool = Bench.TOOLS[app.tool], last = this.lastPick();
      const again = last && (pick.point ? last.point === pick.point : last.x === pick.x && last.y === pick.y);
      if (again) { if (app.picks.length > 1) this.finish(); return; }
      if (app.picks.length > 1 && app.picks[0].x === pick.x && app.picks[0].y === pick.y) { this.finish(); return; }
      app.picks = [...app.picks, pick];
      if (app.picks.length >= tool.picks) this.finish();
      this.over();
    }
    /** Let the tool do its work with what was picked. */
    finish() {
      const { app } = this, { picks } = app, tool = Bench.TOOLS[app.tool];
      if (app.mode !== "draw" || !picks.length || picks.length < Math.min(tool.picks, 2)) return;
      app.picks = [];
      if (app.tool === "picture") Bench.askScale(app, picks);
      else if (app.tool === "measure") { app.measured = picks; app.changed("view"); this.sayMeasure(picks); }
      else app.attempt(sheet => tool.apply(sheet, picks));
      this.over();
    }
    sayMeasure([p, q]) {
      const length = Bench.shown(Math.hypot(q.x - p.x, q.y - p.y)), turn = (Math.atan2(q.y - p.y, q.x - p.x) * 180) / Math.PI;
      this.app.say("said.measured", { length, unit: Bench.unitName(this.app.sheet.unit), angle: Bench.shown(turn, 4) });
    }

    /** Choose and move: a point, a link, all that is chosen; a rectangle from an empty place. */
    choose(start, event) {
      const { app, view } = this, hit = this.hit(start, event.pointerType === "touch");
      const id = hit.point || hit.pair || hit.link;
      if (!id) return event.pointerType === "touch" ? this.pan(start, true) : this.rectangle(start, event.shiftKey);
      if (event.shiftKey) {
        app.select(app.selection.includes(id) ? app.selection.filter(own => own !== id) : [...app.selection, id]);
        return null;
      }
      const single = !app.selection.includes(id);
      if (single) app.select([id]);
      const before = app.history.sheet, ids = Bench.pointsOf(before, app.selection), anchor = view.place(start);
      let moved = false, onto = null;
      return {
        move: (place, more) => {
          if (!moved && Math.hypot(place[0] - start[0], place[1] - start[1]) < 4) return;
          moved = true;
          const target = view.place(place), grid = app.options.snap && Bench.gridStep(view.camera.scale);
          let shift = [target.x - anchor.x, target.y - anchor.y];
          onto = null;
          if (hit.point && ids.length === 1) {
            onto = this.hit(place, false, [hit.point]).point;
            const point = onto && before.points[onto];
            const to = Bench.snapped(target, { point, grid, off: more.altKey });
            shift = [to.x - before.points[hit.point].x, to.y - before.points[hit.point].y];
          } else if (grid && !more.altKey) shift = shift.map(value => Math.round(value / grid) * grid);
          const places = ids.map(own => [own, [before.points[own].x + shift[0], before.points[own].y + shift[1]]]);
          try { app.draft = Bench.placed(before, Object.fromEntries(places)); } catch (fault) { app.fault(fault); return; }
          app.changed("draft");
        },
        up: () => {
          const next = app.draft;
          app.draft = null;
          if (!moved) { if (!single) app.select([id]); return; }
          if (onto) {
            const done = app.attempt(sheet => ({ sheet: Bench.merged(sheet, hit.point, onto), select: [onto], say: ["said.joined"] }));
            if (!done) app.changed("sheet");
          } else if (next) app.take(next, { say: ["said.moved"] });
        },
        cancel: () => { app.draft = null; app.changed("sheet"); },
      };
    }
    rectangle(start, more) {
      const { app, view } = this, before = more ? app.selection : [];
      let end = start;
      const box = () => [Math.min(start[0], end[0]), Math.min(start[1], end[1]), Math.max(start[0], end[0]), Math.max(start[1], end[1])];
      return {
        move: place => { end = place; this.over(Bench.svg("path", { class: "rubber", d: `M${start}H${end[0]}V${end[1]}H${start[0]}Z` })); },
        up: () => {
          const [left, top, right, bottom] = box();
          const inside = id => { const [x, y] = view.where(app.sheet, id); return x >= left && x <= right && y >= top && y <= bottom; };
          const points = Object.keys(app.sheet.points).filter(inside);
          const links = Object.keys(app.sheet.links).filter(id => id !== Bench.GROUND && app.sheet.links[id].points.length &&
            app.sheet.links[id].points.every(point => points.includes(point)));
          app.select([...new Set([...before, ...points, ...links])]);
          this.over();
        },
        cancel: () => this.over(),
      };
    }

    /** Shift the view. */
    pan(start, tap = false) {
      const { app, view } = this, { x, y } = view.camera;
      let far = false;
      return {
        move: place => {
          far = far || Math.hypot(place[0] - start[0], place[1] - start[1]) > 6;
          view.camera.x = x - (place[0] - start[0]) / view.camera.scale;
          view.camera.y = y + (place[1] - start[1]) / view.camera.scale;
          app.changed("view");
        },
        up: () => { if (tap && !far) app.select([]); },
      };
    }
    /** Two fingers: shift and zoom together. */
    pinch() {
      const { app, view } = this;
      const ends = () => { const [p, q] = [...this.fingers.values()]; return { m: [(p[0] + q[0]) / 2, (p[1] + q[1]) / 2], d: Math.hypot(p[0] - q[0], p[1] - q[1]) || 1 }; };
      let before = ends();
      return {
        move: () => {
          if (this.fingers.size < 2) return;
          const now = ends();
          view.camera.x -= (now.m[0] - before.m[0]) / view.camera.scale;
          view.camera.y += (now.m[1] - before.m[1]) / view.camera.scale;
          view.zoom(now.d / before.d, now.m);
          before = now;
          app.changed("view");
        },
      };
    }
    wheel(event) {
      event.preventDefault();
      const { view, app } = this, step = event.deltaMode === 1 ? 30 : 1;
      view.zoom(Math.exp(-event.deltaY * step * (event.ctrlKey ? 0.01 : 0.0016)), this.at(event));
      app.changed("view");
    }

    /** Drag the mechanism by any point of any link; the engine follows. */
    drag(start, event) {
      const { app, view } = this, hit = this.hit(start, event.pointerType === "touch");
      if (!hit.point && !hit.link) return this.pan(start);
      if (!app.motion || !app.motion.ready) { app.say(app.motion ? app.motion.why : "said.noengine"); return this.pan(start); }
      const grip = app.motion.grip(hit, view.place(start));
      return { move: place => grip.to(view.place(place)), up: () => grip.end(), cancel: () => grip.end() };
    }

    /** Arrows move the cross, Enter picks there; with something chosen in the tool "select", arrows move that. */
    key(event) {
      const { app, view } = this;
      const way = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
      if (event.ctrlKey || event.metaKey || event.altKey) return;
      if (app.mode === "run") {
        if (!way) return;
        Bench.stepInput(app, way[0] + way[1]);
        event.preventDefault();
        return;
      }
      const step = Bench.gridStep(view.camera.scale) * (event.shiftKey ? 5 : 1);
      if (way && app.tool === "select" && app.selection.length) {
        const ids = Bench.pointsOf(app.sheet, app.selection);
        const places = ids.map(id => [id, [app.sheet.points[id].x + way[0] * step, app.sheet.points[id].y + way[1] * step]]);
        app.attempt(sheet => ({ sheet: Bench.placed(sheet, Object.fromEntries(places)), say: ["said.moved"] }));
      } else if (way) {
        if (!this.cursor) this.cursor = Bench.snapped({ x: view.camera.x, y: view.camera.y }, { grid: Bench.gridStep(view.camera.scale) });
        this.cursor = { x: Number((this.cursor.x + way[0] * step).toPrecision(12)), y: Number((this.cursor.y + way[1] * step).toPrecision(12)) };
        this.hover = this.pickAt(view.px([this.cursor.x, this.cursor.y]));
        const at = { x: Bench.shown(this.cursor.x), y: Bench.shown(this.cursor.y) };
        const point = this.hover.point && app.sheet.points[this.hover.point].name;
        app.say(point ? "said.cross.point" : "said.cross", { ...at, p: point });
        this.over();
      } else if (event.key === "Enter") {
        if (app.picks.length > 1 && !this.cursor) this.finish();
        else if (this.cursor) {
          const pick = this.pickAt(view.px([this.cursor.x, this.cursor.y]));
          if (app.tool === "select") app.select([pick.point || pick.pair || pick.link].filter(Boolean));
          else this.add(pick);
        }
      } else return;
      event.preventDefault();
    }

    /** What lies over the drawing: picked places, the line to the next, the cross, a measure. */
    over(...more) {
      const { app, view } = this, svg = Bench.svg, parts = [...more], layer = view.layers.over;
      const px = pick => view.px([pick.x, pick.y]);
      const line = [...app.picks, ...(this.hover && app.picks.length ? [this.hover] : [])].map(px);
      if (line.length > 1) parts.push(svg("path", { class: "ghost", d: Bench.pathOf(line) }));
      for (const [x, y] of app.picks.map(px)) parts.push(svg("circle", { class: "picked", cx: x, cy: y, r: 6 }));
      if (this.hover) {
        const [x, y] = px(this.hover), kind = this.hover.point || this.hover.kind === "point" ? "snap point" : "snap";
        parts.push(svg("circle", { class: kind, cx: x, cy: y, r: this.hover.point ? 11 : 4 }));
        if (app.picks.length) parts.push(this.dimension(app.picks[app.picks.length - 1], this.hover));
      }
      if (this.cursor) {
        const [x, y] = view.px([this.cursor.x, this.cursor.y]);
        parts.push(svg("path", { class: "cross", d: `M${x - 14} ${y}H${x + 14}M${x} ${y - 14}V${y + 14}` }));
      }
      if (app.measured) {
        parts.push(svg("path", { class: "measure", d: Bench.pathOf(app.measured.map(px)) }), this.dimension(...app.measured));
      }
      layer.replaceChildren(...parts);
    }
    dimension(p, q) {
      const [x, y] = this.view.px([(p.x + q.x) / 2, (p.y + q.y) / 2]), turn = (Math.atan2(q.y - p.y, q.x - p.x) * 180) / Math.PI;
      const values = { length: Bench.shown(Math.hypot(q.x - p.x, q.y - p.y), 5), unit: Bench.unitName(this.app.sheet.unit), angle: Bench.shown(turn, 4) };
      return Bench.svg("text", { class: "dimension", x, y: y - 10 }, Bench.word("show.dimension", values));
    }
  };
})();
