// Mechanism graphs: links 0..n-1, joints [a, b, mobility] with a < b, a frame or none; text forms and matrices.
"use strict";
var Atlas = globalThis.Atlas || {};
globalThis.Atlas = Atlas;

Atlas.LINKS_MAX = 64;

Atlas.Fault = class extends Error {};

/**
 * A graph from pairs or triples; throws a Fault with one sentence for anything that is no mechanism graph.  `names`
 * are what the sentence calls the links.
 */
Atlas.graph = function (links, joints, frame = null, space = 3, names = null) {
  const name = link => (names ? names[link] : link);
  if (!Number.isInteger(links) || links < 1 || links > Atlas.LINKS_MAX)
    throw new Atlas.Fault(`${links} links: a graph here has 1 to ${Atlas.LINKS_MAX}.`);
  const seen = new Set(), found = [];
  for (const [p, q, mobility = 1] of joints) {
    for (const link of [p, q])
      if (!Number.isInteger(link) || link < 0 || link >= links)
        throw new Atlas.Fault(`Link ${link} does not exist: the links are 0 to ${links - 1}.`);
    const a = Math.min(p, q), b = Math.max(p, q);
    if (a === b) throw new Atlas.Fault(`Link ${name(a)} cannot be jointed to itself.`);
    if (seen.has(a * links + b)) throw new Atlas.Fault(`Links ${name(a)} and ${name(b)} are joined twice: two joints make them one link.`);
    if (!Number.isInteger(mobility) || mobility < 1 || mobility >= space)
      throw new Atlas.Fault(`Joint ${name(a)}-${name(b)} has mobility ${mobility}; between 1 and ${space - 1} is possible.`);
    seen.add(a * links + b);
    found.push([a, b, mobility]);
  }
  if (frame !== null && !(Number.isInteger(frame) && frame >= 0 && frame < links))
    throw new Atlas.Fault(`Frame ${frame} does not exist: the links are 0 to ${links - 1}.`);
  found.sort((x, y) => x[0] - y[0] || x[1] - y[1]);
  return {links, joints: found, frame, space};
};

Atlas.neighbours = function (graph) {
  const near = Array.from({length: graph.links}, () => []);
  for (const [a, b] of graph.joints) { near[a].push(b); near[b].push(a); }
  return near.map(list => list.sort((x, y) => x - y));
};

Atlas.mobility = graph =>
  graph.space * (graph.links - 1) - graph.joints.reduce((sum, joint) => sum + graph.space - joint[2], 0);

/** Links by distance from a link; links that cannot be reached are in none. */
Atlas.levels = function (graph, frame = graph.frame) {
  const near = Atlas.neighbours(graph), seen = new Set([frame]), levels = [[frame]];
  for (;;) {
    const next = [];
    for (const link of levels[levels.length - 1])
      for (const other of near[link]) if (!seen.has(other)) { seen.add(other); next.push(other); }
    if (!next.length) return levels;
    levels.push(next.sort((x, y) => x - y));
  }
};

Atlas.isConnected = graph => Atlas.levels(graph, 0).flat().length === graph.links;

/** A link without which the rest is not connected, or null. */
Atlas.cutLink = function (graph) {
  const near = Atlas.neighbours(graph);
  for (let cut = 0; graph.links > 2 && cut < graph.links; cut++) {
    const seen = new Set([cut, cut ? 0 : 1]), waiting = [cut ? 0 : 1];
    while (waiting.length) for (const next of near[waiting.pop()]) if (!seen.has(next)) { seen.add(next); waiting.push(next); }
    if (seen.size < graph.links) return cut;
  }
  return null;
};

/** Numbers of links with 2, 3, ... joints, as the labels write them: "4-4". */
Atlas.assortment = function (graph) {
  const degrees = Atlas.neighbours(graph).map(list => list.length), most = Math.max(2, ...degrees);
  return Array.from({length: most - 1}, (_, k) => degrees.filter(d => d === k + 2).length).join("-");
};

Atlas.relabelled = (graph, to) => Atlas.graph(
  graph.links, graph.joints.map(([a, b, m]) => [to[a], to[b], m]),
  graph.frame === null ? null : to[graph.frame], graph.space);

/**
 * A part of the links among which the joints leave no motion or worse, or null: sets are tried by brute force, so
 * graphs of more than 20 links are not judged (undefined).  Such a part makes a chain no chain of its mobility.
 */
Atlas.rigidPart = function (graph) {
  if (graph.links > 20) return undefined;
  const n = graph.links;
  for (let set = 1; set < 1 << n; set++) {
    let size = 0, fixed = 0;
    for (let v = 0; v < n; v++) size += set >> v & 1;
    if (size < 3 || size === n) continue;
    for (const [a, b, m] of graph.joints) if (set >> a & 1 && set >> b & 1) fixed += graph.space - m;
    if (graph.space * (size - 1) - fixed < 1) return [...Array(n).keys()].filter(v => set >> v & 1);
  }
  return null;
};

// --- graph6 (B. D. McKay), at most 64 links

Atlas.toGraph6 = function (graph) {
  const n = graph.links, head = n < 63 ? [n + 63] : [126, 63, (n >> 6) + 63, (n & 63) + 63];
  const body = new Array(Math.ceil(n * (n - 1) / 12)).fill(0);
  for (const [a, b] of graph.joints) {
    const bit = b * (b - 1) / 2 + a;
    body[Math.floor(bit / 6)] |= 32 >> bit % 6;
  }
  return String.fromCharCode(...head, ...body.map(x => x + 63));
};

Atlas.fromGraph6 = function (text) {
  const codes = [...text].map(c => c.charCodeAt(0) - 63);
  if (!codes.length || codes.some(c => c < 0 || c > 63)) throw new Atlas.Fault("This is not graph6: a character is out of its range.");
  let n = codes.shift();
  if (n === 63) {
    if (codes.length < 3 || codes[0] === 63) throw new Atlas.Fault(`A graph here has at most ${Atlas.LINKS_MAX} links.`);
    n = codes[0] << 12 | codes[1] << 6 | codes[2];
    codes.splice(0, 3);
  }
  if (n < 1 || n > Atlas.LINKS_MAX) throw new Atlas.Fault(`${n} links: a graph here has 1 to ${Atlas.LINKS_MAX}.`);
  const bits = n * (n - 1) / 2, joints = [];
  if (codes.length !== Math.ceil(bits / 6)) throw new Atlas.Fault(`graph6 of ${n} links has ${Math.ceil(bits / 6)} characters after the first, not ${codes.length}.`);
  let bit = 0;
  for (let b = 1; b < n; b++)
    for (let a = 0; a < b; a++, bit++) if (codes[Math.floor(bit / 6)] & 32 >> bit % 6) joints.push([a, b]);
  for (; bit < 6 * codes.length; bit++)
    if (codes[Math.floor(bit / 6)] & 32 >> bit % 6) throw new Atlas.Fault("This is not graph6: bits after the end.");
  return Atlas.graph(n, joints);
};

// --- canonical keys, version 1: see docs/explanation/mechanism-graph.md

Atlas.DIGITS = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";

Atlas.fromBase64 = function (text) {
  const bytes = [];
  let held = 0, bits = 0;
  for (const letter of text) {
    const digit = Atlas.DIGITS.indexOf(letter);
    if (digit < 0) throw new Atlas.Fault("A key is base64url text.");
    held = (held << 6 | digit) & 0xffff;
    bits += 6;
    if (bits >= 8) { bits -= 8; bytes.push(held >> bits & 255); }
  }
  return bytes;
};

Atlas.decodeKey = function (text) {
  if (text[0] !== Labelling.VERSION) throw new Atlas.Fault(`A key of this version starts with ${Labelling.VERSION}.`);
  const data = Atlas.fromBase64(text.slice(1));
  if (data.length < 2 || Labelling.base64(data) !== text.slice(1)) throw new Atlas.Fault("This is not a whole key.");
  const [links, flags] = data, space = flags & 7, size = links * (links - 1) / 2;
  if (links < 1 || links > Atlas.LINKS_MAX || space < 2 || space > 6 || flags >> 5) throw new Atlas.Fault("The first bytes of this key describe no graph.");
  const bit = place => data[2 + (place >> 3)] >> 7 - (place & 7) & 1;
  const joints = [];
  const whole = flags >> 4 & 1;
  if (2 + Math.ceil(size / 8) > data.length) throw new Atlas.Fault("This key is too short for its number of links.");
  for (let b = 1, place = 0; b < links; b++) for (let a = 0; a < b; a++, place++) if (bit(place)) joints.push([a, b, 1]);
  joints.sort((x, y) => x[0] - y[0] || x[1] - y[1]);
  const total = size + (whole ? 3 * joints.length : 0);
  if (data.length - 2 !== Math.ceil(total / 8)) throw new Atlas.Fault("This key has not the length of its graph.");
  for (let place = total; place < 8 * (data.length - 2); place++) if (bit(place)) throw new Atlas.Fault("This key has bits after its end.");
  if (whole) joints.forEach((joint, k) => {
    joint[2] = 1 + (bit(size + 3 * k) << 2 | bit(size + 3 * k + 1) << 1 | bit(size + 3 * k + 2));
  });
  return Atlas.graph(links, joints, flags >> 3 & 1 ? 0 : null, space);
};

// --- prismatic joints: places in the list of joints, written 0-3,1-2

/** Joints at these places; `to` are other numbers of the links. */
Atlas.pairs = (graph, chosen, to = null) => chosen.map(k => graph.joints[k].slice(0, 2).map(link => (to ? to[link] : link)).join("-")).join(",");

/** The part of an address that asks for sliders; frame: null or undefined for none. */
Atlas.slidersAsked = ({frame = null, sliders}) => `?${frame === null ? "" : `frame=${frame}&`}sliders=${sliders}`;

/** Places of the joints of a text; `names` are what it calls the links.  A Fault for what is no joint. */
Atlas.chosen = function (graph, text, names = null) {
  const own = text.split(",").map(pair => {
    const ends = /^\d+-\d+$/.test(pair) ? pair.split("-").map(name => (names ? names.indexOf(+name) : +name)) : [];
    const k = graph.joints.findIndex(joint => ends[0] !== ends[1] && ends.includes(joint[0]) && ends.includes(joint[1]));
    if (k < 0) throw new Atlas.Fault(`${pair.slice(0, 20)} is to slide, but is no joint: prismatic joints are written P:0-3,1-2.`);
    return k;
  });
  return [...new Set(own)].sort((x, y) => x - y);
};

/** Adjacency matrix; an entry is the mobility of the joint. */
Atlas.matrix = function (graph) {
  const rows = Array.from({length: graph.links}, () => new Array(graph.links).fill(0));
  for (const [a, b, m] of graph.joints) rows[a][b] = rows[b][a] = m;
  return rows;
};

Atlas.incidence = graph =>
  Array.from({length: graph.links}, (_, v) => graph.joints.map(([a, b]) => +(a === v || b === v)));
