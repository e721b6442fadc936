// Symbols of links, joints and drivers as SVG elements.  `px` takes a place of the drawing to pixels.
"use strict";

(function () {
  const SPACE = "http://www.w3.org/2000/svg";

  /** An SVG element; attributes are set one by one, text as text. */
  Bench.svg = (name, attributes = {}, ...children) => {
    const made = document.createElementNS(SPACE, name);
    for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
    made.append(...children);
    return made;
  };
  const svg = Bench.svg, short = value => value.toFixed(2);
  Bench.pathOf = (points, closed = false) =>
    points.length ? `M${points.map(([x, y]) => `${short(x)} ${short(y)}`).join("L")}${closed ? "Z" : ""}` : "";

  /** Corners of the convex hull, for plates. */
  Bench.hull = points => {
    const own = [...points].sort((p, q) => p[0] - q[0] || p[1] - q[1]);
    const side = half => {
      const found = [];
      for (const p of half) {
        for (;;) {
          const [a, b] = found.slice(-2);
          if (!b || (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]) > 0) break;
          found.pop();
        }
        found.push(p);
      }
      return found.slice(0, -1);
    };
    return own.length < 3 ? own : [...side(own), ...side(own.reverse())];
  };

  /** Places that give a link its shape: its points, and those of its pairs. */
  Bench.shapeOf = (sheet, id) => {
    const ids = new Set(sheet.links[id].points);
    for (const pair of Object.values(sheet.pairs)) {
      const guiding = pair.kind === "P" || pair.kind === "pin-slot";
      if (pair.a === id && (!guiding || (id !== Bench.GROUND && sheet.links[id].points.length === 1))) ids.add(pair.at);
      if (pair.b === id) ids.add(pair.on || pair.at);
    }
    return [...ids].map(point => [sheet.points[point].x, sheet.points[point].y]);
  };

  /** The body of a moving link: a bar or a plate with round corners. */
  function body(sheet, id, px) {
    const corners = Bench.hull(Bench.shapeOf(sheet, id).map(px)), d = Bench.pathOf(corners, corners.length > 2);
    if (corners.length < 2) return [];
    return [svg("path", { class: "edge", d }), svg("path", { class: "body", d })];
  }

  const along = (at, angle, s, t = 0) =>
    [at[0] + s * Math.cos(angle) + t * Math.sin(angle), at[1] - s * Math.sin(angle) + t * Math.cos(angle)];

  /** Short strokes under a line: what they hang on stands still. */
  function hatch(at, angle, from, to) {
    const lines = [];
    for (let s = from; s <= to; s += 6) lines.push(Bench.pathOf([along(at, angle, s), along(at, angle, s - 5, 6)]));
    return svg("path", { class: "hatch", d: lines.join("") });
  }

  /** What a pair shows on its first link: guide, slot, wheel. */
  function guide(sheet, pair, px) {
    const at = px([sheet.points[pair.at].x, sheet.points[pair.at].y]);
    const angle = pair.kind === "gear" ? 0 : Bench.direction(sheet, pair);
    if (pair.kind === "gear") return wheel(sheet, pair.at, pair.radii[0], px);
    if (pair.kind === "cam") return [svg("path", { class: "wheel", d: Bench.pathOf(camCurve(pair, sheet, angle).map(px), true) })];
    let from = -64, to = 64;
    if (pair.along) {
      const ends = pair.along.map(id => px([sheet.points[id].x, sheet.points[id].y]));
      const places = ends.map(([x, y]) => (x - at[0]) * Math.cos(angle) - (y - at[1]) * Math.sin(angle));
      [from, to] = [Math.min(...places, -12), Math.max(...places, 12)];
    }
    if (pair.kind === "pin-slot") {
      const sides = [-6, 6].map(t => Bench.pathOf([along(at, angle, from, t), along(at, angle, to, t)]));
      return [svg("path", { class: "slot", d: sides.join("") })];
    }
    const line = svg("path", { class: "guide", d: Bench.pathOf([along(at, angle, from, 10), along(at, angle, to, 10)]) });
    return pair.a === Bench.GROUND ? [line, hatch(along(at, angle, 0, 10), angle, from + 6, to)] : [line];
  }

  /** The pitch curve of a cam in the drawing. */
  function camCurve(pair, sheet, angle) {
    const at = sheet.points[pair.at], found = [];
    for (let k = 0; k < 180; k++) {
      const psi = (k * Math.PI) / 90;
      const rho = pair.harmonics.reduce((sum, [c, s], n) =>
        sum + c * Math.cos((n + 1) * psi) + s * Math.sin((n + 1) * psi), pair.radius);
      found.push([at.x + rho * Math.cos(psi + angle), at.y + rho * Math.sin(psi + angle)]);
    }
    return found;
  }

  function wheel(sheet, id, radius, px) {
    const { x, y } = sheet.points[id], [cx, cy] = px([x, y]), [ex] = px([x + radius, y]), r = Math.abs(ex - cx);
    return [
      svg("circle", { class: "wheel", cx, cy, r: short(r) }),
      svg("path", { class: "spoke", d: Bench.pathOf([[cx, cy], [cx + r, cy]]) }),
    ];
  }

  /** What a pair shows on its second link: block, wheel, roller. */
  function follower(sheet, pair, px) {
    const at = px([sheet.points[pair.at].x, sheet.points[pair.at].y]);
    if (pair.kind === "gear") return wheel(sheet, pair.on, pair.radii[1], px);
    if (pair.kind === "cam") {
      const [cx, cy] = px([sheet.points[pair.on].x, sheet.points[pair.on].y]);
      return [svg("circle", { class: "roller", cx, cy, r: 8 })];
    }
    if (pair.kind === "pin-slot") return [];
    const turn = (-Bench.direction(sheet, pair) * 180) / Math.PI;
    const place = `translate(${short(at[0])} ${short(at[1])}) rotate(${turn.toFixed(3)})`;
    return [svg("rect", { class: "block", x: -15, y: -10, width: 30, height: 20, rx: 3, transform: place })];
  }

  /** Symbols that a link carries with it. */
  Bench.linkSymbols = (sheet, id, px) => {
    const parts = id === Bench.GROUND ? [] : body(sheet, id, px);
    // a slot is seen in the body, all else under it
    for (const pair of Object.values(sheet.pairs)) if (pair.a === id) parts[pair.kind === "pin-slot" ? "push" : "unshift"](...guide(sheet, pair, px));
    for (const pair of Object.values(sheet.pairs)) if (pair.b === id) parts.push(...follower(sheet, pair, px));
    return parts;
  };

  /** The symbol of a point about (0, 0): pin, fixed pivot, traced point. */
  Bench.pointSymbol = (sheet, id) => {
    const links = Bench.linksAt(sheet, id), parts = [];
    if (links.includes(Bench.GROUND)) {
      parts.push(svg("path", { class: "foot", d: "M0 0L-10 17H10Z" }), hatch([0, 17], 0, -9, 15));
    }
    const joint = links.length > 1, traced = sheet.points[id].trace;
    if (traced && !joint) parts.push(svg("path", { class: "traced", d: "M0 -5.5L5.5 0 0 5.5 -5.5 0Z" }));
    else parts.push(svg("circle", { class: joint || links.includes(Bench.GROUND) ? "pin" : "end", r: joint ? 5 : 4 }));
    return parts;
  };

  /** The arrow of a driver about (0, 0); `turn` is the direction of a linear one in degrees. */
  Bench.driverSymbol = (turns, turn) => {
    if (turns) {
      return [svg("path", { class: "drive", d: "M14.5 -10.5A18 18 0 1 0 17.9 2" }),
        svg("path", { class: "drivehead", d: "M12.8 4.6L23 5.4 18.6 -4Z" })];
    }
    const spin = `rotate(${turn.toFixed(2)})`;
    return [svg("path", { class: "drive", d: "M-22 -17H22", transform: spin }),
      svg("path", { class: "drivehead", d: "M20 -22L30 -17 20 -12Z", transform: spin })];
  };
})();
