// What is known of the drawing: mobility, what is too much or loose, structural groups, how far it turns, other drivers
// and other frames.
"use strict";

(function () {
  const { make } = Bench;

  /** The sheet with another link as the frame. */
  Bench.inverted = (sheet, id) => {
    if (id === Bench.GROUND) return sheet;
    const swap = own => (own === id ? Bench.GROUND : own === Bench.GROUND ? id : own);
    const links = Object.fromEntries(Object.keys(sheet.links).map(own => [own, { ...sheet.links[swap(own)], name: "" }]));
    const pairs = Object.fromEntries(Object.entries(sheet.pairs).map(([key, pair]) => [key, { ...pair, a: swap(pair.a), b: swap(pair.b) }]));
    const points = Object.fromEntries(Object.entries(sheet.points).map(([key, point]) =>
      [key, point.tree ? { ...point, tree: point.tree.map(pair => pair.map(swap)) } : point]));
    const drivers = sheet.drivers.map(d => ({ ...d, base: swap(d.base), link: swap(d.link) }));
    return Bench.settled({ ...sheet, links, pairs, points, drivers, range: null });
  };

  const idsOf = (app, numbers) => numbers.map(k => Object.keys(app.sheet.links)[k]);
  const named = (app, numbers) => idsOf(app, numbers).map(id => Bench.linkName(app.sheet, id)).join(", ");

  function fault(app, { kind, tooMany, loose, link }) {
    if (kind === "over-constrained") return Bench.word("know.over", { links: named(app, tooMany), loose: named(app, loose) || "–" });
    if (kind === "drivers") return Bench.word("know.drivers", { n: app.motion.engine.mobility, have: app.sheet.drivers.length });
    return Bench.word(`know.${kind}`, { links: link === null ? "–" : named(app, [Number(link)]) });
  }

  /** The chain: its key in the atlas and in the library, and its name if it has one. */
  function chain(key) {
    if (!key) return [];
    const named = `chain.${key}`, name = Bench.word(named);
    return [[Bench.word("know.chain"), name === named ? key : `${name} (${key})`]];
  }
  /** Chains one dyad away, and the page of the chain in the atlas. */
  function kin(app, data, key) {
    const chain = key && Bench.chainOf(data);
    if (!chain) return null;
    return make("div", { class: "acts" }, make("button", { type: "button", "data-kin": key, on: { click: () => Bench.showRelatives(app, chain) } }, Bench.word("know.kin")),
      Bench.atlas ? make("a", { href: `${Bench.atlas}#/${Bench.sliderKey(app.labels, data)}`, target: "_top" }, Bench.word("know.atlas")) : null);
  }

  /** A row of buttons, one for each entry. */
  const buttons = entries => make("div", { class: "acts" }, ...entries.map(([text, act, more = {}]) => make("button", { type: "button", on: { click: act }, ...more }, text)));

  function rotation(app, motion) {
    const swept = motion.sweep();
    if (!swept) return [];
    const first = swept.inputs[0], last = swept.inputs[swept.inputs.length - 1];
    const text = swept.full ? Bench.word(swept.turns === 1 ? "know.full" : swept.turns < Infinity ? "know.fullbut" : "know.fullopen", { n: Math.min(swept.turns, Engine.TURNS) }) : Bench.word("know.range", { from: Bench.shownInput(motion, first), to: Bench.shownInput(motion, last) });
    const angles = [];
    const steps = swept.margins.length / swept.inputs.length;
    for (let i = 0; i < swept.inputs.length; i++) {
      for (const { angle } of motion.engine.transmission(swept.margins.subarray(i * steps, (i + 1) * steps))) if (Number.isFinite(angle)) angles.push(angle);
    }
    const rows = [[Bench.word("know.rotation"), text]];
    if (angles.length) rows.push([Bench.word(motion.engine.groups.every(own => own.twoModes) ? "know.transmission" : "know.transmission.dyads"), `${Bench.shown(Math.round((Math.min(...angles) * 1800) / Math.PI) / 10)}°`]);
    const events = swept.events.map(event => [motion.told(event), () => { motion.to(event.input); app.changed("rest"); }]);
    return [Bench.rows(rows), ...proof(app, motion, swept), events.length ? buttons(events) : null];
  }

  /** The certificate of the motion: asked for by a button, computed in the worker. */
  function proof(app, motion, swept) {
    const own = app.proof && app.proof.swept === swept ? app.proof : null;
    if (own && own.told) return [make("p", { id: "proved", class: own.good ? "" : "warn" }, own.told()), make("p", { class: "soft" }, Bench.word("know.proofabout", { n: own.boxes }))];
    return [make("div", { class: "acts" }, make("button", { type: "button", "data-certify": true, disabled: Boolean(own), on: { click: () => prove(app, motion, swept) } }, Bench.word("know.prove")))];
  }

  async function prove(app, motion, swept) {
    const { engine, driver } = motion, data = Bench.written(app.sheet), turns = swept.full && swept.turns < Infinity ? swept.turns : 0;
    const asked = { pose: Array.from(engine.pose), driver, from: swept.inputs[0], to: swept.inputs[swept.inputs.length - 1], turns };
    if (app.work.busy) app.work.stop();
    const own = app.proof = { swept, sheet: app.sheet };
    app.changed("rest");
    app.say("said.proving", { share: 0 });
    const found = await Bench.job(app, ["proof.wasm"], "prove", [data, asked], share => app.say("said.proving", { share: Math.round(100 * share) }));
    if (app.proof !== own) return;
    app.proof = null;
    if (found && !found.known) Bench.showPython(Binding.program(data, [], ["print(graphsynth.certify(motion).statement)\n"]), "python.certify", "prove.py");
    if (found && found.known) app.proof = { swept, boxes: found.boxes, good: found.high > found.low, told: () => proved(motion, found, turns) };
    if (app.proof) app.say(app.proof.good ? "said.proved" : "know.unproved");
    app.changed("rest");
  }

  /** What is proved, in words; the ends are rounded inward. */
  function proved(motion, { low, high, full }, turns) {
    if (full) return Bench.word(turns === 1 ? "know.provedfull" : "know.provedmany", { n: turns });
    if (!(high > low)) return Bench.word("know.unproved");
    const unit = motion.turns ? 180 / Math.PI : 1, step = 10 ** (Math.floor(Math.log10(unit * Math.max(-low, high))) - 3);
    const at = (value, round) => Bench.shownInput(motion, (round((value * unit) / step) * step) / unit);
    return Bench.word("know.provedrange", { from: at(low, Math.ceil), to: at(high, Math.floor) });
  }

  function drivers(app, motion) {
    const { sheet } = app, data = Bench.written(sheet), ids = Object.keys(sheet.links);
    const free = motion.engine.drivers().map(k => data.joints[k]).filter(j =>
      !sheet.drivers.some(d => [d.base, d.link].includes(ids[j.a]) && [d.base, d.link].includes(ids[j.b])));
    if (!free.length) return [];
    return [make("h3", {}, Bench.word("know.others")), buttons(free.slice(0, 12).map(j => {
      const [base, link] = j.b === ids.indexOf(Bench.GROUND) ? [j.b, j.a] : [j.a, j.b];
      const text = Bench.word("know.drive", { a: Bench.linkName(sheet, ids[link]), b: Bench.linkName(sheet, ids[base]) });
      return [text, () => app.attempt(s => ({
        sheet: { ...s, range: null, drivers: Bench.inStep([{ base: ids[base], link: ids[link], law: { kind: "linear", rate: 1, offset: 0 } }, ...s.drivers.slice(1)]) },
        say: ["said.driven", { a: Bench.linkName(s, ids[link]), b: Bench.linkName(s, ids[base]) }],
      }))];
    }))];
  }

  function frames(app) {
    const { sheet } = app, others = Object.keys(sheet.links).filter(id => id !== Bench.GROUND);
    return [make("h3", {}, Bench.word("know.frames")), buttons(others.map(id => [Bench.linkName(sheet, id), () =>
      app.attempt(s => ({ sheet: Bench.inverted(s, id), select: [], say: ["said.inverted", { a: Bench.linkName(s, id) }] }))]))];
  }

  /** The section "Known". */
  Bench.showKnown = (app, place) => {
    const { motion } = app, engine = motion && motion.current();
    // a proof of what is no longer drawn is given up
    if (app.proof && app.proof.sheet && app.proof.sheet !== app.sheet) { app.proof = null; app.work.stop(); }
    app.faulty = [];
    place.closest("section").hidden = !app.labels && !motion;
    const data = Bench.written(app.sheet), keyed = () => (app.labels ? Bench.chainKey(app.labels, data) : null);
    if (!motion && Object.keys(app.sheet.links).length > 1) { place.replaceChildren(Bench.rows(chain(keyed()))); return; }
    if (!engine) { place.replaceChildren(make("p", { class: "soft" }, Bench.word("know.nothing"))); return; }
    const key = keyed(), rows = [[Bench.word("know.mobility"), String(engine.mobility)], ...chain(key)], parts = [];
    if (engine.fault) {
      app.faulty = idsOf(app, engine.fault.tooMany || []);
      parts.push(make("p", { class: "warn" }, fault(app, engine.fault)));
    } else {
      const name = ({ kind, links }) => `${Bench.groupName(kind)} (${named(app, links)})`;
      rows.push([Bench.word("know.groups"), engine.groups.map(name).join("; ") || "–"]);
      if (motion.driven && engine.groups.length) {
        parts.push(make("h3", {}, Bench.word("know.modes")), buttons(engine.groups.map((group, k) => [name(group), () => motion.assemble(k), { "data-group": k }])));
      }
    }
    Bench.refill(place, Bench.rows(rows), kin(app, data, key), ...parts, ...(motion.driven ? rotation(app, motion) : []),
      ...(engine.mobility > 0 ? drivers(app, motion) : []), ...frames(app));
  };

  /** The name of a group in the reader's language: dyads by their joints, larger ones by their links. */
  Bench.groupName = kind => {
    const many = /^group of (\d+) links$/.exec(kind);
    return many ? Bench.word("know.many", { n: many[1] }) : kind.split("+").map(Bench.kindName).join("+");
  };
})();
