// The page of one chain.
"use strict";

(function () {
  const $ = id => document.getElementById(id), {html} = Atlas;
  const NAMES = ["binary", "ternary", "quaternary", "quinary"];
  let state = null;

  const kinds = row => row.assortment.split("-").map((count, k) => [+count, NAMES[k] || `${k + 2}-joint`])
    .filter(([count]) => count).map(([count, name]) => `${count} ${name}`).join(", ");
  const listed = (links, between = ", ") => links.join(between);

  function sentence(row, graph) {
    const loops = graph.joints.length - graph.links + 1;
    return html`${graph.links} ${Atlas.term("link", "links")} (${kinds(row)}), ${graph.joints.length} ${Atlas.term("joint", "joints")},
${loops} ${Atlas.term("loop")}, ${Atlas.term("mobility")} ${row.mobility}.`;
  }

  function header(row) {
    const link = (other, words) => (other ? html`<a href="#/${other.key}" title="${other.label}">${words}</a>` : html`<span class="soft">${words}</span>`);
    return html`<p class="path"><a href="#/?links=${row.links}">${row.links} links</a> › <a href="#/?links=${row.links}&amp;assortment=${row.assortment}">${row.assortment}</a><span
 class="turn">${link(Atlas.rows[row.id - 1], "‹ before")} ${link(Atlas.rows[row.id + 1], "next ›")}</span></p>
<h1 tabindex="-1">${row.label}</h1><p class="keyline">${Atlas.term("key")} <code>${row.key}</code> <button type="button" id="copy">copy</button></p>`;
  }

  function properties(row, label) {
    const orbits = orbitsOf(label).filter(orbit => orbit.length > 1);
    const shape = (Atlas.contents.contracted[row.contracted] || "none, a single loop").replace(/x/g, "×");
    const items = [
      ["symmetry", html`${row.symmetry === 1 ? "none" : `order ${row.symmetry}`}${orbits.length > 0 && html`; ${Atlas.term("orbit", "orbits")} ${orbits.map(orbit => `{${listed(orbit)}}`).join(" ")}`}`],
      ["inversion", `${row.inversions}`, "inversions"], ["planar", row.planar ? "yes" : "no"], ["girth", `${row.girth} links`],
      ["fractionated", row.fractionated ? "yes" : "no"], ["class", row.low ? `${Atlas.classes(row)} over all frames and drivers` : "none: no drivers on one link move it"],
      ["contracted", html`<span class="shape">${shape}</span> <a href="#/?contracted=${row.contracted}">all with it</a>`],
      ["graph6", html`<code>${Atlas.toGraph6(Atlas.decodeKey(row.key))}</code>`],
    ];
    return html`<dl>${items.map(([term, words, shown]) => html`<div><dt>${Atlas.term(term, shown)}</dt><dd>${words}</dd></div>`)}</dl>`;
  }

  function orbitsOf(label) {
    const found = new Map();
    label.orbits.forEach((low, link) => found.set(low, [...(found.get(low) || []), link]));
    return [...found.values()];
  }

  const matrixTable = (rows, caption, heads) =>
    html`<div class="scroll"><table class="matrix"><caption>${caption}</caption><thead><tr><td></td>${heads.map(h => html`<th scope="col">${h}</th>`)}</tr></thead>
<tbody>${rows.map((row, k) => html`<tr><th scope="row">${k}</th>${row.map(v => (v ? html`<td class="one">${v}</td>` : html`<td>·</td>`))}</tr>`)}</tbody></table></div>`;

  const pairs = () => Atlas.pairs(state.graph, state.sliders);

  /** The workbench with this frame and these drivers: dimensions of the catalogue where it holds some, else found there. */
  function bench() {
    const {row, frame, drivers, sliders} = state, held = state.mechanism, same = held && !sliders.length && held[0] === frame && String(held[1]) === String(drivers);
    return `workbench/index.html${same ? held[2] : `#k=${row.key}${sliders.length ? `&p=${pairs()}` : ""}${frame === null ? "" : `&f=${frame}${drivers.length && !state.apart ? `&d=${listed(drivers, ",")}` : ""}`}`}`;
  }

  const sliding = own => `#/${own.key}${Atlas.slidersAsked(own)}`;

  function named(row) {
    const own = Atlas.names.filter(one => one.key === row.key);
    return own.length > 0 && html`<h2>Names and uses</h2><ul class="named">${own.map(one =>
      html`<li><a href="${one.template ? `workbench/index.html#t=${one.template}` : sliding(one)}">${one.name}</a>: ${one.uses}.
${one.template && one.sliders && html` <a href="${sliding(one)}">Its sliders</a>.`} <small class="soft">${one.source}</small></li>`)}</ul>`;
  }

  /** Best choice to begin with: that of the catalogue's dimensions, or the first driver that gives the lowest class. */
  function firstChoice(row, graph, label, mechanism) {
    if (mechanism) return {frame: mechanism[0], drivers: mechanism[1]};
    for (const [frame] of orbitsOf(label))
      for (const drivers of driverSets(graph, frame)) {
        const groups = Atlas.groups({...graph, frame}, drivers);
        if (groups && classOf(groups) === row.low) return {frame, drivers};
      }
    return {frame: 0, drivers: []};
  }

  /** Sets of driven links on a frame, as many as the mobility. */
  function driverSets(graph, frame) {
    const near = Atlas.neighbours(graph)[frame], sets = [];
    const add = (chosen, from) => {
      if (chosen.length === Atlas.mobility(graph)) { sets.push(chosen); return; }
      for (let k = from; k < near.length; k++) add([...chosen, near[k]], k + 1);
    };
    add([], 0);
    return sets;
  }

  const movingSet = (graph, frame) => driverSets(graph, frame).find(set => Atlas.groups({...graph, frame}, set));

  function classOf(groups) {
    const found = groups.map(group => Atlas.classOf(group.key));
    return found.some(own => own === undefined) ? undefined : Math.max(1, ...found);
  }

  function inversions(graph, label) {
    const lines = orbitsOf(label).map(orbit => {
      const frame = orbit[0], framed = {...graph, frame};
      const sets = driverSets(graph, frame).map(drivers => {
        const groups = Atlas.groups(framed, drivers), own = groups && classOf(groups);
        return html`<button type="button" class="pick" data-frame="${frame}" data-drivers="${listed(drivers, ",")}"${groups ? "" : " disabled"}>${listed(drivers)} <small>${groups ? Atlas.roman(own) : "locked"}</small></button>`;
      });
      return html`<tr><th scope="row">${frame}${orbit.length > 1 && html` <small class="soft">like ${listed(orbit.slice(1))}</small>`}</th>
<td>${Atlas.levels(framed).map(level => level.length).join("-")}</td><td>${sets.map(set => html`${set} `)}</td></tr>`;
    });
    return html`<div class="scroll"><table class="inversions"><thead><tr><th scope="col">frame</th><th scope="col">${Atlas.term("levels", "levels")}</th>
<th scope="col">${Atlas.term("driver", "drivers")} and the ${Atlas.term("class", "class")} they give</th></tr></thead><tbody>${lines}</tbody></table></div>`;
  }

  function controls(graph) {
    const frames = [...Array(graph.links).keys()].map(link => html`<option value="${link}">link ${link}</option>`);
    return html`<div class="controls"><label>Frame <select id="frame"><option value="">none</option>${frames}</select></label>
<fieldset id="drivers"><legend>${Atlas.term("driver")}</legend></fieldset><span class="soft">or click a link to hold it</span></div>`;
  }

  function pictures() {
    const {row, graph, frame, drivers, groups, places, sliders} = state, chain = `Chain ${row.label}${sliders.length ? `, sliders ${pairs()}` : ""}`;
    const held = frame === null ? chain : `${chain}, frame ${frame}, driver ${listed(drivers)}`;
    const own = {frame, drivers, sliders, groups: groups || [], title: `${held}: diagram`};
    return {
      sketch: file => (places ? Atlas.sketch(graph, places, {...own, file}) : ""),
      levels: file => (frame === null ? "" : Atlas.levelSketch({...graph, frame}, {drivers, groups: groups || [], title: `${held}: adjacency levels`, file})),
    };
  }

  function showChoice() {
    const {graph, frame, drivers} = state, near = frame === null ? [] : Atlas.neighbours(graph)[frame];
    state.groups = frame === null ? null : Atlas.groups({...graph, frame}, drivers);
    // where no drivers on the frame are enough some sit between moving links: the workbench puts them there
    state.apart = frame !== null && !state.groups && !movingSet(graph, frame);
    const shown = pictures();
    const picture = (svg, words) => (svg ? Atlas.drawn(svg) : html`<p class="soft">${words}</p>`);
    $("sketch").innerHTML = picture(shown.sketch(false), "This sketch could not be loaded.");
    $("levelsketch").innerHTML = picture(shown.levels(false), "Choose a frame: levels are counted from it.");
    $("frame").value = frame === null ? "" : frame;
    const one = Atlas.mobility(graph) === 1;
    $("drivers").hidden = frame === null;
    $("drivers").innerHTML = html`<legend>${Atlas.term("driver")}</legend>${near.map(link =>
      html`<label class="chip"><input type="${one ? "radio" : "checkbox"}" name="driver" value="${link}"${drivers.includes(link) ? " checked" : ""}><span>${link}</span></label>`)}`;
    $("groups").innerHTML = groupList();
    document.querySelectorAll("#entry .pick").forEach(button =>
      button.setAttribute("aria-pressed", button.dataset.frame === String(frame) && button.dataset.drivers === String(drivers)));
    saveButtons(shown);
    const moves = frame === null || Boolean(state.groups) || state.apart, address = bench(), shownBench = $("bench");
    $("openbench").href = address;
    $("moving").hidden = !moves;
    if (moves && shownBench.getAttribute("src") !== address) shownBench.setAttribute("src", address);
  }

  function groupList() {
    const {graph, frame, drivers, groups} = state;
    if (frame === null) return html`<p class="soft">Choose a frame and a driver.</p>`;
    if (state.apart) return html`<p class="soft">No drivers on this frame move the whole mechanism. On the workbench below some sit between moving links.</p>`;
    if (!groups) {
      const wanted = Atlas.mobility(graph);
      return html`<p class="soft">${drivers.length === wanted ? "These drivers do not move the mechanism." : `Choose ${wanted} driver${wanted > 1 ? "s" : ""}.`}</p>`;
    }
    const items = groups.map((group, k) =>
      html`<li><span class="swatch g${k % 4 + 1}"></span>links ${listed(group.links)}: ${Atlas.term("class")} ${Atlas.roman(Atlas.classOf(group.key))}, ${Atlas.term("order")} ${group.order}${group.links.length === 2 && " (dyad)"}</li>`);
    const modes = groups.reduce((product, group) => product * Atlas.modesOf(group.key), 1);
    return html`<p>Driver ${listed(drivers)} on frame ${frame}, then</p><ol>${items}</ol><p>Mechanism of class ${Atlas.roman(classOf(groups))}${modes > 0 && html`, at most ${modes} ${Atlas.term("modes")}`}.</p>`;
  }

  function saveButtons(shown) {
    const {graph, row, frame} = state, svgs = {};
    for (const what of ["sketch", "levels"]) { const text = shown[what](true); if (text) svgs[what] = text; }
    const files = Atlas.filesOf({...graph, frame}, row, svgs);
    $("files").innerHTML = html`${files.map(([name, what], k) => html`<button type="button" data-file="${k}" title="${name}">${what}</button> `)}`;
    $("files").onclick = event => {
      const button = event.target.closest("[data-file]");
      if (button) { const [name, , type, text] = files[+button.dataset.file]; Atlas.save(name, type, text); }
    };
  }

  function choose(frame, drivers) {
    const {graph, row} = state, near = frame === null ? [] : Atlas.neighbours(graph)[frame];
    const kept = drivers.filter(link => near.includes(link));
    Object.assign(state, {frame, drivers: kept.length || frame === null ? kept : movingSet(graph, frame) || []});
    const held = frame === null ? "frame=none" : `frame=${frame}${state.drivers.length ? `&driver=${state.drivers}` : ""}`;
    const words = `${held}${state.sliders.length ? `&sliders=${pairs()}` : ""}`;
    history.replaceState(null, "", `#/${row.key}?${words}`);
    showChoice();
  }

  /** Let joints slide; the section of choices follows. */
  function slide(chosen, again = null) {
    const {row, graph, frame, drivers} = state;
    state.sliders = chosen;
    if (again) {
      const own = Atlas.turning(graph, {frame, drivers}, chosen, driverSets);
      choose(own.frame, own.drivers);
    }
    const open = [...$("sliders").querySelectorAll("details")].map(one => one.open);
    $("sliders").innerHTML = html`${Atlas.sliderSection(row, graph, chosen)}`;
    $("sliders").querySelectorAll("details").forEach((one, k) => { if (open[k]) one.open = true; });
    const same = again && [...$("sliders").querySelectorAll(".pick")].find(one => one.dataset.sliders === again.dataset.sliders);
    if (same) same.focus({preventScroll: true});
  }

  function listen() {
    const entry = $("entry");
    $("sliders").addEventListener("click", event => {
      const button = event.target.closest(".pick");
      if (button) slide(button.dataset.sliders ? Atlas.chosen(state.graph, button.dataset.sliders) : [], button);
    });
    $("copy").addEventListener("click", async event => {
      try { await navigator.clipboard.writeText(state.row.key); event.target.textContent = "copied"; } catch { getSelection().selectAllChildren(entry.querySelector(".keyline code")); event.target.textContent = "selected"; }
    });
    $("frame").addEventListener("change", event => choose(event.target.value === "" ? null : +event.target.value, []));
    $("drivers").addEventListener("change", () => {
      const chosen = [...$("drivers").querySelectorAll("input:checked")].map(input => +input.value);
      choose(state.frame, chosen);
      const input = $("drivers").querySelector("input:checked");
      if (input) input.focus();
    });
    for (const id of ["sketch", "levelsketch"]) $(id).addEventListener("click", event => {
      const link = event.target.closest("[data-link]");
      if (link) choose(+link.dataset.link, []);
    });
    entry.querySelector(".inversions").addEventListener("click", event => {
      const button = event.target.closest(".pick");
      if (button) choose(+button.dataset.frame, button.dataset.drivers.split(",").map(Number));
    });
  }

  const card = row => (typeof row === "string" ? html`<li><code>${row}</code></li>`
    : html`<li><a href="#/${row.key}"><span class="thumb" data-key="${row.key}"></span><small>${row.label}</small></a></li>`);

  async function relatives(row) {
    const {parents, children} = await Atlas.relativesOf(row);
    if (state.row !== row) return;
    const most = 24, strip = list => html`<ul class="strip">${list.map(card)}</ul>`;
    const rest = children.slice(most);
    $("relatives").innerHTML = html`${[
      parents.length ? html`<h3>${parents.length} parent${parents.length > 1 && "s"}</h3>${strip(parents)}` : html`<p class="soft">No parent: no dyad can be taken out so that a chain is left.</p>`,
      children.length ? html`<h3>${children.length} child${children.length > 1 && "ren"}</h3>${strip(children.slice(0, most))}` : html`<p class="soft">No children in this catalogue.</p>`,
      rest.length > 0 && html`<details><summary>${rest.length} more</summary>${strip(rest)}</details>`,
    ]}`;
    const paint = async box => {
      const other = await Atlas.find(box.dataset.key), places = await Atlas.loadPlaces(other);
      if (places) box.innerHTML = Atlas.drawn(Atlas.sketch(Atlas.decodeKey(other.key), places, {width: 84, height: 68, small: true}));
    };
    const seen = new IntersectionObserver(entries => entries.filter(one => one.isIntersecting).forEach(one => { seen.unobserve(one.target); paint(one.target); }), {rootMargin: "200px"});
    $("relatives").querySelectorAll(".thumb").forEach(box => seen.observe(box));
  }

  const KINDS = ["dimensions", "transmission", "jamming"];
  const measure = (value, unit) => (value === null ? "" : unit === "rad" ? `${+(value * 180 / Math.PI).toPrecision(4)}°` : `${+value.toPrecision(6)} ${unit || ""}`);

  async function evaluations(row) {
    const rows = await Atlas.evaluationsOf(row);
    if (state.row !== row || !rows.length) return;
    const heads = ["frame", "driver", "what", "result", "value", "guarantee"].map(words => html`<th scope="col">${words}</th>`);
    const cells = words => words.map(one => html`<td>${String(one)}</td>`);
    const mechanisms = new Map();
    for (const [frame, drivers, ...rest] of rows) {
      const name = `${frame}|${drivers}`;
      mechanisms.set(name, [...(mechanisms.get(name) || []), rest]);
    }
    const lines = [...mechanisms].flatMap(([name, own]) => {
      const [frame, drivers] = name.split("|");
      const missing = KINDS.filter(kind => !own.some(one => one[0] === kind)).map(kind => [kind, "not computed", null, null, null]);
      return [...own, ...missing].map(([kind, status, value, unit, guarantee], k) =>
        html`<tr>${k ? cells(["", ""]) : cells([frame, drivers])}${cells([kind, status, measure(value, unit), guarantee || ""])}</tr>`);
    });
    $("evaluations").innerHTML = html`<div class="scroll"><table class="inversions"><thead><tr>${heads}</tr></thead><tbody>${lines}</tbody></table></div>
<p class="soft">Other frames, drivers and sliders: not computed in this catalogue.</p>`;
  }

  function choiceIn(parameters, row, graph, label, mechanism) {
    const frame = parameters.get("frame");
    if (frame === "none") return {frame: null, drivers: []};
    if (frame === null || !/^\d+$/.test(frame) || +frame >= graph.links) return firstChoice(row, graph, label, mechanism);
    const near = Atlas.neighbours(graph)[+frame];
    const given = (parameters.get("driver") || "").split(",").filter(Boolean).map(Number).filter(link => near.includes(link));
    return {frame: +frame, drivers: given.length ? given : movingSet(graph, +frame) || []};
  }

  /** Prismatic joints of an address; none, and why, where it names what is no joint. */
  function slidersIn(parameters, graph) {
    try { return {sliders: parameters.get("sliders") ? Atlas.chosen(graph, parameters.get("sliders")) : []}; } catch (fault) {
      if (!(fault instanceof Atlas.Fault)) throw fault;
      return {sliders: [], wrong: fault.message};
    }
  }

  Atlas.entry = async function (name, parameters) {
    const entry = $("entry"), mark = {}, other = Atlas.withSliders(name);
    state = mark;
    if (other) {
      history.replaceState(null, "", sliding(other));
      return Atlas.entry(other.key, new URLSearchParams(Atlas.slidersAsked(other)));
    }
    const row = await Atlas.find(name);
    if (state !== mark) return null;
    if (!row) {
      entry.innerHTML = html`<h1 tabindex="-1">Not in this atlas</h1><p>No chain here has the key or label <code>${name}</code>. <a href="#/find">Find my mechanism</a> says why.</p>`;
      return "Not in this atlas";
    }
    const [places, mechanism, , able] = await Promise.all([Atlas.loadPlaces(row), Atlas.mechanismOf(row), Atlas.loadClasses(), Atlas.loadSliders()]);
    if (state !== mark) return null;
    const graph = Atlas.decodeKey(row.key), label = Atlas.label(graph);
    const {sliders, wrong} = able ? slidersIn(parameters, graph) : {sliders: [], wrong: "The list of sliders could not be loaded."}, held = choiceIn(parameters, row, graph, label, mechanism);
    state = {row, graph, label, places, mechanism, sliders, ...(!able || parameters.has("driver") || held.frame === null ? held : Atlas.turning(graph, held, sliders, driverSets, parameters.has("frame")))};
    const joints = graph.joints.map(([a, b]) => `${a}-${b}`);
    entry.innerHTML = html`${header(row)}<p class="lead">${sentence(row, graph)}</p>
<div class="plate"><figure><div id="sketch" class="picture"></div><figcaption>Kinematic diagram</figcaption></figure>
<figure><div id="levelsketch" class="picture"></div><figcaption>Graph by ${Atlas.term("levels")}</figcaption></figure></div>${controls(graph)}
<h2>${Atlas.term("slider", "Sliders")}</h2><div id="sliders" class="sliders"></div>
<div class="columns"><section><h2>${Atlas.term("group", "Structural groups")}</h2><div id="groups"></div></section><section><h2>Properties</h2>${properties(row, label)}</section></div>
<h2>${Atlas.term("inversion", "Inversions")} and drivers</h2>${inversions(graph, label)}
${named(row)}<div id="moving"><h2>Motion</h2><p>This frame and these drivers on the workbench: play it, drag it, change its dimensions. <a id="openbench" href="workbench/index.html">On a page of its own</a></p>
<iframe id="bench" title="Chain ${row.label} on the workbench" loading="lazy"></iframe></div>
<h2>Evaluations</h2><div id="evaluations"><p class="soft">${row.low ? "Dimensions, transmission, jamming: not computed in this catalogue." : "None: what is evaluated has all its drivers on one link."}</p></div>
<h2>Matrices</h2><div class="columns">${matrixTable(Atlas.matrix(graph), Atlas.term("adjacency"), [...Array(graph.links).keys()])}
${matrixTable(Atlas.incidence(graph), Atlas.term("incidence"), joints)}</div>
<h2>${Atlas.term("parent", "Parents and children")}</h2><div id="relatives" class="relatives"></div>
<h2>Save</h2><div id="files" class="files"></div>`;
    listen();
    showChoice();
    if (able) slide(sliders);
    if (wrong) $("sliders").prepend(wrong);
    relatives(row);
    evaluations(row);
    return `${row.label} · chain`;
  };
})();
