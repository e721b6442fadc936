"use strict";
/* Calls compiled kernels of the library, which are WebAssembly here.

   A module is opened from its bytes and its table (NAME.wasm, NAME.json), or from its script, which registers both:

     const motion = await Kernels.load("motion");
     const [reached, reason] = motion.call("kinematics.engine.kernels.running.run", tables, wanted, ...);

   Arguments: a number or BigInt; true or false; null; an array of numbers, a typed array, {data, shape} or a
   `motion.array(...)`, which lies in the module's memory and is neither copied in nor out; for a tuple an array of its
   items, for a named one also an object of its fields.  An array that a kernel writes is written back.  Results: numbers
   (BigInt if larger than 2^53), {data, shape}, arrays of these for tuples.  What a kernel raises is thrown. */

const Kernels = (() => {
  const TYPES = {
    "?": ["b1", 1, Uint8Array], b: ["i1", 1, Int8Array], B: ["u1", 1, Uint8Array], h: ["i2", 2, Int16Array],
    H: ["u2", 2, Uint16Array], i: ["i4", 4, Int32Array], I: ["u4", 4, Uint32Array], l: ["i8", 8, BigInt64Array],
    L: ["u8", 8, BigUint64Array], f: ["f4", 4, Float32Array], d: ["f8", 8, Float64Array], D: ["c16", 16, Float64Array],
  };
  const LETTERS = Object.fromEntries(Object.entries(TYPES).map(([letter, [name]]) => [name, letter]));
  const product = (shape) => shape.reduce((a, b) => a * b, 1);
  const plain = (value) => (value >= -(2n ** 53n) && value <= 2n ** 53n ? Number(value) : value);

  /* Types of a table: "A" letter ndim layout w|r, "(" ... ")", "<" two digits ... ")", a letter. */
  function parse(text, tuples) {
    let at = 0;
    function items() {
      const found = [];
      while (text[at] !== ")") found.push(one());
      at++;
      return found;
    }
    function one() {
      const letter = text[at++];
      if (letter === "A") {
        at += 4;
        return { kind: "array", letter: text[at - 4], ndim: Number(text[at - 3]), writes: text[at - 1] === "w" };
      }
      if (letter === "(") return { kind: "tuple", items: items(), fields: null };
      if (letter === "<") {
        const [name, fields] = tuples[Number(text.slice(at, at + 2))];
        at += 2;
        return { kind: "tuple", items: items(), fields, name };
      }
      if (letter === "N") return { kind: "none" };
      if (letter === "O") return { kind: "omitted" };
      return { kind: "number", letter };
    }
    const found = [];
    while (at < text.length) found.push(one());
    return found;
  }

  /* What is raised: a class, and its arguments, in Python's pickle; the texts in it are enough. */
  function told(bytes) {
    const texts = [];
    for (let k = 0; k < bytes.length; k++) {
      const short = bytes[k] === 0x8c, long = bytes[k] === 0x58;
      if (!short && !long) continue;
      const size = short ? bytes[k + 1] : bytes[k + 1] | (bytes[k + 2] << 8);
      const from = k + (short ? 2 : 5);
      if (from + size > bytes.length) continue;
      texts.push(new TextDecoder().decode(bytes.subarray(from, from + size)));
      k = from + size - 1;
    }
    const kind = texts.find((text) => /^[A-Z]\w*(Error|Exception|Iteration)$/.test(text)) || "Error";
    const rest = texts.slice(texts.indexOf(kind) + 1).filter((text) => text.length > 0);
    return [kind, rest[0] || ""];
  }

  class KernelError extends Error {}

  /* An array in the memory of a module.  `data` is a view of it, made anew when the memory has moved. */
  class Kept {
    constructor(module, letter, shape) {
      this.module = module;
      this.letter = letter;
      this.shape = shape;
      const [, size, View] = TYPES[letter];
      this.length = (product(shape) * size) / View.BYTES_PER_ELEMENT;
      this.place = module.reserve(product(shape) * size);
      this.view = null;
      this.data.fill(View === BigInt64Array || View === BigUint64Array ? 0n : 0);
    }

    get data() {
      if (this.view === null || this.view.byteLength === 0 || this.view.buffer !== this.module.memory.buffer) {
        this.view = new TYPES[this.letter][2](this.module.memory.buffer, this.place, this.length);
      }
      return this.view;
    }
  }

  class Module {
    constructor(name, exports, table) {
      this.name = name;
      this.exports = exports;
      this.memory = exports.memory;
      this.kernels = new Map();
      for (const [kernel, { calls }] of Object.entries(table.kernels)) {
        const entries = calls.map(([entry, types, result, slotsIn, slotsOut]) => ({
          run: exports[entry], types: parse(types, table.tuples), result: parse(result, table.tuples)[0], slotsIn, slotsOut,
        }));
        this.kernels.set(kernel, entries);
      }
      this.slots = 0; /* room for arguments and results: grown as needed, kept */
      this.room = 0;
      this.taken = [];
    }

    reserve(bytes) {
      const place = this.exports.allocate(bytes);
      if (place === 0) throw new RangeError(`no memory for ${bytes} more bytes`);
      return place >>> 0;
    }

    /* An array of a type (as "f8") in the module's memory; `free` gives it back. */
    array(type, shape) {
      return new Kept(this, LETTERS[type], typeof shape === "number" ? [shape] : shape);
    }

    free(...arrays) {
      for (const array of arrays) this.exports.release(array.place);
    }

    has(kernel) {
      return this.kernels.has(kernel);
    }

    call(kernel, ...args) {
      const entries = this.kernels.get(kernel);
      if (entries === undefined) throw new TypeError(`module ${this.name} has no kernel ${kernel}`);
      const entry = entries.length === 1 ? entries[0] : entries.find((one) => this.fits(one.types, args));
      if (entry === undefined) throw new TypeError(`${kernel} is not compiled for these arguments`);
      return this.invoke(kernel, entry, args);
    }

    /* Whether arguments go with types: numbers of them, and of dimensions, and the kinds of typed arrays. */
    fits(types, args) {
      const taken = types.filter((type) => type.kind !== "omitted");
      return taken.length === args.length && taken.every((type, k) => this.fit(type, args[k]));
    }

    fit(type, value) {
      if (type.kind === "none") return value === null;
      if (type.kind === "number") return ["number", "bigint", "boolean"].includes(typeof value);
      if (value === null || typeof value !== "object") return false;
      if (type.kind === "tuple") {
        if (Array.isArray(value)) return this.fits(type.items, value);
        return type.fields !== null && type.fields.every((field, k) => field in value && this.fit(type.items[k], value[field]));
      }
      const shape = value.shape || [value.length];
      if (shape.length !== type.ndim) return false;
      if (value instanceof Kept) return value.letter === type.letter;
      const data = value.data || value;
      return !ArrayBuffer.isView(data) || data instanceof TYPES[type.letter][2];
    }

    invoke(kernel, entry, args) {
      const size = 8 * (entry.slotsIn + entry.slotsOut + 2);
      if (size > this.room) {
        if (this.slots) this.exports.release(this.slots);
        this.slots = this.reserve(size);
        this.room = size;
      }
      const call = { at: this.slots, taken: [] };
      try {
        const types = entry.types.filter((type) => type.kind !== "omitted");
        if (args.length !== types.length) throw new TypeError(`${kernel} takes ${types.length} arguments, not ${args.length}`);
        types.forEach((type, k) => this.put(type, args[k], call, `argument ${k + 1} of ${kernel}`));
        const out = this.slots + 8 * (entry.slotsIn + 1), about = this.slots + 8 * entry.slotsIn;
        const code = entry.run(this.slots, out, about);
        if (code !== 0 && code !== -2) this.raise(kernel, code, about);
        for (const { place, array } of call.taken) if (array) this.copyOut(place, array);
        const results = { at: out };
        return this.get(entry.result, results);
      } finally {
        for (const { place } of call.taken) this.exports.release(place);
      }
    }

    raise(kernel, code, about) {
      const view = new DataView(this.memory.buffer);
      const place = view.getUint32(about, true);
      if (code <= 0 || place === 0) throw new KernelError(`${kernel} failed`);
      const data = view.getUint32(place, true), size = view.getInt32(place + 4, true);
      const [kind, text] = told(new Uint8Array(this.memory.buffer, data, size));
      const error = new KernelError(text || kind);
      error.kind = kind;
      throw error;
    }

    put(type, value, call, what) {
      if (type.kind === "tuple") {
        const values = Array.isArray(value) || type.fields === null ? value : type.fields.map((field) => value[field]);
        if (!Array.isArray(values) || values.length !== type.items.length) {
          throw new TypeError(`${what} must be a tuple of ${type.items.length}`);
        }
        type.items.forEach((item, k) => this.put(item, values[k], call, `${type.fields ? type.fields[k] : `item ${k + 1}`} of ${what}`));
        return;
      }
      if (type.kind === "array") {
        this.putArray(type, value, call, what);
        return;
      }
      const slots = new DataView(this.memory.buffer, call.at, 16);
      call.at += 8;
      if (type.kind === "none") {
        if (value !== null) throw new TypeError(`${what} must be null`);
        return;
      }
      if (type.letter === "D") {
        const [re, im] = typeof value === "number" ? [value, 0] : value;
        slots.setFloat64(0, re, true);
        slots.setFloat64(8, im, true);
        call.at += 8;
      } else if (type.letter === "d") {
        if (typeof value !== "number") throw new TypeError(`${what} must be a number`);
        slots.setFloat64(0, value, true);
      } else if (type.letter === "f") slots.setFloat32(0, value, true);
      else if (typeof value === "bigint") slots.setBigInt64(0, value, true);
      else if (typeof value === "boolean" || Number.isSafeInteger(value)) slots.setBigInt64(0, BigInt(value), true);
      else throw new TypeError(`${what} must be a whole number`);
    }

    putArray(type, value, call, what) {
      const [name, size, View] = TYPES[type.letter];
      if (value === null || typeof value !== "object") throw new TypeError(`${what} must be an array`);
      const shape = value.shape || [type.letter === "D" ? value.length / 2 : value.length];
      const items = product(shape);
      let place;
      if (shape.length !== type.ndim) throw new TypeError(`${what} must have ${type.ndim} dimensions`);
      if (value instanceof Kept) {
        if (value.letter !== type.letter || value.module !== this) throw new TypeError(`${what} must be of ${name}`);
        place = value.place;
      } else {
        const data = value.data || value, length = (items * size) / View.BYTES_PER_ELEMENT;
        if (data.length !== length) throw new TypeError(`${what} has ${data.length} numbers, not ${length}`);
        place = this.reserve(items * size);
        const view = new View(this.memory.buffer, place, length);
        if (data instanceof View || !(view instanceof BigInt64Array || view instanceof BigUint64Array)) view.set(data);
        else for (let k = 0; k < length; k++) view[k] = BigInt(data[k]);
        call.taken.push({ place, array: type.writes ? data : null });
      }
      const slots = new DataView(this.memory.buffer, call.at, 8 * (5 + 2 * shape.length));
      [0, 0, items, size, place, ...shape].forEach((number, k) => slots.setBigInt64(8 * k, BigInt(number), true));
      for (let k = shape.length - 1, step = size; k >= 0; step *= shape[k--]) {
        slots.setBigInt64(8 * (5 + shape.length + k), BigInt(step), true);
      }
      call.at += 8 * (5 + 2 * shape.length);
    }

    copyOut(place, array) {
      if (ArrayBuffer.isView(array)) {
        const from = new Uint8Array(this.memory.buffer, place, array.byteLength);
        new Uint8Array(array.buffer, array.byteOffset, array.byteLength).set(from);
      }
    }

    get(type, results) {
      if (type.kind === "tuple") return type.items.map((item) => this.get(item, results));
      const slots = new DataView(this.memory.buffer, results.at);
      if (type.kind === "array") return this.getArray(type, slots, results);
      results.at += 8;
      switch (type.letter) {
        case undefined: return null;
        case "?": return (slots.getUint8(0) & 1) === 1;
        case "d": return slots.getFloat64(0, true);
        case "f": return slots.getFloat32(0, true);
        case "D": results.at += 8; return [slots.getFloat64(0, true), slots.getFloat64(8, true)];
        case "b": return slots.getInt8(0);
        case "h": return slots.getInt16(0, true);
        case "i": return slots.getInt32(0, true);
        case "l": return plain(slots.getBigInt64(0, true));
        default: return plain(slots.getBigUint64(0, true));
      }
    }

    /* An array that is returned is copied, in the order of its indices, and let go. */
    getArray(type, slots, results) {
      const [, size, View] = TYPES[type.letter];
      const number = (k) => Number(slots.getBigInt64(8 * k, true));
      const shape = Array.from({ length: type.ndim }, (_, k) => number(5 + k));
      const strides = shape.map((_, k) => number(5 + type.ndim + k));
      const owner = slots.getUint32(0, true), place = slots.getUint32(32, true);
      results.at += 8 * (5 + 2 * type.ndim);
      const bytes = new Uint8Array(product(shape) * size), memory = new Uint8Array(this.memory.buffer);
      const copy = (axis, from, to) => {
        if (axis === shape.length) bytes.set(memory.subarray(from, from + size), to);
        else {
          const step = product(shape.slice(axis + 1)) * size;
          if (strides[axis] === step && shape.slice(axis + 1).every((_, k) => strides[axis + 1 + k] === product(shape.slice(axis + 2 + k)) * size)) {
            bytes.set(memory.subarray(from, from + shape[axis] * step), to);
          } else for (let k = 0; k < shape[axis]; k++) copy(axis + 1, from + k * strides[axis], to + k * step);
        }
      };
      copy(0, place, 0);
      this.exports.drop(owner);
      return { data: new View(bytes.buffer), shape };
    }
  }

  const registered = new Map(); /* by name: how a module is opened, then the module */
  const announced = [];         /* what the scripts of modules said, for a worker */

  /* Open a module from its bytes and its table. */
  async function open(name, bytes, table) {
    const { instance } = await WebAssembly.instantiate(bytes, {});
    return new Module(name, instance.exports, table);
  }

  /* What the script of a module calls: its table, and its bytes, compressed and as text. */
  function register(name, table, text) {
    announced.push(["kernels", name, table, text]);
    registered.set(name, async () => {
      const packed = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
      const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
      return open(name, await new Response(stream).arrayBuffer(), table);
    });
  }

  /* The module whose script has been read; it is opened once. */
  function load(name) {
    const found = registered.get(name);
    if (found === undefined) return Promise.reject(new Error(`the script of module ${name} was not read`));
    if (typeof found !== "function") return found;
    const opened = found();
    registered.set(name, opened);
    return opened;
  }

  return { open, register, load, scripts: () => announced, KernelError };
})();

if (typeof module !== "undefined") module.exports = Kernels;
