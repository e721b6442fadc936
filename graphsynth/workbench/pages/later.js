// What only some readers want is loaded when it is asked for: data and modules of kernels, as scripts.
"use strict";

(function () {
  const waiting = new Map();

  /** The scripts of these names are there; a page in one file holds them all. */
  Bench.need = (...names) => Promise.all(names.map(name => {
    if (Bench.whole) return null;
    if (!waiting.has(name)) {
      waiting.set(name, new Promise((yes, no) => {
        const script = Bench.make("script", { src: `${name}.js`, on: { load: yes, error: () => { waiting.delete(name); no(new Bench.Fault("fault.later", { name })); } } });
        document.head.append(script);
      }));
    }
    return waiting.get(name);
  }));

  /** A job of the worker, with what it needs; what goes wrong is said, and null is handed back. */
  Bench.job = async (app, names, name, args, tell) => {
    try {
      await Bench.need(...names);
      return await app.work.run(name, args, tell);
    } catch (error) {
      if (error.message !== "stopped") app.fault(error instanceof Bench.Fault ? error : new Bench.Fault("fault.job", { error: String(error.message).slice(0, 80) }));
      return null;
    }
  };
})();
