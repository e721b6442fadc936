// The canonical key of the chain of a drawing, by the labelling kernel of the library.
"use strict";

(function () {
  /** Bytes of the key: links, kind, upper triangle column by column, three bits for each joint if one has mobility 2. */
  function bytesOf(links, joints) {
    const sorted = [...joints].sort((p, q) => p[0] - q[0] || p[1] - q[1]), size = (links * (links - 1)) / 2;
    const coloured = sorted.some(([, , mobility]) => mobility !== 1);
    const stream = new Uint8Array(Math.ceil((size + (coloured ? 3 * sorted.length : 0)) / 8));
    const set = bit => { stream[bit >> 3] |= 128 >> (bit & 7); };
    sorted.forEach(([a, b, mobility], k) => {
      set((b * (b - 1)) / 2 + a);
      if (coloured) for (let n = 0; n < 3; n++) if ((mobility - 1) & (4 >> n)) set(size + 3 * k + n);
    });
    return Uint8Array.from([links, 3 + (coloured ? 16 : 0), ...stream]);
  }

  /** Key of the chain of a mechanism in the form of files, with the kernel of the module "labels". */
  Bench.chainKey = (labels, data) => {
    const links = data.pose.length, loose = joint => (joint.kind === "R" || joint.kind === "P" ? 1 : 2);
    const joints = data.joints.map(joint => [Math.min(joint.a, joint.b), Math.max(joint.a, joint.b), loose(joint)]);
    joints.sort((p, q) => p[0] - q[0] || p[1] - q[1]);
    const packed = Uint8Array.from(joints.flat());
    const [order] = labels.call("structure.kernels.canon_packed", links, packed, new BigInt64Array(links));
    const place = new Array(links);
    Array.from(order.data, Number).forEach((link, position) => { place[link] = position; });
    const moved = joints.map(([a, b, mobility]) => [Math.min(place[a], place[b]), Math.max(place[a], place[b]), mobility]);
    const text = btoa(String.fromCharCode(...bytesOf(links, moved)));
    return `1${text.replace(/\+/g, "-").replace(/\//g, "_").replace(/=+$/, "")}`;
  };

  const keyOf = Bench.keyOf = (app, { links, joints }) =>
    Bench.chainKey(app.labels, { pose: Array(links).fill(0), joints: joints.map(([a, b]) => ({ kind: "R", a, b })) });

  /** The chain of a mechanism in the form of files: links and joints that make one, all of mobility 1; null for others. */
  Bench.chainOf = ({ pose, joints }) => {
    const own = joints.map(({ a, b }) => [Math.min(a, b), Math.max(a, b)]), links = pose.length;
    const lower = joints.every(joint => joint.kind === "R" || joint.kind === "P"), degree = link => own.filter(pair => pair.includes(link)).length;
    return lower && links > 3 && own.every(([a, b]) => a !== b) && Array.from({ length: links }, (_, k) => degree(k)).every(count => count > 1) ? { links, joints: own } : null;
  };

  /** Chains with a dyad less and with a dyad more, each once: {smaller, larger}. */
  Bench.relatives = (app, { links, joints }) => {
    const once = all => [...new Map(all.map(own => [keyOf(app, own), own])).values()], smaller = [], larger = [];
    const ends = link => joints.filter(pair => pair.includes(link));
    for (const [a, b] of links > 5 ? joints : []) {
      if (ends(a).length !== 2 || ends(b).length !== 2) continue;
      const [p, q] = [a, b].map(link => ends(link).find(pair => pair[0] !== a || pair[1] !== b).find(other => other !== link));
      const number = new Map([...Array(links).keys()].filter(link => link !== a && link !== b).map((link, k) => [link, k]));
      const own = joints.filter(pair => !pair.includes(a) && !pair.includes(b)).map(pair => pair.map(link => number.get(link)));
      const left = { pose: Array(links - 2), joints: own.map(([u, v]) => ({ kind: "R", a: u, b: v })) };
      if (p !== q && Bench.chainOf(left)) smaller.push(Bench.chainOf(left));
    }
    for (let p = 0; p < links; p++) {
      for (let q = 0; q < p; q++) larger.push({ links: links + 2, joints: [...joints, [q, links], [links, links + 1], [p, links + 1]] });
    }
    return { smaller: once(smaller), larger: once(larger) };
  };

  /** Links and joints of a key; null if it is none of a planar chain with lower pairs. */
  Bench.fromKey = (app, key) => {
    try {
      const bytes = Uint8Array.from(atob(key.slice(1).replace(/-/g, "+").replace(/_/g, "/")), c => c.charCodeAt(0)), [links, kind] = bytes, joints = [];
      if (key[0] !== "1" || kind !== 3 || links < 3 || links > 32) return null;
      for (let b = 1, bit = 0; b < links; b++) for (let a = 0; a < b; a++, bit++) if (bytes[2 + (bit >> 3)] & (128 >> (bit & 7))) joints.push([a, b]);
      return keyOf(app, { links, joints }) === key ? { links, joints } : null;
    } catch { return null; }
  };
})();
