// The state of the page and the one way to change it.  Parts of the page listen: each is called after a change.
"use strict";

(function () {
  const listeners = [];

  class App {
    constructor() {
      this.history = new Bench.History(Bench.empty());
      this.draft = null;        // the drawing while something is being moved
      this.selection = [];
      this.tool = "select";
      this.picks = [];
      this.mode = "draw";       // "draw" changes the drawing, "run" moves the mechanism
      this.pose = null;
      this.options = { grid: true, snap: true, names: true, curves: true, velocity: false, acceleration: false, centres: false };
      this.motion = null;       // what moves it, once the kernels are loaded
      this.faulty = [];         // links that are too much
      this.measured = null;
      this.background = null;
    }
    get sheet() { return this.draft || this.history.sheet; }

    /** Call a function after every change of these kinds: "sheet", "pose", "view", "tool". */
    on(kinds, listener) { listeners.push([new Set(kinds.split(" ")), listener]); }
    changed(kind) { for (const [kinds, listener] of listeners) if (kinds.has(kind)) listener(kind); }

    /** Take a new drawing; it can be undone. */
    take(sheet, { select, say } = {}) {
      this.draft = this.pose = this.measured = null;
      if (this.motion) this.motion.pause();
      this.history.push(sheet);
      this.selection = (select || this.selection).filter(id => this.has(id));
      this.changed("sheet");
      this.say(...(say || ["said.changed"]));
    }
    has(id) { return Boolean(this.sheet.points[id] || this.sheet.links[id] || this.sheet.pairs[id]); }

    /** Try a change of the drawing; what cannot be done is said and leaves it as it was. */
    attempt(change) {
      try {
        const found = change(this.posed());
        if (found) this.take(found.sheet, found);
        return true;
      } catch (fault) {
        if (!(fault instanceof Bench.Fault)) throw fault;
        this.fault(fault);
        return false;
      }
    }

    /** Draw on what is seen: the pose that is shown becomes the drawn position. */
    rebase() {
      if (!this.pose) return;
      const sheet = this.posed();
      this.pose = null;
      this.history.push(sheet);
      this.changed("sheet");
    }

    /** What is shown as a drawing: the pose that is seen is the drawn position. */
    posed() {
      if (!this.pose) return this.sheet;
      const rows = Object.keys(this.sheet.links).map((id, k) => Array.from(this.pose.subarray(3 * k, 3 * k + 3)));
      return Bench.rebased(this.sheet, rows);
    }

    undo() { this.step("undo", this.history.canUndo); }
    redo() { this.step("redo", this.history.canRedo); }
    step(name, can) {
      if (!can) return this.say("said.end");
      this.history[name]();
      this.draft = this.pose = this.measured = null;
      this.picks = [];
      this.selection = this.selection.filter(id => this.has(id));
      this.changed("sheet");
      return this.say(`said.${name}`);
    }

    /** A sentence for everyone: shown in the status line, read aloud by screen readers. */
    say(key, values) { this.line(Bench.word(key, values), ""); }
    fault(fault) { this.line(fault.sentence, "fault"); }
    line(text, kind) {
      const line = document.getElementById("said");
      line.className = kind;
      line.textContent = text;
    }

    pick(tool) {
      this.tool = tool;
      this.picks = [];
      if (this.mode === "run" && tool !== "select") this.setMode("draw");
      this.changed("tool");
      if (tool === "picture" && !this.background) Bench.do.picture(this);
      this.say(`hint.${tool}`);
    }
    setMode(mode) {
      if (mode === this.mode) return;
      if (mode === "draw") {
        if (this.motion) this.motion.pause();
        this.rebase();
      }
      this.mode = mode;
      this.picks = [];
      this.measured = null;
      this.changed("tool");
    }
    select(ids) {
      this.selection = ids.filter(id => this.has(id));
      this.changed("view");
    }
  }

  Bench.App = App;
})();
