// Files that a chain can be saved as.
"use strict";

(function () {
  const table = rows => rows.map(row => row.join(",")).join("\n") + "\n";

  function graphml(graph, name) {
    const node = link => `    <node id="${link}"/>\n`;
    const edge = ([a, b, m]) => `    <edge source="${a}" target="${b}"><data key="m">${m}</data></edge>\n`;
    return `<?xml version="1.0" encoding="utf-8"?>
<graphml xmlns="http://graphml.graphdrawing.org/xmlns">
  <key id="m" for="edge" attr.name="mobility" attr.type="long"/>
  <key id="s" for="graph" attr.name="space" attr.type="long"/>
  <key id="f" for="graph" attr.name="frame" attr.type="long"/>
  <graph id="${name}" edgedefault="undirected">
    <data key="s">${graph.space}</data>
${graph.frame === null ? "" : `    <data key="f">${graph.frame}</data>\n`}${[...Array(graph.links).keys()].map(node).join("")}${graph.joints.map(edge).join("")}  </graph>
</graphml>
`;
  }

  function dot(graph, name) {
    const frame = graph.frame === null ? "" : `  ${graph.frame} [style=filled, fillcolor=gray80];\n`;
    return `graph "${name}" {\n  node [shape=circle];\n${frame}${graph.joints.map(([a, b]) => `  ${a} -- ${b};\n`).join("")}}\n`;
  }

  /** [file name, what it is, media type, text] for each file; `pictures` are SVG texts by name. */
  Atlas.filesOf = function (graph, row, pictures) {
    const name = row.label, json = {links: graph.links, joints: graph.joints, frame: graph.frame, space: graph.space, key: row.key, label: row.label};
    const chain = {...graph, frame: null};
    return [
      [`${name}.g6`, "graph6", "text/plain", Atlas.toGraph6(graph) + "\n"],
      [`${name}.graphml`, "GraphML", "application/xml", graphml(graph, name)],
      [`${name}.json`, "JSON", "application/json", JSON.stringify(json) + "\n"],
      [`${name}.dot`, "DOT", "text/plain", dot(graph, name)],
      [`${name}-joints.csv`, "joints, CSV", "text/csv", table([["a", "b", "mobility"], ...graph.joints])],
      [`${name}-adjacency.csv`, "adjacency matrix, CSV", "text/csv", table(Atlas.matrix(chain))],
      [`${name}-incidence.csv`, "incidence matrix, CSV", "text/csv", table(Atlas.incidence(chain))],
      ...Object.entries(pictures).map(([what, text]) => [`${name}-${what}.svg`, `${what}, SVG`, "image/svg+xml", text]),
    ];
  };

  Atlas.save = function (name, type, text) {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([text], {type}));
    link.download = name;
    document.body.append(link);
    link.click();
    link.remove();
    setTimeout(() => URL.revokeObjectURL(link.href), 10000);
  };
})();
