// The panel of what is chosen: names, numbers with units, and what can be done with it.
"use strict";

(function () {
  const { make, field, check, choice, button } = Bench;

  /** A length and an angle as they are typed; what is none is refused. */
  const number = Bench.typedLength = (text, unit) => {
    const value = Bench.parseLength(text, unit);
    if (!Number.isFinite(value)) throw new Bench.Fault("fault.typed", { text: text.slice(0, 20) });
    return value;
  };
  const angle = Bench.typedAngle = text => {
    const value = Number(text.replace(",", ".").replace("−", "-").replace(/[°\s]/g, ""));
    if (!Number.isFinite(value) || !text.trim()) throw new Bench.Fault("fault.typed", { text: text.slice(0, 20) });
    return (value * Math.PI) / 180;
  };
  const degrees = value => String(Number(((value * 180) / Math.PI).toPrecision(10)));
  const tidy = value => String(Number(value.toPrecision(12)));
  const take = (app, change) => app.attempt(sheet => ({ sheet: change(sheet) }));

  function named(text, names) {
    const name = text.trim();
    if (!name || name.length > Bench.LIMITS.name || names.includes(name)) throw new Bench.Fault("fault.name", { name: name.slice(0, 20) });
    return name;
  }

  function pointPanel(app, id) {
    const sheet = app.posed(), point = sheet.points[id], links = Bench.linksAt(sheet, id), { unit } = sheet;
    const others = Object.keys(sheet.points).filter(own => own !== id).map(own => sheet.points[own].name);
    const put = change => take(app, s => Bench.placed(s, { [id]: change(s.points[id]) }));
    const set = more => take(app, s => ({ ...s, points: { ...s.points, [id]: { ...s.points[id], ...more } } }));
    return [
      make("h3", {}, Bench.word("panel.point", { p: point.name })),
      field(app, "panel.name", point.name, text => set({ name: named(text, others) })),
      field(app, "panel.x", tidy(point.x), text => { const x = number(text, unit); put(p => [x, p.y]); }, { unit }),
      field(app, "panel.y", tidy(point.y), text => { const y = number(text, unit); put(p => [p.x, y]); }, { unit }),
      check("panel.fixed", links.includes(Bench.GROUND), () => app.attempt(s => Bench.TOOLS.ground.apply(s, [{ point: id }]))),
      check("panel.traced", point.trace, on => set({ trace: on })),
      make("p", { class: "soft" }, Bench.word("panel.through", { links: links.map(own => Bench.linkName(sheet, own)).join(", ") || "–" })),
      ...driverParts(app, id),
      links.length > 1 && button("do.separate", () => take(app, s => Bench.unpinned(s, id))),
    ];
  }

  /** The drivers at a point: of what slides there, or of every joint, by the names of its links where there are more. */
  function driverParts(app, id) {
    const { sheet } = app, pins = Bench.pinsAt(sheet, id), slides = Object.values(sheet.pairs).some(pair => pair.kind === "P" && pair.at === id);
    return pins.length > 1 && !slides ? pins.flatMap(pin => driverPart(app, pin, "panel.drivenof")) : driverPart(app, Bench.driverAt(sheet, id));
  }

  /** The driver of a joint: there or not, and its speed. */
  function driverPart(app, links, key = "panel.driven") {
    if (!links) return [];
    const sheet = app.posed(), own = sheet.drivers.find(d => links.includes(d.base) && links.includes(d.link));
    const names = { a: Bench.linkName(sheet, links[1]), b: Bench.linkName(sheet, links[0]) };
    const box = check(key, Boolean(own), () => take(app, s => Bench.toggleDriver(s, ...links)), names);
    if (!own || own.law.kind !== "linear") return [box];
    const set = law => take(app, s => ({ ...s, drivers: Bench.inStep(s.drivers.map(d => (d.base === own.base && d.link === own.link ? { ...d, law: { ...d.law, ...law } } : d))), range: null }));
    const value = text => {
      const found = Number(text.replace(",", "."));
      if (!Number.isFinite(found) || found === 0) throw new Bench.Fault("fault.typed", { text: text.slice(0, 20) });
      return found;
    };
    return [box, field(app, "panel.rate", String(own.law.rate), text => set({ rate: value(text) }))];
  }

  function linkPanel(app, id) {
    const sheet = app.posed(), link = sheet.links[id], { unit } = sheet;
    const others = Object.keys(sheet.links).filter(own => own !== id).map(own => sheet.links[own].name);
    const name = field(app, "panel.name", link.name, text => take(app, s => ({
      ...s, links: { ...s.links, [id]: { ...s.links[id], name: text.trim() ? named(text, others) : "" } } })));
    const lengths = [];
    for (let k = 0; k < link.points.length && link.points.length > 1; k++) {
      const a = link.points[k], b = link.points[(k + 1) % link.points.length];
      if (k === 1 && link.points.length === 2) break;
      lengths.push([a, b]);
    }
    const fixed = p => sheet.links[Bench.GROUND].points.includes(p);
    const stretch = (a, b, text) => {
      const wanted = number(text, unit);
      if (!(wanted > 0)) throw new Bench.Fault("fault.typed", { text: text.slice(0, 20) });
      const [stay, go] = fixed(b) && !fixed(a) ? [b, a] : [a, b];
      take(app, s => {
        const p = s.points[stay], q = s.points[go], factor = wanted / Bench.distance(s, a, b);
        return Bench.placed(s, { [go]: [p.x + (q.x - p.x) * factor, p.y + (q.y - p.y) * factor] });
      });
    };
    const rows = lengths.map(([a, b]) => {
      const made = field(app, "panel.length", tidy(Bench.distance(sheet, a, b)), text => stretch(a, b, text), { unit });
      made.firstChild.textContent = Bench.word("panel.between", { a: sheet.points[a].name, b: sheet.points[b].name });
      return made;
    });
    const [a, b] = link.points;
    const turn = link.points.length === 2 && field(app, "panel.angle",
      degrees(Math.atan2(sheet.points[b].y - sheet.points[a].y, sheet.points[b].x - sheet.points[a].x)), text => {
        const to = angle(text);
        take(app, s => {
          const p = s.points[a], length = Bench.distance(s, a, b);
          return Bench.placed(s, { [b]: [p.x + length * Math.cos(to), p.y + length * Math.sin(to)] });
        });
      }, { unit: "°" });
    return [make("h3", {}, Bench.linkName(sheet, id)), name, ...rows, turn];
  }

  function pairPanel(app, id) {
    const sheet = app.posed(), pair = sheet.pairs[id];
    const set = more => take(app, s => ({ ...s, pairs: { ...s.pairs, [id]: { ...s.pairs[id], ...more } } }));
    const parts = [make("h3", {}, Bench.word(`pair.${pair.kind}`)),
      make("p", { class: "soft" }, Bench.word("panel.pair", { a: Bench.linkName(sheet, pair.a), b: Bench.linkName(sheet, pair.b) }))];
    if (pair.kind === "P" || pair.kind === "pin-slot") {
      parts.push(field(app, "panel.direction", degrees(Bench.direction(sheet, pair)), text => set({ angle: angle(text), along: undefined }), { unit: "°" }));
    }
    if (pair.kind === "P") {
      const free = Object.keys(sheet.links).filter(own => own !== pair.b && (own === pair.a || !Bench.joined(sheet, own, pair.b)));
      parts.push(choice("panel.guide", pair.a, free.map(own => [own, Bench.linkName(sheet, own)]), own => set({ a: own })));
      parts.push(...driverPart(app, [pair.a, pair.b]));
    }
    if (pair.kind === "cam") {
      // the roller stays where it is: it is at the mean radius, and waves of the sine begin there
      const own = pair.harmonics.findIndex(([c, s]) => c || s), drawnSo = pair.harmonics.every(([c, s], k) => !c && (k === own || !s));
      const waves = (n, lift) => {
        if (!(n >= 1 && n <= 40 && Number.isInteger(n)) || !(Math.abs(lift) < 2 * pair.radius)) throw new Bench.Fault("fault.cam");
        set({ harmonics: Array.from({ length: n }, (_, k) => [0, k === n - 1 ? lift / 2 : 0]) });
      };
      if (drawnSo && own >= 0) {
        parts.push(field(app, "panel.lift", tidy(2 * pair.harmonics[own][1]), text => waves(own + 1, number(text, sheet.unit)), { unit: sheet.unit }),
          field(app, "panel.waves", String(own + 1), text => waves(Number(text), 2 * pair.harmonics[own][1])));
      }
    }
    if (pair.kind === "gear") {
      // the wheels stay in mesh: one radius gives the other
      const radius = k => text => {
        const own = number(text, sheet.unit), length = Bench.distance(sheet, pair.at, pair.on);
        const other = pair.internal ? Math.abs(own + (k ? -length : length)) : length - own;
        take(app, s => Bench.withTeeth(s, id, ...(k ? [other, own] : [own, other]), pair.internal));
      };
      const ratio = text => {
        const own = number(text, sheet.unit);
        take(app, s => Bench.withTeeth(s, id, 1, own, pair.internal));
      };
      parts.push(field(app, "panel.first", tidy(pair.radii[0]), radius(0), { unit: sheet.unit }),
        field(app, "panel.second", tidy(pair.radii[1]), radius(1), { unit: sheet.unit }),
        field(app, "panel.ratio", tidy(pair.radii[1] / pair.radii[0]), ratio),
        check("panel.internal", pair.internal, on => take(app, s => Bench.withTeeth(s, id, pair.radii[0],
          on && pair.radii[0] === pair.radii[1] ? 2 * pair.radii[1] : pair.radii[1], on))));
    }
    return parts;
  }

  /** Show what is chosen. */
  Bench.showPanel = (app, place) => {
    const { sheet, selection } = app, [id] = selection;
    let parts;
    if (app.tool === "poses") parts = Bench.posePanel(app);
    else if (selection.length === 0) parts = [make("p", { class: "soft" }, Bench.word("panel.none"))];
    else if (selection.length > 1) parts = [make("h3", {}, Bench.word("panel.many", { n: selection.length }))];
    else if (sheet.points[id]) parts = pointPanel(app, id);
    else if (sheet.links[id]) parts = linkPanel(app, id);
    else parts = pairPanel(app, id);
    if (selection.length && app.tool !== "poses") {
      parts.push(make("div", { class: "acts" }, button("do.duplicate", () => Bench.do.duplicate(app)),
        button("do.mirror", () => Bench.do.mirror(app)), button("do.delete", () => Bench.do.delete(app))));
    }
    Bench.refill(place, ...parts);
  };
})();
