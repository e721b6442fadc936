"use strict";
/* Long work, away from the page: jobs by name, run in a worker that is made of the page's own scripts; where no worker can
   be had, in the page.  A job that is no longer wanted is stopped with its worker.

     const work = Work.start(source);  await work.run("count", [14, 1], told => ...);  work.stop()

   `source` is the text of the scripts of the mathematics, as a function that returns their names. */

const Work = (() => {
  const jobs = {
    /* Number of chains, as text. */
    async count([links, mobility], tell) {
      const module = await Kernels.load("chains");
      return String(await Chains.count(module, links, mobility, share => tell(share)));
    },
    /* A part of the list: keys are told by their joints, places by the sketch. */
    async list([links, mobility, from, count]) {
      const module = await Kernels.load("chains"), sketch = await Kernels.load("sketch"), found = [];
      let k = 0;
      for await (const packed of Chains.list(module, links, mobility)) {
        if (k++ < from) continue;
        const joints = [];
        for (let at = 0; at < packed.length; at += 3) joints.push([packed[at], packed[at + 1]]);
        found.push({ links, joints, ...Layout.places(sketch, links, joints) });
        if (found.length === count) break;
      }
      return found;
    },
    /* Sketches of chains. */
    async places(chains) {
      const sketch = await Kernels.load("sketch");
      return chains.map(({ links, joints }) => Layout.places(sketch, links, joints));
    },
    async turn([links, joints, more]) {
      const motion = await Kernels.load("motion"), sketch = await Kernels.load("sketch");
      return Turning.found(motion, links, joints, more.places || Layout.places(sketch, links, joints).places, more);
    },
    /* Mechanisms for a curve. */
    async target([curve, closed], tell) {
      return Curves.found(await Kernels.load("motion"), curve, tell, closed);
    },
    /* Four-bars through poses. */
    async passing([poses, turns], tell) {
      return Passing.found(await Kernels.load("design"), await Kernels.load("motion"), poses, turns, tell);
    },
    /* One branch over a range of the driver, proved. */
    async prove([data, asked], tell) {
      return Proving.found(await Kernels.load("motion"), await Kernels.load("proof"), data, asked, tell);
    },
    /* Where a tilted axis binds, proved. */
    async binds([data, asked], tell) {
      return Proving.binds(await Kernels.load("motion"), await Kernels.load("proof"), await Kernels.load("binding"), data, asked, tell);
    },
  };

  const run = (name, args, tell = () => true) => jobs[name](args, tell);

  /* In the worker: what it is asked, one after another. */
  function serve(port) {
    port.onmessage = async ({ data: { id, name, args, scripts } }) => {
      if (scripts) { for (const [kind, ...rest] of scripts) ({ chains: Chains, curves: Curves, kernels: Kernels })[kind].register(...rest); return; }
      try { port.postMessage({ id, found: await run(name, args, told => { port.postMessage({ id, told }); return true; }) }); } catch (error) {
        port.postMessage({ id, error: String(error && error.message || error) });
      }
    };
  }

  /* A worker of the text, or the page itself. */
  function start(source) {
    let worker = null, waiting = new Map(), count = 0, handed = new Set();
    const fail = error => { for (const { no } of waiting.values()) no(new Error(error)); waiting = new Map(); };
    const open = () => {
      if (worker || typeof Worker === "undefined") return worker;
      const url = URL.createObjectURL(new Blob([`"use strict";(${source})().Work.serve(self);`], { type: "text/javascript" }));
      try { worker = new Worker(url); } catch { worker = null; }
      handed = new Set();
      if (worker) {
        worker.onmessage = ({ data: { id, found, told, error } }) => {
          const own = waiting.get(id);
          if (!own) return;
          if (told !== undefined) { own.tell(told); return; }
          waiting.delete(id);
          if (error !== undefined) own.no(new Error(error)); else own.yes(found);
        };
        worker.onerror = event => { event.preventDefault(); worker = null; fail(event.message); };
      }
      return worker;
    };
    return {
      get busy() { return waiting.size > 0; },
      run(name, args, tell = () => {}) {
        if (!open()) return run(name, args, told => { tell(told); return new Promise(go => setTimeout(() => go(true))); });
        const named = ([kind, name]) => (kind === "kernels" ? `kernels ${name}` : kind);
        const fresh = [...Kernels.scripts(), ...Chains.scripts(), ...Curves.scripts()].filter(one => !handed.has(named(one)));
        if (fresh.length) worker.postMessage({ scripts: fresh });
        for (const one of fresh) handed.add(named(one));
        return new Promise((yes, no) => { waiting.set(++count, { yes, no, tell }); worker.postMessage({ id: count, name, args }); });
      },
      /* Stop what is running; who waits for it hears of it. */
      stop() { if (worker) worker.terminate(); worker = null; fail("stopped"); },
    };
  }

  return { jobs, run, serve, start };
})();

if (typeof module !== "undefined") module.exports = Work;
