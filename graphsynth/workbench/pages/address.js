// A whole mechanism in the part of the address after "#": packed JSON, read as carefully as a file.
"use strict";

(function () {
  const MOST = 60000, UNPACKED = 400000;

  function toBase64(bytes) {
    let text = "";
    for (let k = 0; k < bytes.length; k += 8192) text += String.fromCharCode(...bytes.subarray(k, k + 8192));
    return btoa(text).replace(/\+/g, "-").replace(/\//g, "_").replace(/=+$/, "");
  }

  function fromBase64(text) {
    if (!/^[A-Za-z0-9_-]*$/.test(text)) throw new Bench.Fault("fault.address");
    try { return Uint8Array.from(atob(text.replace(/-/g, "+").replace(/_/g, "/")), c => c.charCodeAt(0)); } catch {
      throw new Bench.Fault("fault.address");
    }
  }

  /** All bytes of a stream, refused as soon as there are too many. */
  async function drained(stream) {
    const reader = stream.getReader(), parts = [];
    let length = 0;
    for (;;) {
      const { done, value } = await reader.read();
      if (done) break;
      length += value.length;
      if (length > UNPACKED) {
        await reader.cancel();
        throw new Bench.Fault("fault.address");
      }
      parts.push(value);
    }
    const whole = new Uint8Array(length);
    parts.reduce((at, part) => { whole.set(part, at); return at + part.length; }, 0);
    return whole;
  }

  const through = (bytes, stream) => drained(new Blob([bytes]).stream().pipeThrough(stream));

  /** The fragment of a drawing: "#m=..." packed, "#j=..." where the browser packs nothing. */
  Bench.toFragment = async sheet => {
    const { pose, ...rest } = Bench.written(sheet);
    const bytes = new TextEncoder().encode(JSON.stringify({ u: sheet.unit, m: rest }));
    if (typeof CompressionStream === "undefined") return `#j=${toBase64(bytes)}`;
    return `#m=${toBase64(await through(bytes, new CompressionStream("deflate-raw")))}`;
  };

  /** The drawing of a fragment; null where it holds none, a `Fault` where it is damaged. */
  Bench.fromFragment = async fragment => {
    const found = /^#([mj])=(.*)$/s.exec(fragment);
    if (!found) return null;
    if (found[2].length > MOST) throw new Bench.Fault("fault.address.long", { most: MOST });
    let bytes = fromBase64(found[2]), data;
    try {
      if (found[1] === "m") bytes = await through(bytes, new DecompressionStream("deflate-raw"));
      data = JSON.parse(new TextDecoder("utf-8", { fatal: true }).decode(bytes));
    } catch { throw new Bench.Fault("fault.address"); }
    if (typeof data !== "object" || data === null || typeof data.m !== "object" || data.m === null) {
      throw new Bench.Fault("fault.address");
    }
    const file = { ...data.m }, links = typeof file.graph === "string" ? file.graph.charCodeAt(0) - 63 : 0;
    if (file.pose === undefined && links > 0 && links <= Bench.LIMITS.links) {
      file.pose = Array.from({ length: links }, () => [0, 0, 0]);
    }
    const sheet = Bench.opened(Bench.checked(file));
    return { ...sheet, unit: Bench.UNITS.includes(data.u) ? data.u : "mm" };
  };
})();
