// What menus, buttons and keys do.
"use strict";

(function () {
  Object.assign(Bench.do, {
    undo: app => app.undo(),
    redo: app => app.redo(),
    delete: app => app.attempt(sheet => {
      if (!app.selection.length) throw new Bench.Fault("fault.select");
      return { sheet: Bench.without(sheet, app.selection), select: [], say: ["said.deleted"] };
    }),
    duplicate: app => app.attempt(sheet => {
      const box = Bench.box(sheet, Bench.pointsOf(sheet, app.selection)) || [0, 0, 0, 0];
      const by = Bench.gridStep(app.view.camera.scale, 40), down = Math.min(by, (box[3] - box[1]) / 2 + by);
      const [next, select] = Bench.copied(sheet, app.selection, (x, y) => [x + by, y - down]);
      return { sheet: next, select, say: ["said.copied", { n: select.length }] };
    }),
    mirror: app => app.attempt(sheet => {
      const box = Bench.box(sheet, Bench.pointsOf(sheet, app.selection));
      if (!box) throw new Bench.Fault("fault.select");
      const [next, select] = Bench.mirrored(sheet, app.selection, box[2] + Bench.gridStep(app.view.camera.scale, 40));
      return { sheet: next, select, say: ["said.copied", { n: select.length }] };
    }),
    all: app => app.select([...Object.keys(app.sheet.points), ...Object.keys(app.sheet.links).filter(id => id !== Bench.GROUND)]),
    fit: app => {
      app.view.fit(Bench.boxWithPaths(app), document.getElementById("player").offsetHeight);
      app.fitted = { sheet: app.sheet, camera: JSON.stringify(app.view.camera) };
      app.changed("view");
    },
    fresh: app => {
      const { unit } = app.sheet;
      Object.assign(app, { target: null, poses: [] });
      app.take({ ...Bench.empty(), unit }, { select: [], say: ["said.fresh"] });
      Object.assign(app.view.camera, { x: 0, y: 0, scale: 2 * Bench.UNIT_SIZE[unit] });
      app.changed("view");
    },
    mode: app => app.setMode(app.mode === "draw" ? "run" : "draw"),
    grid: app => { app.options.grid = !app.options.grid; app.changed("view"); },
    snap: app => { app.options.snap = !app.options.snap; app.say(app.options.snap ? "said.snap" : "said.nosnap"); app.changed("view"); },
    names: app => { app.options.names = !app.options.names; app.changed("view"); },
    help: () => { const dialog = document.getElementById("help"); dialog.showModal(); dialog.scrollTop = 0; },
    escape: app => {
      if (app.picks.length || app.measured) { app.picks = []; app.measured = null; app.changed("view"); } else if (app.tool !== "select") app.pick("select");
      else app.select([]);
    },
  });

  /** Keys: with Ctrl (or the command key) written "^". */
  Bench.KEYS = {
    "^z": "undo", "^y": "redo", "^Z": "redo", Delete: "delete", Backspace: "delete", "^d": "duplicate", "^m": "mirror",
    "^a": "all", f: "fit", h: "mode", "#": "grid", "№": "grid", n: "snap", x: "names", "?": "help", Escape: "escape",
    "^s": "save", "^o": "open", " ": "play", u: "share",
  };

  const typing = target => target.closest && target.closest("input:not([type=range]):not([type=checkbox]), select, textarea, dialog");

  /** The key whatever Caps Lock says, and as it is in Latin letters where others are typed. */
  const keyOf = ({ key, code, shiftKey }) => {
    const own = key.length === 1 && key > "~" && code.startsWith("Key") ? code[3] : key;
    if (own.length > 1) return own;
    return shiftKey ? own.toUpperCase() : own.toLowerCase();
  };

  Bench.listen = app => document.addEventListener("keydown", event => {
    if (event.defaultPrevented || event.altKey || typing(event.target)) return;
    const control = event.ctrlKey || event.metaKey, key = keyOf(event);
    const name = Bench.KEYS[(control ? "^" : "") + key];
    const tool = !control && Object.keys(Bench.TOOLS).find(own => Bench.TOOLS[own].key === key.toLowerCase());
    if (event.key === " " && event.target.closest("button, summary, a, [type=checkbox]")) return;
    if (name && Bench.do[name]) Bench.do[name](app);
    else if (tool) app.pick(tool);
    else return;
    event.preventDefault();
  });
})();
