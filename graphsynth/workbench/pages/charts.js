// A chart of one quantity over the input, linked to the pose: a line moves with it, a click moves the mechanism.
"use strict";

(function () {
  const { make, svg } = Bench;
  const WIDE = 250, HIGH = 132, LEFT = 40, BOTTOM = 20, TOP = 8;

  /** What can be charted: [key, name, values over the sweep]. */
  function quantities(app, motion, swept) {
    const { sheet } = app, links = Object.keys(sheet.links), n = links.length, found = [];
    const rows = Array.from(swept.inputs, (_, i) => i), steps = swept.margins.length / swept.inputs.length;
    const angles = rows.map(i => motion.engine.transmission(swept.margins.subarray(i * steps, (i + 1) * steps)));
    angles[0].forEach(({ group }, k) => {
      const values = angles.map(own => (own[k].angle * 180) / Math.PI);
      found.push([`transmission ${k}`, Bench.word("chart.transmission", { k: group + 1 }), values, "°"]);
    });
    const chosen = app.selection.filter(id => sheet.points[id]);
    const ids = [...new Set([...chosen, ...Bench.tracedPoints(sheet).map(([id]) => id)])].slice(0, 4);
    for (const id of ids) {
      const link = Bench.linksAt(sheet, id).find(own => own !== Bench.GROUND);
      if (!link) continue;
      const point = sheet.points[id], k = Bench.linkNumber(sheet, link);
      const moves = motion.engine.pointMotion(k, [point.x, point.y], swept), p = point.name;
      found.push([`x ${id}`, Bench.word("chart.x", { p }), moves.map(own => own[0]), sheet.unit]);
      found.push([`y ${id}`, Bench.word("chart.y", { p }), moves.map(own => own[1]), sheet.unit]);
      found.push([`v ${id}`, Bench.word("chart.v", { p }), moves.map(own => Math.hypot(own[2], own[3])), ""]);
      found.push([`a ${id}`, Bench.word("chart.a", { p }), moves.map(own => Math.hypot(own[4], own[5])), ""]);
    }
    const judged = app.jamming && app.jamming.whole();
    if (judged) found.push(["binding", Bench.word("chart.binding"), Array.from(judged.factors), ""]);
    links.forEach((id, k) => {
      if (id === Bench.GROUND) return;
      const values = rows.map(i => (swept.poses[3 * (i * n + k) + 2] * 180) / Math.PI);
      found.push([`angle ${id}`, Bench.word("chart.angle", { a: Bench.linkName(sheet, id) }), values, "°"]);
    });
    return found;
  }

  /** Round numbers for an axis. */
  function ticks(low, high, most) {
    const raw = (high - low) / most || 1, power = 10 ** Math.floor(Math.log10(raw));
    const step = [1, 2, 5, 10].map(k => k * power).find(own => own >= raw * 0.999);
    const found = [];
    for (let k = Math.ceil(low / step); k * step <= high + 1e-9 * step; k++) found.push(k * step);
    return found;
  }

  function chart(app, motion, swept, [, name, values, unit]) {
    const finite = values.filter(Number.isFinite), turn = motion.turns ? 180 / Math.PI : 1;
    let low = Math.min(...finite), high = Math.max(...finite);
    if (!(high - low > 1e-9 * Math.max(1e-9, Math.abs(high)))) { low -= 1; high += 1; }
    const first = swept.inputs[0], last = swept.inputs[swept.inputs.length - 1];
    const x = input => LEFT + ((input - first) / (last - first)) * (WIDE - LEFT - 6), y = value => HIGH - BOTTOM - ((value - low) / (high - low)) * (HIGH - BOTTOM - TOP);
    const root = svg("svg", { class: "chart", viewBox: `0 0 ${WIDE} ${HIGH}`, role: "img", "aria-label": Bench.word("chart.label", { name, low: Bench.shown(low, 4), high: Bench.shown(high, 4), unit: Bench.unitName(unit) }) });
    for (const at of ticks(low, high, 4)) {
      root.append(svg("path", { class: "rule", d: `M${LEFT} ${y(at)}H${WIDE - 6}` }), svg("text", { class: "tick left", x: LEFT - 4, y: y(at) + 4 }, Bench.shown(at, 4)));
    }
    for (const at of ticks(first * turn, last * turn, 5)) root.append(svg("text", { class: "tick middle", x: x(at / turn), y: HIGH - 4 }, Bench.shown(at, 4)));
    for (const event of swept.events) root.append(svg("path", { class: `moment ${event.kind.replace(" ", "-")}`, d: `M${x(event.input)} ${TOP}V${HIGH - BOTTOM}` }, svg("title", {}, motion.told(event))));
    const line = values.map((value, i) => [x(swept.inputs[i]), y(value)]).filter(own => own.every(Number.isFinite));
    root.append(svg("path", { class: "line", d: Bench.pathOf(line) }));
    const now = svg("path", { class: "now" });
    root.append(now);
    root.addEventListener("pointerdown", event => {
      const box = root.getBoundingClientRect(), at = ((event.clientX - box.left) / box.width) * WIDE;
      motion.pause();
      motion.to(Math.min(last, Math.max(first, first + ((at - LEFT) / (WIDE - LEFT - 6)) * (last - first))));
      app.changed("rest");
    });
    return [root, () => {
      const span = last - first, own = swept.full ? first + ((((motion.input - first) % span) + span) % span) : motion.input;
      now.setAttribute("d", `M${x(own).toFixed(1)} ${TOP}V${HIGH - BOTTOM}`);
    }];
  }

  /** The section of charts: one quantity, chosen from a list. */
  Bench.charts = (app, place) => {
    let move = null, shown = null;
    const build = () => {
      const { motion } = app, swept = motion && motion.driven ? motion.sweep() : null;
      const span = swept ? swept.inputs[swept.inputs.length - 1] - swept.inputs[0] : 0;
      place.closest("section").hidden = !(span > 0);
      move = null;
      if (!(span > 0)) { place.replaceChildren(); return; }
      const all = quantities(app, motion, swept), own = all.find(([key]) => key === shown) || all[0];
      if (!own) { place.replaceChildren(); return; }
      const select = make("select", { "aria-label": Bench.word("chart.choose"), on: { change: () => { shown = select.value; build(); } } },
        ...all.map(([key, name]) => make("option", { value: key, selected: key === own[0] }, name)));
      const [root, moves] = chart(app, motion, swept, own);
      move = moves;
      move();
      Bench.refill(place, select, root);
    };
    app.on("sheet view rest", build);
    app.on("pose", () => { if (move && !app.motion.waits) move(); });
  };
})();
