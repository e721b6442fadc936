// Prismatic joints of a chain: choices, and frames that turn with them; loaded with the list when a chain is opened.
"use strict";

(function () {
  const {html} = Atlas;
  let known = null;

  Atlas.takeSliders = data => { known = data; };

  /** Choices of a chain up to symmetry, each as places in the list of joints; null where none are listed. */
  Atlas.slidersOf = function (row) {
    const own = known?.choices[row.family]?.[row.place];
    return own ? own.map(bits => [...Array(row.joints).keys()].filter(k => bits >> k & 1)) : null;
  };

  /** Key of a chain with prismatic joints: that of the graph with these as joints of mobility 2. */
  Atlas.sliderKey = ({links, joints}, chosen) =>
    `1p.${Atlas.label(Atlas.graph(links, joints.map(([a, b], k) => [a, b, chosen.includes(k) ? 2 : 1]))).key.slice(1)}`;

  /**
   * A frame and drivers that turn with these sliders, those given if they do, frames on which something slides before others; of
   * one frame if there is no choice.  Short links with revolute joints only turn when they are driven; one that guides another
   * turns it round with it.
   */
  Atlas.turning = function (graph, given, sliders, driverSets, one = false) {
    const slides = link => sliders.filter(k => graph.joints[k].slice(0, 2).includes(link)).length;
    const turns = ({frame, drivers}) => frame !== null && !drivers.some(slides) && Boolean(Atlas.groups({...graph, frame}, drivers));
    if (!sliders.length || turns(given)) return given;
    const frames = one ? [given.frame] : [...Array(graph.links).keys()].sort((p, q) => slides(q) - slides(p));
    return frames.flatMap(frame => driverSets(graph, frame).map(drivers => ({frame, drivers}))).find(turns) || given;
  };

  /** Why a choice is in no list: one clause. */
  function why(graph, chosen) {
    if (graph.links > known.links || chosen.length > known.sliders) return "it is beyond this list";
    const only = Atlas.neighbours(graph).findIndex((near, link) => graph.joints.every((pair, k) => !pair.includes(link) || chosen.includes(k)));
    return only < 0 ? "a loop has fewer than two revolute joints" : `link ${only} has prismatic joints only`;
  }

  const many = (count, what) => `${count} ${what}${count > 1 ? "s" : ""}`;

  /** The section of a chain's page. */
  Atlas.sliderSection = function (row, graph, chosen) {
    const listed = Atlas.slidersOf(row), own = chosen.length ? Atlas.sliderKey(graph, chosen) : "";
    const held = listed && listed.findIndex(one => own && Atlas.sliderKey(graph, one) === own), pairs = one => Atlas.pairs(graph, one);
    const groups = [...Array(known.sliders).keys()].map(k => (listed || []).filter(one => one.length === k + 1)).filter(group => group.length);
    const button = one => html`<button type="button" class="pick" data-sliders="${pairs(one)}" aria-pressed="${held >= 0 && listed[held] === one}">${pairs(one)}</button> `;
    const choice = group => html`<details${group.length <= 24 || group.includes(listed[held]) ? " open" : ""}><summary>${many(group[0].length, "slider")}: ${many(group.length, "choice")}</summary><p>${group.map(button)}</p></details>`;
    const now = chosen.length > 0 && html`<p>Chosen: ${pairs(chosen)}, <code>${Atlas.toGraph6(graph)} P:${pairs(chosen)}</code>, ${Atlas.term("key")} <code>${own}</code>.
${!(held >= 0) && `Not listed: ${why(graph, chosen)}. `}<button type="button" class="pick" data-sliders="">revolute joints only</button></p>`;
    const rules = html`<p>Joints that may be ${Atlas.term("slider", "prismatic")}: all choices up to symmetry in which every link keeps a revolute joint and every loop two. Press one, and the sketch and the workbench show it.</p>`;
    const rest = !(listed && row.joints < 7) && html`<p class="soft">${listed ? `At most ${known.sliders} sliders are listed` : `Choices are listed for chains of at most ${known.links} links`}: <code>graphsynth enumerate --links ${row.links}${row.mobility > 1 && ` --mobility ${row.mobility}`} --sliders ${listed ? known.sliders + 1 : 1}</code> lists them.</p>`;
    return html`${groups.length > 0 && rules}${listed && !groups.length && html`<p>No joint may be prismatic: a link or a loop would have too few revolute ones, or the chain is fractionated.</p>`}${now}${groups.map(choice)}${rest}`;
  };
})();
