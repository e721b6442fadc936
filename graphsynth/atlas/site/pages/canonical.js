// The canonical form of a mechanism graph, by the labelling kernel of the library.
"use strict";

(function () {
  let labels = null;

  /** Wait for the kernel, without which no graph has a key. */
  Atlas.ready = async () => { labels = await Kernels.load("labels"); };

  /** {to: canonical place of each link, order (BigInt), orbits, key, canonical}. */
  Atlas.label = function (graph) {
    const colours = new Array(graph.links).fill(0), to = [];
    if (graph.frame !== null) {
      const levels = Atlas.levels(graph);
      colours.fill(levels.length);
      levels.forEach((level, k) => level.forEach(link => { colours[link] = k; }));
    }
    const found = labels.call("structure.kernels.canon_packed", graph.links, graph.joints.flat(), colours);
    const [vertices, , index, orbits] = found.map(array => Array.from(array.data, Number));
    vertices.forEach((link, place) => { to[link] = place; });
    const canonical = Atlas.relabelled(graph, to), order = index.reduce((product, size) => product * BigInt(size), 1n);
    return {to, canonical, key: Atlas.encodeKey(canonical), order, orbits};
  };
})();
