// Browsing: questions, orders, and a list that holds only what is seen.
"use strict";

(function () {
  const $ = id => document.getElementById(id), {html} = Atlas;
  const PLATE = {wide: 148, tall: 176, sketch: [132, 106]}, LINE = {tall: 56, sketch: [56, 46]};
  const shown = new Map();
  let question = {}, found = [], columns = 1, ready = false;

  const option = (value, words, chosen) => html`<option value="${value}"${chosen ? " selected" : ""}>${words}</option>`;
  const select = (name, words, options, term) =>
    html`<label>${term ? Atlas.term(term, words) : words}<select name="${name}" aria-label="${words}">${options}</select></label>`;

  function build() {
    const families = Atlas.contents.families, mobilities = [...new Set(families.map(f => f.mobility))];
    const sizes = [...new Map(families.map(f => [f.links, 0]))].map(([links]) => [links, families.filter(f => f.links === links).reduce((s, f) => s + f.chains, 0)]);
    const any = option("", "any");
    $("question").innerHTML = html`${[
      html`<label class="wide">Search<input type="search" name="text" placeholder="name, use, label, key …" autocomplete="off" spellcheck="false"></label>`,
      mobilities.length > 1 && select("mobility", "mobility", [any, ...mobilities.map(w => option(w, w))], "mobility"),
      html`<fieldset><legend>Links</legend>${sizes.map(([n, count]) =>
        html`<label class="chip"><input type="checkbox" name="links" value="${n}"><span>${n} <small>${Atlas.count(count)}</small></span></label>`)}</fieldset>`,
      select("assortment", "assortment", any, "assortment"),
      select("planar", "planar", [any, option("yes", "planar"), option("no", "not planar")], "planar"),
      select("symmetry", "symmetry", [any, option("some", "symmetric"), option("none", "none")], "symmetry"),
      select("girth", "shortest loop", [any, ...[3, 4, 5, 6, 7, 8].filter(g => Atlas.rows.some(row => row.girth === g)).map(g => option(g, `${g} links`))], "girth"),
      select("low", "class within reach", [any, ...[2, 3, 4, 5].map(c => option(c, c === 2 ? "II" : `up to ${Atlas.roman(c)}`))], "class"),
      Atlas.rows.some(row => row.fractionated) && select("fractionated", "fractionated", [any, option("no", "no"), option("yes", "yes")], "fractionated"),
      html`<label class="check"><input type="checkbox" name="named" value="yes"> with a name</label>`,
      select("sort", "sort by", Object.entries(Atlas.ORDERS).map(([name, [words]]) => option(name, words))),
      html`<label class="check"><input type="checkbox" name="down" value="yes"> from the end</label>
<fieldset><legend>Show as</legend><label class="chip"><input type="radio" name="view" value="plates" checked><span>plates</span></label>
<label class="chip"><input type="radio" name="view" value="lines"><span>lines</span></label></fieldset>
<input type="hidden" name="contracted"><button type="reset">Clear</button>`,
    ]}`;
    $("question").addEventListener("input", changed);
    $("question").addEventListener("submit", event => event.preventDefault());
    $("question").addEventListener("reset", () => setTimeout(changed));
    $("list").addEventListener("keydown", move);
    $("list").addEventListener("focusin", event => keepSeen(event.target.closest("li")));
    addEventListener("scroll", later, {passive: true});
    addEventListener("resize", () => { if (!$("browse").hidden) { clear(); lay(); } });
    if (innerWidth < 760) $("filters").open = false;
    ready = true;
  }

  /** Go to the search. */
  Atlas.search = () => {
    $("filters").open = true;
    $("question").text.focus();
  };

  function asked() {
    const own = {};
    for (const [name, value] of new FormData($("question")))
      if (value && !(name === "sort" && value === "number") && !(name === "view" && value === "plates"))
        own[name] = own[name] ? `${own[name]},${value}` : value;
    return own;
  }

  function fill(parameters) {
    const form = $("question");
    for (const input of form.elements) {
      const value = parameters.get(input.name);
      if (input.type === "checkbox") input.checked = (value || "").split(",").includes(input.value);
      else if (input.type === "radio") input.checked = input.value === (value || "plates");
      else if (input.name === "assortment") listAssortments(parameters.get("links"), value);
      else if (input.name === "sort") input.value = Atlas.ORDERS[value] ? value : "number";
      else if (input.name) input.value = value || "";
    }
  }

  function listAssortments(links, chosen) {
    const sizes = new Set((links || "").split(",").filter(Boolean).map(Number)), counts = new Map();
    for (const row of Atlas.rows)
      if (!sizes.size || sizes.has(row.links)) counts.set(row.assortment, (counts.get(row.assortment) || 0) + 1);
    $("question").assortment.innerHTML = html`${option("", "any")}${[...counts].map(([name, count]) => option(name, `${name}  (${Atlas.count(count)})`, name === chosen))}`;
  }

  async function changed(event) {
    const now = asked();
    if (now.links !== question.links) {
      for (const family of Atlas.contents.families)
        if ((now.links || "").split(",").includes(String(family.links))) await Atlas.loadFamily(family.name);
      listAssortments(now.links, now.assortment);
      Object.assign(now, {assortment: $("question").assortment.value});
      if (!now.assortment) delete now.assortment;
    }
    const words = new URLSearchParams(now).toString();
    history.replaceState(null, "", words ? `#/?${words}` : "#/");
    show(now, event && event.type);
  }

  function show(now) {
    question = now;
    const start = performance.now();
    found = Atlas.choose(question);
    clear();
    lay();
    Atlas.lastChoice = performance.now() - start;
    const all = Atlas.rows.length;
    $("count").textContent = found.length === all ? `${Atlas.count(all)} chains` : `${Atlas.count(found.length)} of ${Atlas.count(all)} chains`;
    const rest = Atlas.contents.families.filter(family => !Atlas.families.get(family.name).rows);
    $("chosen").innerHTML = html`${!found.length && html`Nothing fits. Clear takes every choice back; <a href="#/find">Find my mechanism</a> reads drawings, matrices and lists of joints. `}${rest.length > 0 && `Chosen by their number of links, and loaded then: ${rest.map(f => `${Atlas.count(f.chains)} chains with ${f.links} links`).join(", ")}. `}${question.contracted
      && html`with the contracted graph ${Atlas.contents.contracted[question.contracted] || "?"} <button type="button" id="anyshape">any</button>`}`;
    if (question.contracted) $("anyshape").addEventListener("click", () => { $("question").contracted.value = ""; changed(); });
  }

  // --- the list

  function clear() {
    for (const item of shown.values()) item.remove();
    shown.clear();
  }

  const lines = () => question.view === "lines";
  const tall = () => (lines() ? LINE.tall : PLATE.tall);

  function lay() {
    const list = $("list"), wide = list.clientWidth;
    columns = lines() ? 1 : Math.max(2, Math.floor(wide / PLATE.wide));
    list.classList.toggle("lines", lines());
    list.style.height = `${Math.ceil(found.length / columns) * tall()}px`;
    draw();
  }

  let planned = false;
  function later() {
    if (planned || $("browse").hidden) return;
    planned = true;
    requestAnimationFrame(() => { planned = false; draw(); });
  }

  function draw() {
    const top = -$("list").getBoundingClientRect().top, ahead = 2 * tall();
    const first = Math.max(0, Math.floor((top - ahead) / tall())) * columns;
    const last = Math.min(found.length, Math.ceil((top + innerHeight + ahead) / tall()) * columns);
    for (const [k, item] of shown) if (k < first || k >= last) { item.remove(); shown.delete(k); }
    for (let k = first; k < last; k++) if (!shown.has(k)) put(k);
  }

  function put(k) {
    const row = found[k], item = document.createElement("li"), size = lines() ? LINE.sketch : PLATE.sketch;
    const share = 100 / columns;
    item.dataset.k = k;
    item.style.cssText = `top:${Math.floor(k / columns) * tall()}px;left:${k % columns * share}%;width:${share}%;height:${tall()}px`;
    item.setAttribute("aria-posinset", k + 1);
    item.setAttribute("aria-setsize", found.length);
    const marks = [row.symmetry > 1 ? `symmetry ${row.symmetry}` : "", row.planar ? "" : "not planar"].filter(Boolean).join(", ");
    item.innerHTML = html`<a href="#/${row.key}${Atlas.searched(question.text || "", row)}"><span class="thumb" style="width:${size[0]}px;height:${size[1]}px"></span><span
 class="words"><b>${row.label}</b> <small class="key">${row.key}</small><small>${row.inversions} inversion${row.inversions > 1 ? "s" : ""}</small><small>${marks}</small><small
 class="more">shortest loop ${row.girth}</small><small class="more">class ${Atlas.classes(row)}</small></span></a>`;
    shown.set(k, item);
    // in the order of the list, for the tab key
    const next = [...$("list").children].find(other => +other.dataset.k > k);
    $("list").insertBefore(item, next || null);
    const thumb = item.querySelector(".thumb");
    const paint = places => { if (places && thumb.isConnected) thumb.innerHTML = Atlas.drawn(Atlas.sketch(Atlas.decodeKey(row.key), places, {width: size[0], height: size[1], small: true})); };
    const known = Atlas.placesOf(row);
    if (known) paint(known); else Atlas.loadPlaces(row).then(paint);
  }

  function keepSeen(item) {
    if (!item) return;
    const box = item.getBoundingClientRect(), head = document.querySelector(".top").offsetHeight;
    if (box.top < head) scrollBy(0, box.top - head - 4);
    else if (box.bottom > innerHeight) scrollBy(0, box.bottom - innerHeight + 4);
  }

  function move(event) {
    const item = event.target.closest("li");
    const step = {ArrowRight: 1, ArrowLeft: -1, ArrowDown: columns, ArrowUp: -columns, Home: -Infinity, End: Infinity}[event.key];
    if (!item || !step || event.ctrlKey || event.altKey || event.metaKey) return;
    event.preventDefault();
    const k = +item.dataset.k, next = Math.abs(step) === Infinity ? (step < 0 ? 0 : found.length - 1) : k + step;
    if (next < 0 || next >= found.length) return;
    if (!shown.has(next)) {
      scrollTo(0, $("list").getBoundingClientRect().top + scrollY + Math.floor(next / columns) * tall() - innerHeight / 2);
      draw();
    }
    shown.get(next).querySelector("a").focus({preventScroll: true});
    keepSeen(shown.get(next));
  }

  Atlas.browse = async function (parameters) {
    if (!ready) build();
    const links = (parameters.get("links") || "").split(",");
    for (const family of Atlas.contents.families) if (links.includes(String(family.links))) await Atlas.loadFamily(family.name);
    fill(parameters);
    const now = asked();
    // back from a chain: the list is as it was left
    const same = JSON.stringify(now) === JSON.stringify(question) && found.length > 0;
    if (same) lay(); else show(now);
    return same;
  };
})();
