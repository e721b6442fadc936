"use strict";
/* Makes the calls that a test asks for, one chunk after another, and sends what came out: in Node and in a browser. */

class Writer {
  constructor() { this.bytes = new Uint8Array(1 << 16); this.size = 0; }
  put(source) {
    if (this.size + source.length > this.bytes.length) {
      const larger = new Uint8Array(2 * (this.size + source.length));
      larger.set(this.bytes.subarray(0, this.size));
      this.bytes = larger;
    }
    this.bytes.set(source, this.size);
    this.size += source.length;
  }
  word(View, value) { this.put(new Uint8Array(View.of(value).buffer)); }
}

/* A result by its type, in a fixed order of bytes. */
function write(out, type, value) {
  if (type.kind === "tuple") type.items.forEach((item, k) => write(out, item, value[k]));
  else if (type.kind === "array") {
    for (const length of value.shape) out.word(BigInt64Array, BigInt(length));
    out.put(new Uint8Array(value.data.buffer));
  } else if (type.kind === "number") {
    if (type.letter === "d" || type.letter === "f") out.word(Float64Array, value);
    else if (type.letter === "D") value.forEach((part) => out.word(Float64Array, part));
    else out.word(BigInt64Array, BigInt.asIntN(64, BigInt(value)));
  }
}

const VIEWS = {
  b1: Uint8Array, i1: Int8Array, u1: Uint8Array, i2: Int16Array, u2: Uint16Array, i4: Int32Array, u4: Uint32Array,
  i8: BigInt64Array, u8: BigUint64Array, f4: Float32Array, f8: Float64Array, c16: Float64Array,
};
const WORDS = { c16: 2 };

/* The arguments of call `k`; arrays that change from call to call are views of the chunk. */
function arguments_of(tree, leaves, k) {
  return tree.map((part) => {
    if (Array.isArray(part)) return arguments_of(part, leaves, k);
    const leaf = leaves[part];
    if (leaf.kind === "array") {
      const each = leaf.length;
      return { data: leaf.data.subarray(k * each, (k + 1) * each), shape: leaf.shape };
    }
    if (leaf.kind === "float") return leaf.data[k];
    if (leaf.values) return BigInt(leaf.values[k]);
    return leaf.kind === "whole" ? BigInt(leaf.value) : leaf.value;
  });
}

/* Seconds that one call takes, in the quickest few milliseconds of many; arrays lie in the module's memory. */
function timed(module, head) {
  for (const leaf of head.leaves) {
    if (leaf.kind !== "array") continue;
    const kept = module.array(leaf.type, leaf.shape);
    kept.data.set(leaf.data);
    leaf.kept = kept;
  }
  const fill = (tree) => tree.map((part) => (Array.isArray(part) ? fill(part)
    : head.leaves[part].kept || arguments_of([part], head.leaves, 0)[0]));
  const args = fill(head.tree), start = performance.now();
  let best = Infinity, each = 1;
  while (performance.now() - start < 1000 * head.seconds) {
    const begin = performance.now();
    for (let k = 0; k < each; k++) module.call(head.kernel, ...args);
    const took = performance.now() - begin;
    if (took < 1.5) each *= 2;
    else best = Math.min(best, took / each);
  }
  return new Uint8Array(Float64Array.of(best / 1000).buffer);
}

/* The ordinary way in, through the loader: for single calls. */
function call(module, head, entry, out) {
  let result = null, kind = "";
  try {
    result = module.call(head.kernel, ...arguments_of(head.tree, head.leaves, 0));
  } catch (error) {
    if (!error.kind) throw error;
    kind = error.kind;
  }
  tell(out, entry, kind, result);
  for (const leaf of head.leaves) if (leaf.kind === "array") out.put(bytes_of(leaf.data));
}

const bytes_of = (data) => new Uint8Array(data.buffer, data.byteOffset, data.byteLength);

function tell(out, entry, kind, result) {
  const name = kind ? new TextEncoder().encode(kind) : [];
  out.put([name.length]);
  if (kind) out.put(name);
  else write(out, entry.result, result);
}

/* Many calls: the whole chunk lies in the module's memory, and from call to call only places and numbers change. */
function calls(module, head, entry, out) {
  for (const leaf of head.leaves) {
    if (leaf.kind !== "array") continue;
    leaf.kept = module.array(leaf.type, [head.count, ...leaf.shape]);
    leaf.kept.data.set(leaf.data);
    leaf.kept.shape = leaf.shape;
    leaf.each = leaf.data.byteLength / head.count;
  }
  const fill = (tree) => tree.map((part) => (Array.isArray(part) ? fill(part)
    : head.leaves[part].kept || arguments_of([part], head.leaves, 0)[0]));
  const slots = module.reserve(8 * (entry.slotsIn + entry.slotsOut + 2)), own = { at: slots, taken: [] }, changing = [];
  const put = (types, tree, args) => types.filter((type) => type.kind !== "omitted").forEach((type, k) => {
    if (type.kind === "tuple") {
      put(type.items, tree[k], args[k]);
      return;
    }
    const leaf = head.leaves[tree[k]];
    if (leaf.kind === "array" || leaf.kind === "float" || leaf.values) changing.push([own.at, leaf]);
    module.put(type, args[k], own, head.kernel);
  });
  put(entry.types, head.tree, fill(head.tree));
  const results = slots + 8 * (entry.slotsIn + 1), about = slots + 8 * entry.slotsIn;
  let view = new DataView(module.memory.buffer);
  for (let k = 0; k < head.count; k++) {
    if (view.buffer !== module.memory.buffer) view = new DataView(module.memory.buffer);
    for (const [at, leaf] of changing) {
      if (leaf.kept) view.setUint32(at + 32, leaf.kept.place + k * leaf.each, true);
      else if (leaf.values) view.setBigInt64(at, BigInt(leaf.values[k]), true);
      else view.setFloat64(at, leaf.data[k], true);
    }
    let result = null, kind = "";
    try {
      const code = entry.run(slots, results, about);
      if (code !== 0 && code !== -2) module.raise(head.kernel, code, about);
      result = module.get(entry.result, { at: results });
    } catch (error) {
      if (!error.kind) throw error;
      kind = error.kind;
    }
    tell(out, entry, kind, result);
  }
  module.exports.release(slots);
  for (const { kept } of head.leaves) {
    if (!kept) continue;
    out.put(bytes_of(kept.data));
    module.free(kept);
  }
}

function run(modules, head, buffer) {
  const module = modules[head.module], entries = module.kernels.get(head.kernel);
  for (const leaf of head.leaves) {
    if (leaf.kind !== "array" && leaf.kind !== "float") continue;
    const View = VIEWS[leaf.type];
    leaf.length = (leaf.shape || []).reduce((a, b) => a * b, 1) * (WORDS[leaf.type] || 1);
    leaf.data = new View(buffer, leaf.at, leaf.length * head.count);
  }
  if (head.seconds) return timed(module, head);
  const out = new Writer(), first = arguments_of(head.tree, head.leaves, 0);
  const entry = entries.length === 1 ? entries[0] : entries.find((one) => module.fits(one.types, first));
  (head.count === 1 ? call : calls)(module, head, entry, out);
  return out.bytes.slice(0, out.size);
}

/* Ends when it is told to, or nobody asks any more. */
async function serve(Kernels, address) {
  const modules = {};
  for (;;) {
    const answer = await fetch(`${address}/next`, { method: "POST" }).catch(() => null);
    if (answer === null) return;
    const all = await answer.arrayBuffer();
    const size = new DataView(all).getUint32(0, true);
    const head = JSON.parse(new TextDecoder().decode(new Uint8Array(all, 8, size)));
    if (head.end) return;
    if (head.wait) continue;
    let found;
    try {
      if (!(head.module in modules)) {
        const [code, table] = await Promise.all(["wasm", "json"].map((end) => fetch(`${address}/${head.module}.${end}`)));
        modules[head.module] = await Kernels.open(head.module, await code.arrayBuffer(), await table.json());
      }
      found = run(modules, head, all.slice(8 * Math.ceil((8 + size) / 8)));
    } catch (error) {
      await fetch(`${address}/failed`, { method: "POST", body: String(error.stack || error) });
      continue;
    }
    await fetch(`${address}/result`, { method: "POST", body: found });
  }
}

if (typeof process !== "undefined") serve(require(process.argv[2]), process.argv[3]);
