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

  /** Key of the chain of a mechanism in the form of files, with the kernels of the module "chains". */
  Bench.chainKey = (chains, data) => {
    const links = data.pose.length, loose = joint => (joint.kind === "R" || joint.kind === "P" ? 1 : 2);
    const joints = data.joints.map(joint => [Math.min(joint.a, joint.b), Math.max(joint.a, joint.b), loose(joint)]);
    joints.sort((p, q) => p[0] - q[0] || p[1] - q[1]);
    const packed = Uint8Array.from(joints.flat());
    const [order] = chains.call("structure.kernels.canon_packed", links, packed, new BigInt64Array(links));
    const place = new Array(links);
    Array.from(order.data, Number).forEach((link, position) => { place[link] = position; });
    const moved = joints.map(([a, b, mobility]) => [Math.min(place[a], place[b]), Math.max(place[a], place[b]), mobility]);
    const text = btoa(String.fromCharCode(...bytesOf(links, moved)));
    return `1${text.replace(/\+/g, "-").replace(/\//g, "_").replace(/=+$/, "")}`;
  };
})();
