"use strict";
/* Canonical keys of graphs, version 1 (docs/explanation/mechanism-graph.md): the order is the labelling kernel's, here is
   how it is called and how a key is written.  The workbench and the atlas have them from here.

     Labelling.found(await Kernels.load("labels"), links, joints, colours)    -> {to, order, orbits}
     Labelling.moved(joints, to)                                              -> joints in new numbers, in order
     Labelling.key(links, joints, flags)                                      -> the key, of joints in canonical numbers

   Joints are [a, b, mobility] with a < b, in order; `to`: canonical place of each link.  Flags: freedoms of a free link,
   and 8 if there is a frame. */

const Labelling = (() => {
  const VERSION = "1", COLOURED = 16;
  const sorted = joints => joints.sort((p, q) => p[0] - q[0] || p[1] - q[1]);

  function found(labels, links, joints, colours) {
    const answer = labels.call("structure.kernels.canon_packed", links, Uint8Array.from(joints.flat()), BigInt64Array.from(colours, BigInt));
    const [vertices, , index, orbits] = answer.map(array => Array.from(array.data, Number)), to = new Array(links);
    vertices.forEach((link, place) => { to[link] = place; });
    return { to, order: index.reduce((product, size) => product * BigInt(size), 1n), orbits };
  }

  const moved = (joints, to) => sorted(joints.map(([a, b, mobility]) => [Math.min(to[a], to[b]), Math.max(to[a], to[b]), mobility]));

  /* Text of bytes in the letters of addresses. */
  const base64 = bytes => btoa(String.fromCharCode(...bytes)).replace(/\+/g, "-").replace(/\//g, "_").replace(/=+$/, "");

  /* Links, flags, upper triangle column by column, three bits for each joint if one has mobility 2. */
  function key(links, joints, flags) {
    const size = (links * (links - 1)) / 2, coloured = joints.some(joint => joint[2] !== 1);
    const stream = new Uint8Array(Math.ceil((size + (coloured ? 3 * joints.length : 0)) / 8)), put = bit => { stream[bit >> 3] |= 128 >> (bit & 7); };
    joints.forEach(([a, b, mobility], k) => {
      put((b * (b - 1)) / 2 + a);
      if (coloured) for (let n = 0; n < 3; n++) if ((mobility - 1) & (4 >> n)) put(size + 3 * k + n);
    });
    return VERSION + base64([links, flags | (coloured ? COLOURED : 0), ...stream]);
  }

  return { VERSION, sorted, found, moved, base64, key };
})();

if (typeof module !== "undefined") module.exports = Labelling;
