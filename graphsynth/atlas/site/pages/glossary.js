// Definitions that open in place: <button class="term" data-term="...">.
"use strict";

(function () {
  Atlas.TERMS = {
    mobility: ["mobility", "Freedoms left when one link is held: W = 3(n − 1) − 2p for n links and p revolute or prismatic joints in the plane. With W = 1 one driver moves everything."],
    link: ["link", "A rigid body of the mechanism. Binary, ternary, quaternary: with 2, 3, 4 joints."],
    joint: ["joint", "Two links in lasting contact. Here of mobility 1: a revolute joint (one link turns in the other) or, in its place, a prismatic joint (it slides)."],
    slider: ["prismatic joint", "Also slider: one link slides in the other along a line and does not turn in it. It has mobility 1, so the chain, its groups and its mobility are the same."],
    loop: ["loops", "Independent closed circuits of links and joints: p − n + 1."],
    assortment: ["assortment", "The numbers of links with 2, 3, 4, … joints, written 4-4 for four binary and four ternary links."],
    label: ["label", "mobility.links.assortment.rank: the rank counts the chains of one assortment in the order of their keys. It belongs to the complete catalogue and is permanent."],
    key: ["key", "A short text that two chains share exactly when they are the same up to numbering. It is no hash: the chain can be read from it."],
    symmetry: ["symmetry", "The number of renumberings that leave the chain as it is (order of its automorphism group). 1: no two links play the same part."],
    orbit: ["orbit", "Links that a symmetry carries into one another; to fix any of them gives the same mechanism."],
    inversion: ["inversion", "The chain with one link held as frame. Links of one orbit give the same inversion."],
    planar: ["planar", "The chain can be drawn without crossing links."],
    girth: ["shortest loop", "The number of links in the shortest closed circuit."],
    fractionated: ["fractionated", "It falls apart into smaller chains where one link or joint is cut."],
    contracted: ["contracted graph", "What is left when each path through binary links becomes one edge: links with three and more joints, a × m for m parallel paths. Chains with one contracted graph differ in where the binary links sit."],
    levels: ["adjacency levels", "The frame is level 0, links jointed to it are level 1, links jointed to those level 2, and so on."],
    group: ["structural group", "Also Assur group: a smallest set of links that a given position of its outer joints places, and no part of it alone. A mechanism is its drivers and then one group after another."],
    class: ["class", "Of a group: the most joints on one closed contour of it (2 for a dyad, two links and three joints). Of a mechanism: its highest. Class II is solved with a square root; higher classes need polynomial systems."],
    order: ["order", "Of a group: the number of outer joints by which it hangs on what is placed before it."],
    modes: ["assembly modes", "The ways in which it can be put together with given dimensions and drivers: so many at most, as many with complex coordinates."],
    driver: ["driver", "The link whose motion is given, here one jointed to the frame."],
    parent: ["parents and children", "A parent is left when a dyad, two jointed binary links, is taken out; putting one in between two links gives a child."],
    adjacency: ["adjacency matrix", "Row and column for each link; 1 where the two are jointed."],
    incidence: ["incidence matrix", "A row for each link, a column for each joint; 1 where the joint is on the link."],
    transmission: ["transmission angle", "Here the smallest angle over the turn at which a dyad is pushed; near 0 it jams."],
    graph6: ["graph6", "One line of text for a graph, read by many programs (B. D. McKay)."],
  };

  Atlas.term = (name, shown = Atlas.TERMS[name][0]) =>
    Atlas.html`<button type="button" class="term" data-term="${name}" aria-expanded="false">${shown}</button>`;

  let open = null;
  function close(focus) {
    if (!open) return;
    open.note.remove();
    open.button.setAttribute("aria-expanded", "false");
    open.button.removeAttribute("aria-describedby");
    if (focus) open.button.focus();
    open = null;
  }
  function show(button) {
    const note = document.createElement("div"), [name, words] = Atlas.TERMS[button.dataset.term];
    note.className = "definition";
    note.id = "definition";
    note.setAttribute("role", "note");
    note.innerHTML = Atlas.html`<strong>${name}</strong> ${words}`;
    document.body.append(note);
    const at = button.getBoundingClientRect(), wide = document.documentElement.clientWidth;
    note.style.left = `${Math.max(8, Math.min(at.left, wide - note.offsetWidth - 8)) + scrollX}px`;
    note.style.top = `${at.bottom + 6 + scrollY}px`;
    button.setAttribute("aria-expanded", "true");
    button.setAttribute("aria-describedby", "definition");
    open = {note, button};
  }

  Atlas.startGlossary = function () {
    document.addEventListener("click", event => {
      const button = event.target.closest(".term"), same = open && open.button === button;
      if (event.target.closest(".definition")) return;
      close(false);
      if (button && !same) show(button);
    });
    document.addEventListener("keydown", event => { if (event.key === "Escape") close(true); });
    addEventListener("hashchange", () => close(false));
    addEventListener("resize", () => close(false));
  };
})();
