// Animated GIF: pictures as pixels, one palette for all, LZW.  Source: GIF89a specification (CompuServe, 1990).
"use strict";

(function () {
  /** The commonest colours of some pictures, at most 256, five bits a channel. */
  Bench.paletteOf = pictures => {
    const count = new Map();
    for (const data of pictures) {
      for (let k = 0; k < data.length; k += 4) {
        const key = ((data[k] >> 3) << 10) | ((data[k + 1] >> 3) << 5) | (data[k + 2] >> 3);
        const own = count.get(key);
        if (own) own.n++; else count.set(key, { n: 1, colour: [data[k], data[k + 1], data[k + 2]] });
      }
    }
    const all = [...count.values()].sort((a, b) => b.n - a.n).slice(0, 256).map(own => own.colour);
    while (all.length < 256) all.push([0, 0, 0]);
    return all;
  };

  /** Number of the nearest colour for every pixel. */
  function indexed(data, palette, known) {
    const found = new Uint8Array(data.length / 4);
    for (let k = 0; k < found.length; k++) {
      const r = data[4 * k], g = data[4 * k + 1], b = data[4 * k + 2], key = (r << 16) | (g << 8) | b;
      let best = known.get(key);
      if (best === undefined) {
        let least = Infinity;
        palette.forEach(([x, y, z], n) => {
          const far = (x - r) ** 2 + (y - g) ** 2 + (z - b) ** 2;
          if (far < least) { least = far; best = n; }
        });
        known.set(key, best);
      }
      found[k] = best;
    }
    return found;
  }

  /** LZW with codes of 9 to 12 bits, in blocks of at most 255 bytes. */
  function packed(pixels) {
    const out = [], CLEAR = 256, END = 257;
    let bits = 0, held = 0, size = 9, next = 258, table = new Map();
    const put = code => {
      held |= code << bits;
      for (bits += size; bits >= 8; bits -= 8) { out.push(held & 255); held >>>= 8; }
    };
    put(CLEAR);
    let prefix = pixels[0];
    for (let k = 1; k < pixels.length; k++) {
      const key = (prefix << 8) | pixels[k], known = table.get(key);
      if (known !== undefined) { prefix = known; continue; }
      put(prefix);
      if (next < 4096) {
        if (next === 1 << size) size++;
        table.set(key, next++);
      } else { put(CLEAR); table = new Map(); next = 258; size = 9; }
      prefix = pixels[k];
    }
    put(prefix);
    if (next === 1 << size && size < 12) size++;
    put(END);
    if (bits > 0) out.push(held & 255);
    const blocks = [8];
    for (let k = 0; k < out.length; k += 255) {
      const part = out.slice(k, k + 255);
      blocks.push(part.length, ...part);
    }
    blocks.push(0);
    return blocks;
  }

  const word = value => [value & 255, value >> 8];
  const letters = text => Array.from(text, letter => letter.charCodeAt(0));

  /** A GIF that repeats: pictures are pixels as RGBA, `delay` is in hundredths of a second. */
  Bench.toGif = (width, height, pictures, delay) => {
    const palette = Bench.paletteOf([pictures[0], pictures[pictures.length >> 1]]), known = new Map();
    const parts = [[...letters("GIF89a"), ...word(width), ...word(height), 0xf7, 0, 0, ...palette.flat()],
      [0x21, 0xff, 11, ...letters("NETSCAPE2.0"), 3, 1, 0, 0, 0]];
    for (const picture of pictures) {
      parts.push([0x21, 0xf9, 4, 4, ...word(delay), 0, 0, 0x2c, 0, 0, 0, 0, ...word(width), ...word(height), 0]);
      parts.push(packed(indexed(picture, palette, known)));
    }
    parts.push([0x3b]);
    return new Uint8Array(parts.flat());
  };
})();
