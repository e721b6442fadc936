// Chains by number of links and mobility: counted and listed by the kernels, shown as sketches, laid on the table.
"use strict";

(function () {
  const { make } = Bench, $ = id => document.getElementById(id), NEED = ["chains-data", "chains.wasm", "sketch.wasm"], PAGE = 60;
  /** Above so many links a list would be long; chains are counted all the same. */
  const LISTED = 12;

  /** A small picture of a chain: plates, bars, joints; no frame. */
  Bench.chainStill = ({ links, joints, places }) => {
    const x = places.map(p => p[0]), y = places.map(p => p[1]), [left, low] = [Math.min(...x), Math.min(...y)];
    const scale = Math.min(140 / (Math.max(...x) - left || 1), 96 / (Math.max(...y) - low || 1));
    const dx = (160 - scale * (Math.max(...x) - left)) / 2, dy = (112 - scale * (Math.max(...y) - low)) / 2;
    const at = places.map(p => [dx + scale * (p[0] - left), 112 - dy - scale * (p[1] - low)]);
    const root = Bench.svg("svg", { class: "chainstill", viewBox: "0 0 160 112", "aria-hidden": "true" });
    for (let link = 0; link < links; link++) {
      const own = Bench.hull(at.filter((_, k) => joints[k].includes(link)));
      root.append(Bench.svg("path", { class: own.length > 2 ? "plate" : "bar", d: Bench.pathOf(own, own.length > 2) }));
    }
    root.append(...at.map(([cx, cy]) => Bench.svg("circle", { cx: cx.toFixed(1), cy: cy.toFixed(1), r: 3 })));
    return root;
  };

  /** Number of binary, ternary, ... links, as "4-4" says it. */
  const assortment = ({ links, joints }) => {
    const degrees = Array.from({ length: links }, (_, link) => joints.filter(pair => pair.includes(link)).length);
    return Array.from({ length: Math.max(...degrees) - 1 }, (_, k) => degrees.filter(own => own === k + 2).length).join("-");
  };

  /** Put a chain on the table, with dimensions that turn if such are found. */
  Bench.layChain = async (app, { links, joints, places }, more = {}) => {
    app.say("said.turning");
    const data = await Bench.job(app, ["sketch.wasm"], "turn", [links, joints, { places, ...more }]);
    if (!data) return false;
    return app.attempt(() => {
      const sheet = Bench.opened(Bench.checked(data));
      return { sheet: { ...sheet, unit: app.sheet.unit }, select: [] };
    }) && (Bench.do.fit(app), app.say(...reached(app.motion)), true);
  };

  /** Whether the driver turns fully, or how far it moves from where it is drawn. */
  const reached = motion => {
    const swept = motion && motion.driven ? motion.sweep() : null;
    if (!swept || swept.full) return [swept ? "said.turns" : "said.turnsnot"];
    const [from, to] = [swept.inputs[0], swept.inputs[swept.inputs.length - 1]].map(input => Bench.shownInput(motion, input));
    return [motion.turns ? "said.swings" : "said.slides", { from, to }];
  };

  const still = (app, chain, dialog) => {
    const key = Bench.keyOf(app, chain), named = Bench.word(`chain.${key}`), name = named === `chain.${key}` ? assortment(chain) : named;
    return make("button", { type: "button", "data-key": key, title: key, on: { click: async () => {
      if (await Bench.layChain(app, chain)) $(dialog).close();
    } } }, Bench.chainStill(chain), make("span", {}, name));
  };

  /** The relatives of a chain as sketches. */
  Bench.showRelatives = async (app, chain) => {
    if (app.work.busy) app.work.stop();
    const { smaller, larger } = Bench.relatives(app, chain), all = [...smaller, ...larger];
    $("kin").showModal();
    $("kinLess").hidden = !smaller.length;
    $("kinSmaller").replaceChildren();
    $("kinLarger").replaceChildren();
    const places = await Bench.job(app, ["sketch.wasm"], "places", all);
    if (!places) return;
    const stills = all.map((own, k) => still(app, { ...own, ...places[k] }, "kin"));
    $("kinSmaller").replaceChildren(...stills.slice(0, smaller.length));
    $("kinLarger").replaceChildren(...stills.slice(smaller.length));
  };

  let asked = 0;

  /** Count, then show the sketches of a part of the list. */
  async function show(app, from = 0) {
    const own = ++asked, links = Number($("chainLinks").value), mobility = Number($("chainMobility").value), told = $("chainCount");
    const here = () => own === asked && $("chains").open;
    if (app.work.busy) app.work.stop();
    if (!from) $("chainList").replaceChildren();
    $("chainMore").hidden = true;
    told.textContent = Bench.word("chains.counting");
    const began = performance.now();
    const count = await Bench.job(app, NEED, "count", [links, mobility], share => { if (here()) told.textContent = Bench.word("chains.share", { share: Math.floor(100 * share) }); });
    if (!here() || count === null) return;
    const time = Bench.shown((performance.now() - began) / 1000, 2), shown = BigInt(count).toLocaleString(Bench.language());
    told.textContent = Bench.word(links > LISTED ? "chains.countonly" : "chains.count", { count: shown, time });
    if (links > LISTED) return;
    const found = await Bench.job(app, NEED, "list", [links, mobility, from, PAGE]);
    if (!here() || found === null) return;
    $("chainList").append(...found.map(chain => still(app, chain, "chains")));
    const more = $("chainMore"), rest = BigInt(count) - BigInt(from + found.length);
    more.hidden = rest <= 0n;
    more.textContent = Bench.word("chains.more", { n: rest.toLocaleString(Bench.language()) });
    more.onclick = () => show(app, from + found.length);
  }

  Bench.do.chains = async app => {
    $("chains").showModal();
    try { await Bench.need(...NEED); } catch (fault) { app.fault(fault); return; }
    const kinds = await Chains.kinds(), mobility = $("chainMobility"), links = $("chainLinks");
    const put = (select, values, wanted) => select.replaceChildren(...values.map(value => make("option", { value, selected: value === wanted }, String(value))));
    const fill = () => put(links, kinds.filter(kind => kind[1] === Number(mobility.value)).map(kind => kind[0]), Number(links.value) || 6);
    if (!mobility.options.length) {
      put(mobility, [...new Set(kinds.map(kind => kind[1]))].sort(), 1);
      fill();
      mobility.onchange = () => { fill(); show(app); };
      links.onchange = () => show(app);
    }
    if (!$("chainList").childElementCount) show(app);
  };
})();
