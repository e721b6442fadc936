"use strict";
/* Counts and lists planar chains, with the kernels of the library and what it has told of every family. */

const Chains = (() => {
  const BLOCK = 512, ROWS = 1024, NO_ROOM = -2, FRAME_NONE = 1, MOST_STATES = 1 << 22;
  let told = null, text = "";
  let work = null, states = 1 << 18;

  /* What the data's script calls. */
  function register(packed) {
    text = packed;
  }

  async function open() {
    if (told === null) {
      const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
      const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
      told = JSON.parse(await new Response(stream).text());
    }
    return told;
  }

  /* Kinds of chains that can be counted: [[links, mobility], ...]. */
  async function kinds() {
    return Object.keys((await open()).plans).map((key) => key.split(",").map(Number));
  }

  function plan(links, mobility) {
    const found = told.plans[`${links},${mobility}`];
    if (found === undefined) throw new RangeError(`no plan for ${links} links of mobility ${mobility}`);
    return found;
  }

  /* Multiplicity matrices of the contracted graphs of a family, in the module's memory. */
  function graphs(module, { loops, vertices: k }) {
    const [count, digits] = told.graphs[`${loops},${k}`];
    const array = module.array("u1", [count, k, k]), data = array.data;
    let pair = 0;
    for (let a = 0; a < k; a++) {
      for (let b = a + 1; b < k; b++, pair++) {
        for (let g = 0; g < count; g++) {
          data[(g * k + a) * k + b] = data[(g * k + b) * k + a] = digits.charCodeAt(pair * count + g) - 48;
        }
      }
    }
    return array;
  }

  function arrays(module, parts) {
    return Object.fromEntries(Object.entries(parts).map(([name, part]) => {
      if (!Array.isArray(part)) return [name, part];
      const [type, shape, items] = part, array = module.array(type, shape);
      array.data.set(type === "i8" || type === "u8" ? items.map(BigInt) : items);
      return [name, array];
    }));
  }

  function release(module, parts) {
    module.free(...Object.values(parts).filter((part) => typeof part === "object"));
  }

  /* Twenty megabytes in the module's memory, made once; with room for more states where they were too few. */
  function workspace(module, wanted) {
    if (work !== null && work.module === module && wanted <= states) return work.parts;
    if (work !== null) release(work.module, work.parts);
    states = wanted;
    const shapes = { ...told.work, keys: ["u8", [2 * states]], states: ["i8", [3, states]] };
    work = { module, parts: Object.fromEntries(Object.entries(shapes).map(([name, [type, shape]]) => [name, module.array(type, shape)])) };
    return work.parts;
  }

  /* Number of chains, exact; `step` is told the share that is done and may stop it by returning false. */
  async function count(module, links, mobility, step = () => true) {
    await open();
    const { rings, families } = plan(links, mobility);
    let total = BigInt(rings.length), done = 0;
    const all = families.reduce((sum, family) => sum + told.graphs[`${family.loops},${family.vertices}`][0], 0);
    const none = module.array("i8", [0, 5]);
    for (const family of families) {
      const mults = graphs(module, family), tables = arrays(module, family.tables);
      const out = module.array("i8", [BLOCK]), graphsCount = mults.shape[0];
      try {
        for (let at = 0; at < graphsCount;) {
          const stop = Math.min(at + BLOCK, graphsCount);
          const outcome = module.call("synthesis.kernels.counting.count_block", family.vertices, mults, at, stop, FRAME_NONE, 0,
            tables, workspace(module, states), out, none);
          if (outcome === NO_ROOM && states < MOST_STATES) {
            workspace(module, 4 * states);
            continue;
          }
          if (outcome < 0) throw new RangeError(`family ${family.loops},${family.vertices}: one graph carries too many chains`);
          for (let k = 0; k < stop - at; k++) total += out.data[k];
          done += stop - at;
          at = stop;
          if ((await step(all ? done / all : 1)) === false) return null;
        }
      } finally {
        release(module, tables);
        module.free(mults, out);
      }
    }
    module.free(none);
    return total;
  }

  /* The chains one after another, each as an array of its joints (link, link, mobility, link, ...), in the library's order. */
  async function* list(module, links, mobility) {
    await open();
    const { rings, families } = plan(links, mobility);
    for (const ring of rings) yield Uint8Array.from(ring);
    for (const family of families) {
      const mults = graphs(module, family), tables = arrays(module, family.tables), expansion = arrays(module, family.expansion);
      const rows = module.array("i4", [ROWS, told.header + family.loops + family.vertices]);
      const packed = module.array("u1", [ROWS, 3 * family.joints]);
      try {
        module.call("synthesis.kernels.listing.rewind", 0, 0, 1, workspace(module, states));
        for (let found = ROWS; found === ROWS;) {
          const room = workspace(module, states);
          found = module.call("synthesis.kernels.listing.list_rows", family.vertices, mults, mults.shape[0], FRAME_NONE, 0, 0, tables, room, rows);
          if (found < 0) throw new RangeError(`family ${family.loops},${family.vertices}: one graph has too many symmetries`);
          const kept = module.call("synthesis.kernels.expanding.expand_packed", family.vertices, links, mults, rows, found, expansion, packed);
          const size = 3 * family.joints, block = packed.data.slice(0, kept * size);
          for (let k = 0; k < kept; k++) yield block.subarray(k * size, (k + 1) * size);
        }
      } finally {
        release(module, tables);
        release(module, expansion);
        module.free(mults, rows, packed);
      }
    }
  }

  /* What a worker has to be told. */
  const scripts = () => (text ? [["chains", text]] : []);

  return { register, scripts, kinds, count, list };
})();

if (typeof module !== "undefined") module.exports = Chains;
