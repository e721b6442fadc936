// The data of the page: scripts that call Atlas.take...; rows, filters, orders.  Nothing is fetched: a page opened
// from a disk may load scripts, but not read files.
"use strict";

(function () {
  const digit = letter => parseInt(letter, 36);
  const byKey = new Map(), byLabel = new Map();
  const waiting = new Map();
  Atlas.rows = [];
  Atlas.families = new Map();
  const relatives = new Map(), sketches = new Map();
  let groups = null;

  Atlas.open = function (contents) {
    Atlas.contents = contents;
    for (const family of contents.families) Atlas.families.set(family.name, {...family, rows: null});
  };

  Atlas.take = function (name, data) {
    const family = Atlas.families.get(name), length = data.keys.length / family.chains, rows = [];
    let place = 0;
    for (const [assortment, count] of data.assortments)
      for (let rank = 1; rank <= count; rank++, place++) {
        const own = data.ranks ? data.ranks[place] : rank;
        rows.push({
          family: name, place, key: data.keys.slice(place * length, (place + 1) * length), assortment,
          label: `${family.mobility}.${family.links}.${assortment}.${own}`, mobility: family.mobility, links: family.links,
          joints: family.joints, symmetry: data.symmetry[place], inversions: data.inversions[place],
          girth: digit(data.girth[place]), planar: data.planar[place] === "1", fractionated: data.fractionated[place] === "1",
          low: digit(data.low[place]), high: digit(data.high[place]), contracted: data.contracted[place],
        });
      }
    family.rows = rows;
    Atlas.rows = [...Atlas.families.values()].flatMap(one => one.rows || []);
    Atlas.rows.forEach((row, k) => { row.id = k; });
    for (const row of rows) { byKey.set(row.key, row); byLabel.set(row.label, row); }
  };
  Atlas.takeSketches = (name, number, text) => sketches.set(`${name}-${number}`, text);
  Atlas.takeRelatives = (name, data) => relatives.set(name, data);
  Atlas.names = [];
  Atlas.takeNames = data => { Atlas.names = data; };
  Atlas.takeGroups = data => { groups = data; };

  /** Load a script of the data folder once; the promise tells whether it came. */
  function load(file) {
    if (!waiting.has(file)) waiting.set(file, new Promise(done => {
      const script = document.createElement("script");
      script.src = `data/${file}.js`;
      script.onload = () => done(true);
      script.onerror = () => { waiting.delete(file); done(false); };
      document.head.append(script);
    }));
    return waiting.get(file);
  }

  Atlas.loadFamily = async function (name) {
    const family = Atlas.families.get(name);
    if (family && !family.rows) await load(`family-${name}`);
    return family;
  };

  /** The families that a number of links and a mobility name. */
  Atlas.familiesOf = (mobility, links) =>
    [...Atlas.families.values()].filter(family => family.mobility === mobility && family.links === links);

  /** The row of a key or label, loading its family if needed; null if the atlas has none. */
  Atlas.find = async function (name) {
    const known = byKey.get(name) || byLabel.get(name);
    if (known) return known;
    let mobility, links;
    const label = /^(\d+)\.(\d+)\./.exec(name);
    if (label) [mobility, links] = label.slice(1).map(Number);
    else try {
      const graph = Atlas.decodeKey(name);
      [mobility, links] = [Atlas.mobility(graph), graph.links];
    } catch { return null; }
    for (const family of Atlas.familiesOf(mobility, links)) await Atlas.loadFamily(family.name);
    return byKey.get(name) || byLabel.get(name) || null;
  };

  const sheetOf = row => `${row.family}-${Math.floor(row.place / Atlas.contents.sketchesPerFile)}`;

  /** Places of the joints of a chain's sketch, or null if they are not loaded. */
  Atlas.placesOf = function (row) {
    const text = sketches.get(sheetOf(row));
    if (!text) return null;
    const start = row.place % Atlas.contents.sketchesPerFile * 4 * row.joints;
    return Atlas.places(text.slice(start, start + 4 * row.joints));
  };
  Atlas.loadPlaces = async row => { await load(`sketches-${sheetOf(row)}`); return Atlas.placesOf(row); };

  Atlas.relativesOf = async function (row) {
    await load(`relatives-${row.family}`);
    const own = relatives.get(row.family);
    if (!own) return {parents: [], children: []};
    const resolve = async (list, step) => {
      const family = await Atlas.loadFamily(list.length ? `${row.mobility}-${row.links + step}` : "");
      return Promise.all(list.map(one => (typeof one === "number" ? family.rows[one] : Atlas.find(one).then(row => row || one))));
    };
    return {parents: await resolve(own.parents[row.place], -2), children: await resolve(own.children[row.place], 2)};
  };

  /** The mechanism that the catalogue holds of a chain: [frame, drivers, the workbench's address], or null. */
  Atlas.mechanismOf = async function (row) {
    await load(`relatives-${row.family}`);
    const held = relatives.get(row.family)?.mechanisms?.[row.place], whole = link => Number.isInteger(link) && link >= 0 && link < row.links;
    return held && [held[0], ...held[1]].every(whole) && /^#m=[\w-]+$/.test(held[2]) ? held : null;
  };

  /** What the catalogue has evaluated of a chain: [frame, drivers, kind, status, value, unit, guarantee] each. */
  Atlas.evaluationsOf = async function (row) {
    await load(`relatives-${row.family}`);
    return relatives.get(row.family)?.evaluations[row.place] || [];
  };

  /** The choices of prismatic joints, with what shows them: Atlas.sliderSection. */
  Atlas.loadSliders = () => load("sliders");

  /** Class of a structural group by its key, and its number of assembly modes, or undefined. */
  Atlas.loadClasses = async () => { await load("groups"); };
  Atlas.classOf = key => groups?.[key]?.[0];
  Atlas.modesOf = key => groups?.[key]?.[1];

  // --- choosing and ordering

  Atlas.ORDERS = {
    number: ["number", row => row.id],
    key: ["key", row => row.key],
    symmetry: ["symmetry", row => row.symmetry],
    inversions: ["inversions", row => row.inversions],
    girth: ["shortest loop", row => row.girth],
    low: ["lowest class", row => row.low],
    high: ["highest class", row => row.high],
  };

  const matches = (one, lower) => `${one.name} ${one.uses}`.toLowerCase().includes(lower);
  const TESTS = {
    mobility: value => row => row.mobility === +value,
    links: value => { const set = new Set(value.split(",").map(Number)); return row => set.has(row.links); },
    assortment: value => row => row.assortment === value,
    planar: value => row => row.planar === (value === "yes"),
    symmetry: value => (value === "none" ? row => row.symmetry === 1 : row => row.symmetry > 1),
    girth: value => row => row.girth === +value,
    fractionated: value => row => row.fractionated === (value === "yes"),
    low: value => row => row.low > 0 && row.low <= +value,
    contracted: value => row => row.contracted === +value,
    named: () => { const keys = new Set(Atlas.names.map(one => one.key)); return row => keys.has(row.key); },
    text: value => {
      const plain = value.trim(), lower = plain.toLowerCase();
      let key = Atlas.withSliders(plain)?.key || "";
      if (!key) try { key = Atlas.label(Atlas.fromGraph6(plain)).key; } catch { /* no graph6 */ }
      const keys = new Set(lower.length < 3 ? [] : Atlas.names.filter(one => matches(one, lower)).map(one => one.key));
      return row => row.label.includes(lower) || row.key.startsWith(plain) || row.key === key || keys.has(row.key);
    },
  };

  /** What a search says of prismatic joints of a chain: a part of its address, or nothing. */
  Atlas.searched = function (text, row) {
    const lower = text.trim().toLowerCase(), own = Atlas.withSliders(text.trim());
    const fitting = lower.length < 3 || own ? [] : Atlas.names.filter(one => one.key === row.key && matches(one, lower));
    const called = fitting.filter(one => one.name.toLowerCase().includes(lower)), named = called.length ? called : fitting;
    const asked = own && own.key === row.key ? own : named.length === 1 ? named[0] : {};
    return asked.sliders ? Atlas.slidersAsked(asked) : "";
  };

  /** Rows that pass all questions, in an order: {text, links, ..., sort, down}. */
  Atlas.choose = function (question) {
    const tests = Object.entries(question).filter(([name, value]) => TESTS[name] && value).map(([name, value]) => TESTS[name](value));
    const found = Atlas.rows.filter(row => tests.every(test => test(row)));
    const sort = Atlas.ORDERS[question.sort] && question.sort !== "number" ? Atlas.ORDERS[question.sort][1] : null;
    // the rows stand in the order of their numbers, and sorting keeps it among equals
    if (sort) found.sort((x, y) => { const p = sort(x), q = sort(y); return p < q ? -1 : p > q ? 1 : 0; });
    return question.down ? found.reverse() : found;
  };
})();
