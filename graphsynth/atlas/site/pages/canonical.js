// The canonical form of a mechanism graph, by the labelling kernel of the library.
"use strict";

(function () {
  let labels = null;

  /** Wait for the kernel, without which no graph has a key. */
  Atlas.ready = async () => { labels = await Kernels.load("labels"); };

  /** {to: canonical place of each link, order (BigInt), orbits, key, canonical}. */
  Atlas.label = function (graph) {
    const colours = new Array(graph.links).fill(0);
    if (graph.frame !== null) {
      const levels = Atlas.levels(graph);
      colours.fill(levels.length);
      levels.forEach((level, k) => level.forEach(link => { colours[link] = k; }));
    }
    const {to, order, orbits} = Labelling.found(labels, graph.links, graph.joints, colours), canonical = Atlas.relabelled(graph, to);
    return {to, canonical, key: Labelling.key(graph.links, canonical.joints, graph.space | (graph.frame !== null ? 8 : 0)), order, orbits};
  };
})();
