// "Find my mechanism": pasted or drawn, to its entry.
"use strict";

(function () {
  const $ = id => document.getElementById(id), {html} = Atlas;
  let built = false, asked = 0;

  function build() {
    $("find").innerHTML = html`<h1 tabindex="-1">Find my mechanism</h1>
<p class="lead">Paste it or draw it; the numbering does not matter.</p>
<div class="answer" id="answer" aria-live="polite"><p class="soft">What is found appears here.</p></div>
<div class="columns"><section><h2>Paste</h2>
<label for="pasted">Adjacency ${Atlas.term("adjacency", "matrix")}, list of joints, ${Atlas.term("graph6")}, ${Atlas.term("key")} or ${Atlas.term("label")}</label>
<textarea id="pasted" rows="9" spellcheck="false" autocomplete="off" placeholder="0-1, 1-2, 2-3, 0-3"></textarea>
<p class="soft">Examples: <button type="button" data-example="0 1 0 1 0 0&#10;1 0 1 0 0 0&#10;0 1 0 1 0 1&#10;1 0 1 0 1 0&#10;0 0 0 1 0 1&#10;0 0 1 0 1 0">matrix</button>
<button type="button" data-example="1-2, 2-3, 3-4, 4-1, 4-5, 5-6, 6-1">joints</button> <button type="button" data-example="G@Q?~C">graph6</button> <button type="button" data-example="0-1, 1-2, 2-3, 0-3 P:0-3">sliders</button></p></section>
<section><h2>Draw</h2><div id="editor"></div></section></div>`;
    $("pasted").addEventListener("input", () => fromText());
    $("pasted").addEventListener("paste", event => { // the browser would lay millions of characters out first
      const text = event.clipboardData.getData("text");
      if (text.length > Atlas.LONGEST) { event.preventDefault(); say(`${text.length} characters: at most ${Atlas.LONGEST} are read.`); }
    });
    $("find").addEventListener("click", event => {
      const example = event.target.dataset.example;
      if (example) { $("pasted").value = example; fromText(); }
    });
    built = true;
    new Atlas.Editor($("editor"), found => {
      if (found.graph) tell(found.graph, `Drawn. ${found.words}`).catch(excuse);
      else if (found.words) say(found.words);
    });
  }

  const say = words => { asked++; $("answer").innerHTML = html`<p>${words}</p>`; };

  async function fromText() {
    const text = $("pasted").value;
    if (!text.trim()) { say("Nothing is pasted yet."); return; }
    try {
      const read = Atlas.read(text);
      if (read.label) {
        const row = await Atlas.find(read.label);
        if (row) tell(Atlas.decodeKey(row.key), "Read as a label.", null); else say(`No chain here has the label ${read.label}.`);
      } else await tell(read.graph, `Read as ${read.form}.`, read.names, read.sliders);
    } catch (fault) { excuse(fault); }
  }

  function excuse(fault) {
    if (!(fault instanceof Atlas.Fault)) throw fault;
    say(fault.message);
  }

  /** Links of the reader and of the entry side by side. */
  function numbering(graph, to, names) {
    const own = [...Array(graph.links).keys()];
    const same = own.every(link => to[link] === (names ? names[link] : link));
    if (same) return "";
    return html`<div class="scroll"><table class="matrix"><tbody><tr><th scope="row">your link</th>${own.map(link => html`<td>${names ? names[link] : link}</td>`)}</tr>
<tr><th scope="row">here</th>${own.map(link => html`<td>${to[link]}</td>`)}</tr></tbody></table></div>`;
  }

  async function tell(graph, how, names, sliders = []) {
    const mine = ++asked;
    const head = `${how} ${graph.links} links, ${graph.joints.length} joints${graph.frame === null ? "" : `, frame ${names ? names[graph.frame] : graph.frame}`}.`;
    const fault = Atlas.judge(graph, names);
    const label = Atlas.label({...graph, frame: null}), row = await Atlas.find(label.key);
    if (mine !== asked) return;
    if (!row) {
      const mobility = Atlas.mobility(graph), held = Atlas.familiesOf(mobility, graph.links).length;
      const cut = Atlas.cutLink(graph), apart = cut === null ? "This family of the catalogue is not complete."
        : `It is fractionated: it falls apart at link ${names ? names[cut] : cut}, and this family lists no such chains.`;
      const why = fault || (held ? apart
        : `This atlas does not reach chains of mobility ${mobility} with ${graph.links} links.`);
      $("answer").innerHTML = html`<p>${head} <strong>Not in this atlas.</strong> ${why}</p><p>${Atlas.term("key")} <code>${label.key}</code></p>`;
      return;
    }
    const sliding = Atlas.pairs(graph, sliders, label.to);
    const words = [graph.frame !== null && `frame=${label.to[graph.frame]}`, sliding && `sliders=${sliding}`].filter(Boolean).join("&");
    const address = `#/${row.key}${words && `?${words}`}`;
    $("answer").innerHTML = html`<div class="hit"><a class="thumb" href="${address}" tabindex="-1" aria-hidden="true" style="width:132px;height:106px"></a><div><p>${head}</p>
<p>It is <a class="found" href="${address}"><b>${row.label}</b></a>, ${Atlas.term("key")} <code>${row.key}</code>${sliding && `, joints ${sliding} prismatic`}.</p>${numbering(graph, label.to, names)}</div></div>`;
    const [places, able] = await Promise.all([Atlas.loadPlaces(row), sliding && Atlas.loadSliders()]), box = $("answer").querySelector(".thumb");
    if (mine === asked && places && box) box.innerHTML = Atlas.drawn(Atlas.sketch(label.canonical, places, {width: 132, height: 106, small: true, sliders: able ? Atlas.chosen(label.canonical, sliding) : []}));
  }

  Atlas.openFind = function () { if (!built) build(); return "Find my mechanism"; };
})();
