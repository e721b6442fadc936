// What the atlas holds, how one knows that nothing is missing, and all definitions.
"use strict";

Atlas.about = function () {
  const place = document.getElementById("about"), {families} = Atlas.contents, {html} = Atlas;
  const rows = families.map(f => html`<tr><td>${f.mobility}</td><td><a href="#/?links=${f.links}">${f.links}</a></td><td>${f.joints}</td><td>${Atlas.count(f.chains)}</td>
<td>${f.expected === null ? "not counted" : Atlas.count(f.expected)}</td></tr>`);
  place.innerHTML = html`<h1 tabindex="-1">About this atlas</h1>
<p>Every planar kinematic chain of the kinds below, once each, made by graphsynth. A chain is a network of rigid links and joints; hold one link and it is a mechanism.</p>
<div class="scroll"><table class="counts"><thead><tr><th>mobility</th><th>links</th><th>joints</th><th>chains listed</th><th>counted</th></tr></thead><tbody>${rows}</tbody></table></div>
<p>The chains are listed by one method and counted by another that makes no list; both numbers stand in the table. Every chain moves on the workbench, with any frame and drivers that move it: with dimensions of the catalogue, or found there from the sketch by shortening the driven links until they turn. Its joints may be prismatic: of chains with at most eight links all choices of one to three such joints are listed on their pages.</p>
<p>Labels and keys are permanent, so a chain can be cited by them. The address of this page with a key at the end, as in <code>#/1BAN4</code>, is the home of a chain.</p>
<p>Keyboard: <kbd>/</kbd> goes to the search, arrows move between plates, <kbd>Esc</kbd> closes a definition.</p>
<h2>Definitions</h2><dl class="glossary">${Object.values(Atlas.TERMS).map(([name, words]) => html`<div><dt>${name}</dt><dd>${words}</dd></div>`)}</dl>`;
  return "About";
};
