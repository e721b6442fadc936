// What is drawn over the moving mechanism: paths of points, limits and dead centres, arrows, instant centres.
"use strict";

(function () {
  const svg = Bench.svg;
  /** Where a row of `pointMotion` has what arrows show. */
  const FIRST = { velocity: 2, acceleration: 4 };

  /** Points on links: [id, number of the link, place]. */
  const placed = points => sheet => Object.entries(sheet.points).filter(points).map(([id, point]) => {
    const links = Bench.linksAt(sheet, id), link = links.find(own => own !== Bench.GROUND) || Bench.GROUND;
    return [id, Bench.linkNumber(sheet, link), [point.x, point.y]];
  });
  /** Points whose paths are shown. */
  Bench.tracedPoints = placed(([, point]) => point.trace);
  const allPoints = placed(() => true);

  /** Places of a point over the sweep. */
  Bench.pathOver = (motion, k, at) => motion.engine.pointMotion(k, at, motion.sweep()).map(([x, y]) => [x, y]);

  /** The box around the drawing as it stands and as it moves. */
  Bench.boxWithPaths = app => {
    const box = Bench.box(app.posed()), { motion, sheet } = app, swept = box && motion && motion.driven ? motion.sweep() : null;
    if (!swept) return box;
    const places = allPoints(sheet).flatMap(([, k, at]) => Bench.pathOver(motion, k, at));
    for (const [x, y] of places.filter(place => place.every(Number.isFinite))) {
      [box[0], box[1], box[2], box[3]] = [Math.min(box[0], x), Math.min(box[1], y), Math.max(box[2], x), Math.max(box[3], y)];
    }
    return box;
  };

  /** Paths and marked places: after a change of the drawing, the branch or the view. */
  Bench.paintCurves = (app, motion) => {
    const { view, sheet } = app, layer = view.layers.curves, parts = [];
    const swept = motion && app.options.curves && motion.driven ? motion.sweep() : null;
    if (swept) {
      Bench.tracedPoints(sheet).forEach(([id, k, at], n) => {
        const path = Bench.pathOver(motion, k, at).map(place => view.px(place));
        parts.push(svg("path", { class: `curve c${n % 4}`, "data-curve": id, d: Bench.pathOf(path.filter(p => p.every(Number.isFinite)), swept.full && swept.turns < Infinity) }));
        for (const event of swept.events) {
          const [cx, cy] = path[motion.nearest(event.input)];
          if (Number.isFinite(cx)) parts.push(svg("circle", { class: `mark ${event.kind.replace(" ", "-")}`, cx, cy, r: 5 }, svg("title", {}, motion.told(event))));
        }
      });
    }
    layer.replaceChildren(...parts);
  };

  function arrow(from, by, kind) {
    const length = Math.hypot(...by);
    if (!(length > 3)) return [];
    const [ux, uy] = [by[0] / length, by[1] / length], to = [from[0] + by[0], from[1] + by[1]], head = Math.min(9, length / 2);
    const side = t => [to[0] - head * ux + t * head * 0.45 * uy, to[1] - head * uy - t * head * 0.45 * ux];
    return [svg("path", { class: `arrow ${kind}`, d: Bench.pathOf([from, [to[0] - head * 0.6 * ux, to[1] - head * 0.6 * uy]]) }),
      svg("path", { class: `head ${kind}`, d: Bench.pathOf([to, side(1), side(-1)], true) })];
  }

  /** Arrows of all joints and traced points: the longest over the sweep is a fifth of the view. */
  function arrows(app, motion, parts) {
    const { view, sheet } = app, { engine } = motion;
    for (const kind of ["velocity", "acceleration"]) {
      if (!app.options[kind]) continue;
      const found = Object.entries(sheet.points).map(([id, point]) => {
        const link = Bench.linksAt(sheet, id).find(own => own !== Bench.GROUND);
        return link ? engine.pointMotion(Bench.linkNumber(sheet, link), [point.x, point.y])[0] : null;
      }).filter(Boolean);
      const longest = motion.longest(kind), room = Math.min(view.width, view.height) / 5;
      for (const own of found) {
        const by = [own[FIRST[kind]], -own[FIRST[kind] + 1]].map(value => (value / (longest || 1)) * room);
        parts.push(...arrow(view.px([own[0], own[1]]), by, kind));
      }
    }
  }

  /** Instant centres of the links against the frame, and among each other. */
  function centres(app, motion, parts) {
    const ids = Object.keys(app.sheet.links), n = ids.length, found = motion.engine.instantCentres();
    const seen = [];
    for (let a = 0; a < n; a++) {
      for (let b = a + 1; b < n; b++) {
        const [x, y] = app.view.px([found[2 * (a * n + b)], found[2 * (a * n + b) + 1]]);
        if (!Number.isFinite(x) || Math.abs(x) > 1e5 || Math.abs(y) > 1e5) continue;
        const lift = seen.filter(([u, v]) => Math.hypot(u - x, v - y) < 12).length;
        seen.push([x, y]);
        parts.push(svg("path", { class: "centre", d: `M${x - 5} ${y - 5}L${x + 5} ${y + 5}M${x - 5} ${y + 5}L${x + 5} ${y - 5}` }),
          svg("text", { class: "letter", x: x + 8, y: y + 14 + 13 * lift }, `${a}${n > 10 ? "," : ""}${b}`));
      }
    }
  }

  /** What changes with the pose. */
  Bench.paintPose = (app, motion) => {
    const parts = [];
    if (motion && motion.ready && app.mode === "run") {
      if (motion.driven) {
        arrows(app, motion, parts);
        if (app.options.centres) centres(app, motion, parts);
      }
      if (motion.pulled) {
        parts.push(svg("path", { class: "pull", d: Bench.pathOf([motion.pulled.from, motion.pulled.to].map(at => app.view.px(at))) }));
      }
    }
    if (parts.length || app.view.layers.motion.firstChild) app.view.layers.motion.replaceChildren(...parts);
  };

  /** The longest arrow over a sweep, so that arrows grow and shrink with the motion. */
  Bench.Motion.prototype.longest = function (kind) {
    const swept = this.sweep();
    if (!swept) return 1;
    if (!swept.longest) {
      const { sheet } = this.app;
      swept.longest = { velocity: 0, acceleration: 0 };
      for (const [id, point] of Object.entries(sheet.points)) {
        const link = Bench.linksAt(sheet, id).find(own => own !== Bench.GROUND);
        if (!link) continue;
        for (const own of this.engine.pointMotion(Bench.linkNumber(sheet, link), [point.x, point.y], swept)) {
          for (const [name, k] of Object.entries(FIRST)) {
            const length = Math.hypot(own[k], own[k + 1]);
            if (Number.isFinite(length)) swept.longest[name] = Math.max(swept.longest[name], length);
          }
        }
      }
    }
    return swept.longest[kind];
  };
})();
