// What people paste: a key, a label, graph6 (with the frame, mobilities and space of the one-line form), JSON, an
// adjacency matrix, or a list of joints.  Each reader returns {form, graph} or throws a Fault with one sentence.  Behind P:
// stand prismatic joints, and a key of a chain with such begins with 1p.; they come as {sliders}.
"use strict";

(function () {
  const LONGEST = Atlas.LONGEST = 20000;

  Atlas.read = function (text) {
    const sliding = text.length <= LONGEST && /(^|\s)P:(\S*)/.exec(text);
    if (sliding) {
      const {sliders, ...plain} = Atlas.read(text.replace(sliding[0], " "));
      if (!plain.graph) throw new Atlas.Fault("Beside a label no joints are named: give the key.");
      return {...plain, sliders: Atlas.chosen(plain.graph, sliding[2], plain.names)};
    }
    const {held, ...found} = readPlain(text);
    // files of graphsynth say the frame in a remark: "# frame 2"
    if (held === undefined || !found.graph) return found;
    const {links, joints, space} = found.graph, own = found.names ? found.names.indexOf(held) : held;
    return {...found, graph: Atlas.graph(links, joints, own, space, found.names)};
  };

  function readPlain(text) {
    text = text.trim();
    if (!text) throw new Atlas.Fault("Nothing is pasted yet.");
    if (text.length > LONGEST) throw new Atlas.Fault(`${text.length} characters: at most ${LONGEST} are read.`);
    if (/^\d+\.\d+\.[\d-]+\.\d+$/.test(text)) return {form: "label", label: text};
    if (/^1[A-Za-z0-9_-]{3,}$/.test(text)) {
      try { return {form: "key", graph: Atlas.decodeKey(text)}; } catch (fault) { if (!/^[\d-]+$/.test(text)) throw fault; }
    }
    if (/^1p\.[A-Za-z0-9_-]+$/.test(text)) {
      const {joints, ...own} = Atlas.decodeKey(`1${text.slice(3)}`);
      return {form: "key", graph: {...own, joints: joints.map(([a, b]) => [a, b, 1])}, sliders: [...joints.keys()].filter(k => joints[k][2] > 1)};
    }
    if (/^\s*\{/.test(text)) return {form: "JSON", graph: fromJson(text)};
    const frame = /^#\s*frame\s+(\d+)/m.exec(text);
    if (/^#/m.test(text)) return {...readPlain(text.replace(/^#.*$/gm, "")), ...(frame && {held: +frame[1]})};
    if (/[^\d\s,;:.()[\]{}<>|-]/.test(text)) return {form: "graph6", graph: fromText(text)};
    const rows = matrixRows(text);
    if (rows) return {form: "adjacency matrix", graph: fromMatrix(rows)};
    return {form: "list of joints", ...fromList(text)};
  }

  function fromJson(text) {
    let found;
    try { found = JSON.parse(text); } catch { throw new Atlas.Fault("This begins like JSON but is not whole."); }
    if (!Number.isInteger(found.links) || !Array.isArray(found.joints) || !found.joints.every(Array.isArray))
      throw new Atlas.Fault('JSON of a graph has "links": a number, and "joints": a list of pairs.');
    return Atlas.graph(found.links, found.joints, found.frame ?? null, found.space ?? 3);
  }

  // the one-line form of graphsynth: graph6, f (frame), mobility:joints, pi (space); "Bw f0 2:1-2"
  function fromText(text) {
    const [head, ...fields] = text.replace(/^>>graph6<</, "").split(/\s+/);
    const plain = Atlas.fromGraph6(head);
    let frame = null, space = 3;
    for (const field of fields) {
      const own = /^(?:f(\d+)|pi(\d)|(\d):(\d+-\d+(?:,\d+-\d+)*))$/.exec(field);
      if (!own) throw new Atlas.Fault(`After graph6 come f0 (the frame), 2:1-2 (joints of mobility 2) or pi3 (the space), not ${field}.`);
      if (own[1]) frame = +own[1];
      else if (own[2]) space = +own[2];
      else for (const pair of own[4].split(",")) {
        const [a, b] = pair.split("-").map(Number).sort((x, y) => x - y);
        const joint = plain.joints.find(one => one[0] === a && one[1] === b);
        if (!joint) throw new Atlas.Fault(`${pair} is given a mobility, but is no joint.`);
        joint[2] = +own[3];
      }
    }
    return Atlas.graph(plain.links, plain.joints, frame, space);
  }

  let last = ["", null];
  /** Of a text with prismatic joints: {key, frame, sliders: "0-3"} in the numbers of the key's chain; null for any other text. */
  Atlas.withSliders = function (text) {
    if (!/^\s*1p\.|\sP:/.test(text)) return null;
    if (last[0] !== text) {
      last = [text, null];
      try {
        const {graph, sliders} = Atlas.read(text), {to, key, canonical} = Atlas.label({...graph, frame: null});
        const own = Atlas.pairs(graph, sliders, to);
        last[1] = {key, frame: graph.frame === null ? null : to[graph.frame], sliders: Atlas.pairs(canonical, Atlas.chosen(canonical, own))};
      } catch (fault) { if (!(fault instanceof Atlas.Fault)) throw fault; }
    }
    return last[1];
  };

  /** Rows of numbers if the text is square like a matrix; null otherwise. */
  function matrixRows(text) {
    const lines = text.split(/[\n;]|\]\s*,/).map(line => line.replace(/[[\](){}|]/g, " ").trim()).filter(line => line);
    let rows = lines.map(line => line.split(/[\s,]+/).filter(part => part));
    if (lines.length > 1 && rows.every(row => row.length === 1 && row[0].length === lines.length)) rows = rows.map(row => [...row[0]]);
    if (rows.length < 2 || rows.some(row => row.length !== rows.length || row.some(part => !/^\d$/.test(part)))) return null;
    return rows.map(row => row.map(Number));
  }

  function fromMatrix(rows) {
    const joints = [];
    rows.forEach((row, a) => row.forEach((value, b) => {
      if (value !== rows[b][a]) throw new Atlas.Fault(`The matrix is not symmetric: row ${a + 1}, column ${b + 1} is ${value}, and the other way round ${rows[b][a]}.`);
      if (value && a === b) throw new Atlas.Fault(`Row ${a + 1} of the matrix joins link ${a} to itself.`);
      if (value && a < b) joints.push([a, b, value]);
    }));
    return Atlas.graph(rows.length, joints);
  }

  /** Pairs of link numbers; numbering may start anywhere and have gaps. */
  function fromList(text) {
    const numbers = (text.match(/\d+/g) || []).map(Number);
    if (!numbers.length) throw new Atlas.Fault("There is no number in this: a joint is written 0-1.");
    if (numbers.length % 2) throw new Atlas.Fault(`${numbers.length} numbers make no pairs of links: a joint is written 0-1.`);
    const names = [...new Set(numbers)].sort((x, y) => x - y), place = new Map(names.map((name, k) => [name, k]));
    const joints = [];
    for (let k = 0; k < numbers.length; k += 2) joints.push([place.get(numbers[k]), place.get(numbers[k + 1])]);
    return {graph: Atlas.graph(names.length, joints, null, 3, names), names};
  }

  /** Why a graph is not in the atlas, or what it is: one sentence. */
  Atlas.judge = function (graph, names) {
    const name = link => (names ? names[link] : link);
    if (graph.space !== 3) return "It is a graph of another space than the plane; the atlas holds planar chains.";
    if (graph.joints.some(joint => joint[2] !== 1)) return "It has joints of mobility 2; the atlas holds chains of revolute and prismatic joints (mobility 1).";
    if (!Atlas.isConnected(graph)) return "It is not connected: it is several chains, not one.";
    const near = Atlas.neighbours(graph), loose = near.findIndex(list => list.length < 2);
    if (loose >= 0) return `Link ${name(loose)} has ${near[loose].length === 1 ? "only one joint" : "no joint"}: links of a closed chain have two or more.`;
    const mobility = Atlas.mobility(graph);
    if (mobility < 1) return `Its mobility is ${mobility}: it is a structure, not a chain that moves.`;
    const rigid = Atlas.rigidPart(graph);
    if (rigid) return `Links ${rigid.map(name).join(", ")} cannot move against each other: they are one link, and the chain a smaller one.`;
    return null;
  };
})();
