// Mechanisms moved by the page's engine: jobs as JSON from a file, results as JSON to another.
"use strict";
const fs = require("fs");
const [, , pages, modules, jobs, results] = process.argv;
const Kernels = require(`${pages}/kernels.js`);
const Engine = require(`${pages}/engine.js`);

async function main() {
  const table = JSON.parse(fs.readFileSync(`${modules}/motion.json`, "utf8"));
  const motion = await Kernels.open("motion", fs.readFileSync(`${modules}/motion.wasm`), table);
  const found = JSON.parse(fs.readFileSync(jobs, "utf8")).map((job) => {
    const engine = Engine.open(motion, job.drawn);
    const known = { fault: engine.fault, mobility: engine.mobility, groups: engine.groups, ready: engine.ready, Lc: engine.Lc };
    const done = job.calls.map(([name, ...args]) => {
      const begin = process.hrtime.bigint();
      const result = typeof engine[name] === "function" ? engine[name](...args) : engine[name];
      const seconds = Number(process.hrtime.bigint() - begin) / 1e9;
      return { result, seconds, pose: Array.from(engine.pose), inputs: Array.from(engine.inputs) };
    });
    engine.close();
    return { known, done };
  });
  const plain = (key, value) => (ArrayBuffer.isView(value) ? Array.from(value, (x) => (Number.isFinite(x) ? x : null)) : value);
  fs.writeFileSync(results, JSON.stringify(found, plain));
}

main().catch((error) => { console.error(error); process.exit(1); });
