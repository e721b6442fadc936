// Files that a chain can be saved as.
"use strict";

(function () {
  const lines = list => list.join("\n") + "\n";
  const rows = table => table.map(row => row.join(" "));
  const head = graph => [`# links ${graph.links}`, ...(graph.frame === null ? [] : [`# frame ${graph.frame}`]), `# space ${graph.space}`];

  function graphml(graph) {
    const data = (key, value) => `<data key="${key}">${value}</data>`;
    return lines([
      '<?xml version="1.0" encoding="UTF-8"?>', '<graphml xmlns="http://graphml.graphdrawing.org/xmlns">',
      ' <key id="frame" for="graph" attr.name="frame" attr.type="int"/>', ' <key id="space" for="graph" attr.name="space" attr.type="int"/>',
      ' <key id="mobility" for="edge" attr.name="mobility" attr.type="int"/>', ' <graph id="G0" edgedefault="undirected">',
      `  ${data("space", graph.space)}`, ...(graph.frame === null ? [] : [`  ${data("frame", graph.frame)}`]),
      ...[...Array(graph.links).keys()].map(link => `  <node id="${link}"/>`),
      ...graph.joints.map(([a, b, m]) => `  <edge source="${a}" target="${b}">${data("mobility", m)}</edge>`), " </graph>", "</graphml>",
    ]);
  }

  function dot(graph) {
    return lines([
      "graph G0 {", "  node [shape=circle];", `  space=${graph.space};`, ...(graph.frame === null ? [] : [`  frame=${graph.frame};`]),
      ...[...Array(graph.links).keys()].map(link => `  ${link}${link === graph.frame ? " [shape=doublecircle]" : ""};`),
      ...graph.joints.map(([a, b, m]) => `  ${a} -- ${b} [mobility=${m}];`), "}",
    ]);
  }

  /**
   * [file name, what it is, media type, text] for each file; `pictures` are SVG texts by name.  All but the pictures are
   * read by graphsynth.formats.
   */
  Atlas.filesOf = function (graph, row, pictures) {
    const name = row.label + (graph.frame === null ? "" : `-frame${graph.frame}`), {links, space, frame, joints} = graph;
    return [
      [`${row.label}.g6`, "graph6", "text/plain", Atlas.toGraph6(graph) + "\n"],
      [`${name}.graphml`, "GraphML", "application/xml", graphml(graph)],
      [`${name}.json`, "JSON", "application/json", lines([JSON.stringify({format: "graphsynth graph", version: 1, links, space, frame, joints})])],
      [`${name}.dot`, "DOT", "text/plain", dot(graph)],
      [`${name}.edges`, "joints", "text/plain", lines([...head(graph), ...rows(joints.map(([a, b, m]) => (m === 1 ? [a, b] : [a, b, m])))])],
      [`${name}.adj`, "adjacency matrix", "text/plain", lines([...head(graph), ...rows(Atlas.matrix(graph))])],
      [`${name}.inc`, "incidence matrix", "text/plain", lines([...head(graph), ...rows(Atlas.incidence(graph))])],
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
