// The chain of a drawing or of an address: its canonical key, and its relatives.
"use strict";

(function () {
  function coloured(labels, data, loose) {
    const links = data.pose.length;
    const joints = Labelling.sorted(data.joints.map(joint => [Math.min(joint.a, joint.b), Math.max(joint.a, joint.b), loose(joint)]));
    const { to } = Labelling.found(labels, links, joints, new Array(links).fill(0));
    return Labelling.key(links, Labelling.moved(joints, to), 3);
  }

  /** Key of the chain of a mechanism in the form of files, with the kernel of the module "labels". */
  Bench.chainKey = (labels, data) => coloured(labels, data, ({ kind }) => (kind === "R" || kind === "P" ? 1 : 2));

  /** Key of a chain with lower pairs that tells which of them are prismatic. */
  Bench.sliderKey = (labels, data) => (data.joints.some(({ kind }) => kind === "P")
    ? `1p.${coloured(labels, data, ({ kind }) => (kind === "P" ? 2 : 1)).slice(1)}` : Bench.chainKey(labels, data));

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

  const numbers = text => (/^\d{1,2}(,\d{1,2})*$/.test(text) ? text.split(",").map(Number) : null);

  /** "#k=KEY&p=0-3&f=0&d=1": a chain, its prismatic joints, frame and driven links; a `Fault` for what it has not. */
  Bench.chainOfAddress = (app, address) => {
    const { k: key, ...asked } = Object.fromEntries(address.slice(1).split("&").map(part => part.split(/=(.*)/s).slice(0, 2)));
    const chain = Bench.fromKey(app, key || ""), more = {};
    if (!chain) throw new Bench.Fault("fault.key");
    const jointed = (a, b) => chain.joints.some(pair => pair.includes(a) && pair.includes(b) && a !== b);
    if (asked.p !== undefined) {
      const sliders = asked.p.split(",").map(pair => numbers(pair.replace("-", ",")) || []);
      const whole = sliders.every(pair => pair.length === 2 && jointed(...pair));
      if (!whole || new Set(sliders.map(pair => String(pair.sort((a, b) => a - b)))).size < sliders.length) throw new Bench.Fault("fault.key.sliders", { given: asked.p.slice(0, 40) });
      more.sliders = sliders;
    }
    if (asked.f !== undefined || asked.d !== undefined) {
      const [frame, ...rest] = numbers(asked.f || "") || [], drivers = asked.d === undefined ? null : numbers(asked.d) || [];
      const whole = frame < chain.links && !rest.length && (!drivers || (drivers.length > 0 && drivers.every(link => jointed(frame, link))));
      if (!whole) throw new Bench.Fault("fault.key.driver");
      Object.assign(more, { frame, drivers });
    }
    return [chain, more];
  };
})();
